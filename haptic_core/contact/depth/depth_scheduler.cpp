// A back end leaves out what overlaps by more than deepest_m when coarse. The felt surface leaves a coarse triangle's
// plane along z by its relief times (axis . n) / n.z, so over the triangles that face each other no overlap is more
// than
//   deepest_m + greatest rise of S's + greatest rise of T's,
// and a soft maximum over an area A is more than the greatest overlap by at most w ln(A / a0).
#include "haptic_core/contact/depth/depth_scheduler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/constants.h"

namespace farfeel::contact {
namespace {

constexpr double kMust = std::numeric_limits<double>::infinity();
constexpr double kFirst = 0.999;  // of those that do not have to be searched

/// How far the felt surface stands out of its coarse triangles, along z, towards the other: outward is C's z axis for S
/// and its opposite for T.
double greatest_rise_m(const penetration::Patch& patch, const glm::dvec3& outward_C) {
  const glm::dvec3 outward_O = spatial::rotate_back(patch.X_CO, outward_C);
  double most_m = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : patch.triangles) {
    const glm::dvec3& n_O = patch.surface->unit_normal_O(i);
    const double facing = glm::dot(n_O, outward_O);
    if (!(facing > 0)) continue;
    const std::uint32_t chart = patch.surface->haptic().triangle_chart[i];
    const double along = chart == geometry::kNoChart ? 0 : glm::dot(patch.surface->chart_axis_O(chart), n_O);
    const double stretch = along / std::max(facing, kLeastFacing);
    const penetration::Relief& relief = patch.surface->relief(i);
    most_m = std::max({most_m, stretch * relief.low_m, stretch * relief.high_m});
  }
  return most_m;
}

}  // namespace

DepthScheduler::DepthScheduler(const penetration::FeltSurface& tool, const DepthSchedule& schedule)
    : schedule_(schedule) {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  for (const glm::dvec3& p : tool.haptic().coarse.positions_O) low = glm::min(low, p), high = glm::max(high, p);
  const glm::dvec3 size = high - low;
  tool_area_m2_ = std::max(glm::dot(size, size), penetration::kReferenceArea_m2);
  if (ablated(Mechanism::kDepthScheduler)) schedule_.may_extrapolate = false;
}

double DepthScheduler::most_depth_m(const penetration::Query& query) const noexcept {
  const double w = query.soft_width_m;
  return query.deepest_m + greatest_rise_m(query.s, {0, 0, 1}) + greatest_rise_m(query.t, {0, 0, -1}) +
         w * (std::log(tool_area_m2_ / penetration::kReferenceArea_m2) + kQuadratureWidths);
}

double DepthScheduler::urgency_of(const penetration::Query& query, double most_depth_m) const noexcept {
  const Searched* const searched = searched_.find(query.contact);
  const bool is_known = searched && searched->last.is_of(query);
  if (most_depth_m < -kClearlyApart_m) {
    if (!is_known) return kFirst;
    return std::min(searched->last.way_m(query) / (kGapShare * -most_depth_m), kFirst);
  }
  if (!is_known || !has_budget() || query.wants_hessian) return kMust;
  return std::max(searched->last.way_m(query) / kAllowedWay_m, (searched->answers + 1) / (kAllowedAnswers + 1));
}

void DepthScheduler::add(std::size_t i, const penetration::Query& query) noexcept {
  DepthJob& job = jobs_[count_++];
  job.i = i;
  job.query = query;
  job.most_depth_m = schedule_.may_extrapolate ? most_depth_m(query) : std::numeric_limits<double>::infinity();
  job.urgency = urgency_of(query, job.most_depth_m);
}

std::span<DepthJob> DepthScheduler::by_urgency() noexcept {
  const std::span<DepthJob> all{jobs_.data(), count_};
  std::sort(all.begin(), all.end(), [](const DepthJob& a, const DepthJob& b) {
    return a.urgency != b.urgency ? a.urgency > b.urgency : a.i < b.i;
  });
  return all;
}

bool DepthScheduler::takes(const DepthJob& job, std::size_t searched, std::uint64_t costly) noexcept {
  if (job.urgency >= 1) return true;
  const bool is_left = has_budget() ? searched < schedule_.most_searches && costly < kCostlySearches : others_ == 0;
  if (!is_left || !(job.urgency > kWorthASearch)) return false;
  ++others_;
  return true;
}

void DepthScheduler::keep(const penetration::Query& query, const penetration::Penetration& found,
                          const HeightLack& lack) noexcept {
  if (query.contact == 0) return;
  if (!found.is_known()) return searched_.forget(query.contact);
  Searched& searched = searched_.keep(query.contact);
  searched.last.begin(query, found);
  searched.answers = 0;
  searched.lack = lack;
}

penetration::Penetration DepthScheduler::extrapolated(const DepthJob& job) noexcept {
  Searched* const searched = searched_.find(job.query.contact);
  if (!searched || !searched->last.is_of(job.query)) return {};
  ++searched->answers;
  penetration::Penetration depth = searched->last.at(job.query);
  depth.depth_m = std::min(depth.depth_m, job.most_depth_m);
  return depth;
}

HeightLack DepthScheduler::lack(std::uint32_t contact) const noexcept {
  const Searched* const searched = searched_.find(contact);
  return searched ? searched->lack : HeightLack{};
}

}  // namespace farfeel::contact
