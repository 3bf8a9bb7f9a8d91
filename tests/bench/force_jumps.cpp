#include "tests/bench/force_jumps.h"

#include <algorithm>

namespace farfeel::bench {
namespace {

constexpr double kSamePlace_m = 3e-3, kSameDirection = 0.2;  // of a contact that merely changed its id
constexpr double kTurned = 1e-4;                             // a direction that has turned by more has turned
constexpr double kElsewhere_m = 1e-3;                        // beyond the tool's own way
constexpr double kLeastWay_m = 1e-5;

glm::dvec3 force_N(const contact::Contact& c) {
  const glm::dvec3 slope{c.gradient[3], c.gradient[4], c.gradient[5]};
  return -c.material.stiffness_N_per_m * std::max(c.depth_m, 0.0) * slope;
}

/// The same contact in another frame: by its id, else by its place and direction.
const contact::Contact* counterpart(const contact::Contact& c, const std::vector<contact::Contact>& others) {
  for (const contact::Contact& other : others) {
    if (other.id == c.id) return &other;
  }
  for (const contact::Contact& other : others) {
    if (glm::distance(other.p_WC_W, c.p_WC_W) < kSamePlace_m &&
        glm::distance(other.nhat_ST_W, c.nhat_ST_W) < kSameDirection) {
      return &other;
    }
  }
  return nullptr;
}

}  // namespace

void ForceJumps::add(const contact::ContactSet& set) {
  const std::vector<contact::Contact> now(set.contacts.begin(), set.contacts.begin() + set.count);
  const double way_m = glm::distance(set.X_WT.p, last_X_WT_.p);
  const auto note = [&](JumpCause cause, double jump_N) {
    auto &most_N = greatest_N_[static_cast<std::size_t>(cause)],
         &steepest = greatest_N_per_mm_[static_cast<std::size_t>(cause)];
    most_N = std::max(most_N, jump_N);
    steepest = std::max(steepest, jump_N / (1e3 * std::max(way_m, kLeastWay_m)));
  };
  if (has_last_) {
    for (const contact::Contact& c : now) {
      const contact::Contact* before = counterpart(c, last_);
      if (!before) {
        note(JumpCause::kComesOrGoes, glm::length(force_N(c)));
        continue;
      }
      const bool turned = glm::distance(before->nhat_ST_W, c.nhat_ST_W) > kTurned;
      const bool is_elsewhere = glm::distance(before->p_WC_W, c.p_WC_W) > kElsewhere_m + way_m;
      note(turned         ? JumpCause::kTurns
           : is_elsewhere ? JumpCause::kPeakElsewhere
                          : JumpCause::kSamePeak,
           glm::distance(force_N(c), force_N(*before)));
    }
    for (const contact::Contact& c : last_) {
      if (!counterpart(c, now)) note(JumpCause::kComesOrGoes, glm::length(force_N(c)));
    }
  }
  last_ = now;
  last_X_WT_ = set.X_WT;
  has_last_ = true;
}

}  // namespace farfeel::bench
