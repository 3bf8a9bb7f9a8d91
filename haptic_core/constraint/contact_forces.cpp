#include "haptic_core/constraint/contact_forces.h"

#include <algorithm>
#include <array>

#include "haptic_core/constraint/contact_step.h"

namespace farfeel::constraint {
namespace {

/// What of the news is let in where all of it would cost more than there is, tried in turn. None costs nothing.
constexpr std::array kNewsShares{1.0, 0.5, 0.2, 0.05, 0.0};

}  // namespace

void solve_contacts(std::span<const Row> all, const spatial::Pose& X_WQ, const spatial::Pose& X_WT,
                    const Mobility& moves, const Law& law, double afford_J, ContactMemory& memory,
                    ContactForces& out) noexcept {
  const std::span<const Row> rows = all.first(std::min<std::size_t>(all.size(), kMaxRows));
  out = {};
  if (rows.empty()) {
    out.V_moved = moves.V_free;
    out.taken_J = memory.stored_J;
    memory = {};
    return;
  }
  ContactStep step(rows, X_WQ, X_WT, moves, law, memory);
  for (const double share : kNewsShares) {
    out.is_solved = step.solve(share);
    out.is_news_unpaid = share < 1;
    if (!step.has_news() || step.taken_J() >= -afford_J) break;
  }
  out.F_To_W = step.F_To_W();
  out.V_moved = step.V_moved();
  out.iterations = step.iterations();
  out.taken_J = step.taken_J();
  step.remember(memory, out);
}

}  // namespace farfeel::constraint
