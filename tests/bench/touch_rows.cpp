#include "tests/bench/touch_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_core/contact/doubts.h"

namespace farfeel::bench {
namespace {

std::string doubts_told(std::uint8_t doubts) {
  std::string names;
  for (const contact::NamedDoubt& doubt : contact::kNamedDoubts) {
    if ((doubts & doubt.bit) != 0) names += fmt::format("{}{}", names.empty() ? "" : "+", doubt.name);
  }
  return names.empty() ? "no doubt" : names;
}

std::string vector_told(const glm::dvec3& v) {
  return fmt::format("({:.3f} {:.3f} {:.3f})", v.x, v.y, v.z);
}

std::string told(const Told& t) {
  return fmt::format("told {:.3f} mm {} N, {}; true {:.3f} mm out {}{}{}", 1e3 * t.depth_m, vector_told(t.force_N),
                     doubts_told(t.doubts), 1e3 * t.truth.main.depth_m, vector_told(t.truth.main.out_O),
                     t.truth.is_past_middle ? ", past the middle" : "", t.truth.is_squeezed ? ", squeezed" : "");
}

}  // namespace

void TouchRow::add(const Told& at, const Verdict& v) {
  ++places;
  missed += v.missed, is_false += v.is_false, inward += v.inward, unflagged += v.unflagged;
  past_middle += at.truth.is_past_middle, squeezed += at.truth.is_squeezed;
  if (!(at.truth.main.depth_m > 0)) return;
  right += v.is_right, right_flagged += v.is_right && v.is_flagged;
  depth_errors_um.push_back(static_cast<float>(1e6 * std::abs(at.depth_m - at.truth.depth_nearest_m(at.depth_m))));
  if (!at.truth.is_squeezed && std::isfinite(at.angle_rad))
    angles_deg.push_back(static_cast<float>(at.angle_rad * 180 / std::numbers::pi));
}

void TouchRow::add(const TouchRow& other) {
  places += other.places, missed += other.missed, is_false += other.is_false, inward += other.inward;
  unflagged += other.unflagged, right += other.right, right_flagged += other.right_flagged;
  past_middle += other.past_middle, squeezed += other.squeezed;
  angles_deg.insert(angles_deg.end(), other.angles_deg.begin(), other.angles_deg.end());
  depth_errors_um.insert(depth_errors_um.end(), other.depth_errors_um.begin(), other.depth_errors_um.end());
}

double TouchRow::flagged_right() const {
  return right > 0 ? static_cast<double>(right_flagged) / static_cast<double>(right) : 0;
}

void TouchFailures::add(TouchFailure failure) {
  std::vector<TouchFailure>& kept = by_kind_[failure.kind];
  // Spread over models and tools: one place of each, and of that the shallowest press.
  const bool is_pair_told = std::any_of(kept.begin(), kept.end(), [&](const TouchFailure& other) {
    return other.model == failure.model && other.tool == failure.tool;
  });
  if (failure.kind == kAskedFor || (kept.size() < kTold && !is_pair_told)) kept.push_back(std::move(failure));
}

void TouchFailures::add(const TouchFailures& others) {
  for (const auto& [kind, failures] : others.by_kind_) {
    for (const TouchFailure& failure : failures) add(failure);
  }
}

void TouchFailures::print() const {
  for (const auto& [kind, failures] : by_kind_) {
    for (const TouchFailure& f : failures) {
      const Told* shown = &f.at;
      if (kind == "false") {  // where the force was, on the way in
        for (const Told& t : f.before)
          if (glm::length(t.force_N) > kFalseForce_N) shown = &t;
      }
      fmt::print(
          "  {}: --model {} --tool {} --press {:g} --seed {} --place {}\n    tool at {} mm, pressed {:.3f} mm "
          "at {:.0f} mm/s: {}\n",
          kind, f.model, f.tool, 1e3 * f.at.pressed_m, f.seed, f.index,
          vector_told(1e3 * f.place.X_OT(shown->pressed_m).p), 1e3 * shown->pressed_m, 1e3 * f.place.speed_m_s,
          told(*shown));
    }
  }
}

nlohmann::json row_json(const std::string& model, const std::string& tool, double press_m, const TouchRow& row,
                        double allowed_m) {
  return {{"model", model},
          {"tool", tool},
          {"press_mm", 1e3 * press_m},
          {"places", row.places},
          {"missed", row.missed},
          {"false", row.is_false},
          {"inward", row.inward},
          {"direction_p50_deg", quantile(row.angles_deg, 0.5)},
          {"direction_p95_deg", quantile(row.angles_deg, 0.95)},
          {"depth_err_p50_um", quantile(row.depth_errors_um, 0.5)},
          {"depth_err_p99_um", quantile(row.depth_errors_um, 0.99)},
          {"unflagged", row.unflagged},
          {"flagged_right", row.flagged_right()},
          {"allowed_um", 1e6 * allowed_m},
          {"past_middle", row.past_middle},
          {"squeezed", row.squeezed}};
}

}  // namespace farfeel::bench
