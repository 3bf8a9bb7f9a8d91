#include "haptic_core/local_model/local_contacts.h"

#include <cmath>

#include "haptic_core/local_model/felt_contact.h"

namespace farfeel::local_model {
namespace {

constexpr std::uint32_t kTilesATick = 4;     // taking one over costs some microseconds
constexpr std::uint32_t kSearchesATick = 2;  // of contacts: each costs some tens of microseconds
constexpr double kSamePlace_m = 0.02;        // a remote contact stands in for one of ours this near, in the tool
constexpr double kSameDirection = 0.5;       // cosine

contact_service::ContactService service_of(const TileCache& cache) {
  const std::vector<contact_service::TouchableObject> all = cache.touchable();
  const contact_service::FeltScene& scene = cache.scene();
  return {std::span(all).subspan(1), all.front(),
          contact_service::ContactOptions{.tolerance_m = scene.tolerance_m,
                                          .grid_samples = scene.grid_samples,
                                          .soft_width_m = scene.soft_width_m,
                                          .most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m,
                                          .hands_over = false,  // the local model does, and pays for it
                                          .heights = &cache,
                                          .most_searches = kSearchesATick}};
}

/// The remote's contact, taken along with its object and the tool to where they are now.
contact::Contact taken_along(const contact::ContactSet& remote, std::uint32_t i, const motion::MovingObjects& moving,
                             const spatial::Pose& X_WT) {
  FeltContact felt = felt_contact(remote.contacts[i], remote.X_WT);
  if (const motion::Moved* moved = moving.find(remote.contacts[i].object))
    felt.go_along(moving.way_since(*moved, 1e-9 * static_cast<double>(remote.pose_time_ns)));
  const FeltContact::Sample sample = felt.sample(X_WT);
  contact::Contact here = felt.at_X0;
  here.depth_m = sample.depth_m;
  here.gradient = sample.gradient;
  here.p_WC_W = X_WT.p + sample.p_ToC_W;
  return here;
}

}  // namespace

StandIns stand_ins(const contact::ContactSet& ours, const std::array<bool, contact::kMaxContacts>& lacks,
                   const contact::ContactSet& remote) noexcept {
  StandIns chosen;
  chosen.fill(kNobody);
  std::array<double, contact::kMaxContacts> chosen_m{};
  const auto place_T = [](const contact::ContactSet& set, std::uint32_t i) {
    return glm::conjugate(set.X_WT.R) * (set.contacts[i].p_WC_W - set.X_WT.p);
  };
  const auto looks_like = [&](std::uint32_t r, std::uint32_t i) {
    const contact::Contact &there = remote.contacts[r], &here = ours.contacts[i];
    return there.object == here.object && glm::dot(there.nhat_ST_W, here.nhat_ST_W) >= kSameDirection;
  };
  std::array<bool, contact::kMaxContacts> is_far{};
  for (std::uint32_t r = 0; r < remote.count; ++r) {
    const glm::dvec3 p_T = place_T(remote, r);
    std::uint32_t nearest = kNobody;
    double nearest_m = kSamePlace_m;
    for (std::uint32_t i = 0; i < ours.count; ++i) {
      if (!looks_like(r, i)) continue;
      if (const double apart_m = glm::distance(p_T, place_T(ours, i)); apart_m < nearest_m)
        nearest_m = apart_m, nearest = i;
    }
    is_far[r] = nearest == kNobody;
    if (nearest == kNobody || !lacks[nearest]) continue;
    if (chosen[nearest] == kNobody || nearest_m < chosen_m[nearest]) chosen[nearest] = r, chosen_m[nearest] = nearest_m;
  }
  // Where coarse faces lie flat on each other the point of a contact may be any of theirs, however far.
  for (std::uint32_t i = 0; i < ours.count; ++i) {
    for (std::uint32_t r = 0; lacks[i] && chosen[i] == kNobody && r < remote.count; ++r) {
      if (is_far[r] && looks_like(r, i)) chosen[i] = r, is_far[r] = false;
    }
  }
  return chosen;
}

LocalContacts::LocalContacts(TileCache& cache) : cache_(cache), service_(service_of(cache)) {}

void LocalContacts::hear(const contact::ContactSet& set) noexcept {
  remote_ = set;
  is_remote_new_ = true;
}

const TickContacts& LocalContacts::ahead_of(contact_service::ToolPose tool, double ahead_s) noexcept {
  tool.time_ns += std::llround(1e9 * ahead_s);
  tool.X_WT = spatial::integrate(tool.X_WT, tool.V_WT_W, ahead_s);
  return at(tool);
}

const TickContacts& LocalContacts::at(const contact_service::ToolPose& tool) noexcept {
  cache_.take_arrived(kTilesATick);
  const contact::ContactSet& found = service_.answer(tool);
  if (is_remote_new_) tick_.remote_age_s = 1e-9 * static_cast<double>(tool.time_ns - remote_.pose_time_ns);
  tick_.set.pose_sequence = found.pose_sequence;
  tick_.set.pose_time_ns = found.pose_time_ns;
  tick_.set.X_WT = found.X_WT;
  tick_.set.pairs_near = found.pairs_near;
  tick_.set.count = tick_.from_tiles = tick_.from_remote = tick_.lacking = 0;
  std::array<bool, contact::kMaxContacts> lacks{};
  for (std::uint32_t i = 0; i < found.count; ++i) lacks[i] = service_.lacks_heights(found.contacts[i].id);
  const StandIns chosen = stand_ins(found, lacks, remote_);
  for (std::uint32_t i = 0; i < found.count; ++i) {
    tick_.lacking += lacks[i];
    if (lacks[i] && chosen[i] == kNobody) continue;
    contact::Contact& contact = tick_.set.contacts[tick_.set.count];
    contact = lacks[i] ? taken_along(remote_, chosen[i], service_.moving(), tool.X_WT) : found.contacts[i];
    contact.id = found.contacts[i].id;
    ++(lacks[i] ? tick_.from_remote : tick_.from_tiles);
    tick_.source[tick_.set.count++] = !lacks[i]        ? Source::kTiles
                                      : is_remote_new_ ? Source::kNewRemote
                                                       : Source::kOldRemote;
  }
  is_remote_new_ = false;
  return tick_;
}

}  // namespace farfeel::local_model
