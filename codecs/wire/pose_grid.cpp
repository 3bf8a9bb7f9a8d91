#include "codecs/wire/pose_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "codecs/wire/quantised.h"

namespace farfeel::codecs {
namespace {

using transport::ByteWriter;

std::int32_t read_coordinate(CheckedReader& r) {
  const std::int32_t v = read_i24(r.raw());
  if (v < -kGridHalf) r.refuse();
  return v;
}

}  // namespace

double PoseGrid::step_m() const noexcept {
  return std::ldexp(1.0, exponent);
}

PoseGrid grid_around(const glm::dvec3& low_W, const glm::dvec3& high_W) noexcept {
  PoseGrid grid{0.5 * (low_W + high_W), kFinestExponent};
  const glm::dvec3 size = glm::abs(high_W - low_W);
  const double reach_m = std::max({size.x, size.y, size.z});
  while (grid.exponent < kCoarsestExponent && !(grid.step_m() * kGridHalf >= reach_m)) ++grid.exponent;
  return grid;
}

std::size_t write(const PoseGrid& grid, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  write_f64(w, grid.middle_W);
  w.u8(static_cast<std::uint8_t>(grid.exponent));
  return w.ok() ? w.size() : 0;
}

Fault read(std::span<const std::byte> from, PoseGrid& out) noexcept {
  if (from.size() != kPoseGridBytes) return Fault::kLength;
  CheckedReader r(from);
  PoseGrid grid;
  grid.middle_W = r.vector_f64(kMaxCoordinate_m);
  grid.exponent = static_cast<std::int8_t>(r.raw().u8());
  if (grid.exponent < kFinestExponent || grid.exponent > kCoarsestExponent) r.refuse();
  if (r.fault() != Fault::kNone) return r.fault();
  out = grid;
  return Fault::kNone;
}

std::optional<Steps> steps_of(const glm::dvec3& v, double step_m) noexcept {
  const glm::dvec3 steps = v / step_m;
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(steps[i]) <= kGridHalf)) return std::nullopt;  // NaN too
  const auto whole = [](double s) { return static_cast<std::int32_t>(std::nearbyint(s)); };
  return Steps{whole(steps.x), whole(steps.y), whole(steps.z)};
}

glm::dvec3 from_steps(const Steps& steps, double step_m) noexcept {
  return step_m * glm::dvec3{steps.x, steps.y, steps.z};
}

void write_steps(ByteWriter& w, const Steps& steps) noexcept {
  for (const std::int32_t s : {steps.x, steps.y, steps.z}) write_i24(w, s);
}

Steps read_steps(CheckedReader& r) noexcept {
  Steps steps;
  for (std::int32_t* s : {&steps.x, &steps.y, &steps.z}) *s = read_coordinate(r);
  return steps;
}

ToldPose told(const spatial::Pose& X, const PoseGrid& grid) noexcept {
  return {steps_of(X.p - grid.middle_W, grid.step_m()), X.p, rotation_of(X.R)};
}

spatial::Pose from_told(const ToldPose& pose, const PoseGrid& grid) noexcept {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  spatial::Pose X;
  X.p = pose.steps ? grid.middle_W + from_steps(*pose.steps, grid.step_m()) : pose.p;
  X.R = from_rotation(pose.rotation).value_or(glm::dquat{kNaN, kNaN, kNaN, kNaN});
  return X;
}

void write_told(ByteWriter& w, const ToldPose& pose) noexcept {
  if (pose.steps) {
    write_steps(w, *pose.steps);
  } else {
    write_f64(w, pose.p);
  }
  w.u64(pose.rotation);
}

spatial::Pose read_told(CheckedReader& r, bool is_in_full, const PoseGrid& grid) noexcept {
  ToldPose pose;
  if (is_in_full) {
    pose.p = r.vector_f64(kMaxCoordinate_m);
  } else {
    pose.steps = read_steps(r);
  }
  pose.rotation = r.raw().u64();
  const spatial::Pose X = from_told(pose, grid);
  if (!spatial::is_valid(X)) r.refuse();
  return X;
}

}  // namespace farfeel::codecs
