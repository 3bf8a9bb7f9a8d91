#include "haptic_core/constraint/contact_forces.h"

#include <algorithm>
#include <array>

#include "haptic_core/constraint/contact_step.h"

namespace farfeel::constraint {
namespace {

constexpr int kRounds = 2, kMostRounds = 4;  // more where a row has begun to slide in the last
/// What steps that are not quite solved may make more than friction took: so much in a second, a quarter of the tank's
/// allowance. Of what was taken before so much is kept, and so much of what the pad stores, for a second: rows that jam
/// make and take by turns.
constexpr double kMostMade_W = 0.5e-3, kOfPad = 0.01, kKept_s = 1;
/// What friction becomes where a step would make more, one after the other. A little less mostly is enough, and does
/// not let go of a wedge; none makes nothing.
constexpr std::array kWeaker{0.9, 0.7, 0.4, 0.0};

}  // namespace

void solve_contacts(std::span<const Row> all, const spatial::Pose& X_WQ, const spatial::Pose& X_WT,
                    const Mobility& moves, const Law& law, ContactMemory& memory, ContactForces& out) noexcept {
  const std::span<const Row> rows = all.first(std::min<std::size_t>(all.size(), kMaxRows));
  const int n = static_cast<int>(rows.size());
  ContactStep step(rows, X_WQ, X_WT, moves, law, memory);
  out = {};
  const auto push = [&] {
    const SolveFigures figures = step.push();
    out.iterations += figures.iterations;
    out.is_solved = out.is_solved && figures.is_solved;
  };
  bool has_begun = false;
  for (int round = 0; round < (has_begun ? kMostRounds : kRounds); ++round) {
    push();
    if (!step.has_friction()) break;
    step.hold();
    has_begun = step.drag();
  }
  if (step.has_friction()) {
    const double most_J = kMostAfforded_J + kOfPad * 0.5 * glm::dot(memory.pad_s_W, memory.pad_s_W);
    const double kept_J = std::max(0.0, memory.afforded_J - most_J) * std::max(0.0, 1 - moves.dt_s / kKept_s);
    const double afforded_J = std::min(memory.afforded_J + kMostMade_W * moves.dt_s, most_J) + kept_J;
    for (const double weaker : kWeaker) {
      if (step.made_J() <= afforded_J) break;
      step.weaken(weaker);
      push();
      ++out.weakened;
    }
    memory.afforded_J = std::clamp(afforded_J - step.made_J(), 0.0, most_J + kept_J);
  }

  out.F_To_W = step.F_To_W();
  out.V_moved = step.V_moved();
  out.normal = step.normal();
  out.friction_shift_W = spatial::to_glm(step.friction_shift_W());
  for (int i = 0; i < n; ++i) {
    memory.forces[i] = step.force(i);
    out.is_any_saturated = out.is_any_saturated || memory.forces[i].is_saturated;
  }
  memory.count = n;
  memory.pad_s_W = spatial::to_glm(step.s_W());
}

}  // namespace farfeel::constraint
