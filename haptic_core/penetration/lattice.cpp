// Node i belongs to the one cell with I r <= i + 1/2 < (I + 1) r, where r is the ratio of cell and step.
#include "haptic_core/penetration/lattice.h"

#include <algorithm>
#include <array>

namespace farfeel::penetration {
namespace {

constexpr std::size_t kAtOnce = 4;  ///< nodes of a row, as plain loops over local arrays become vectors
static_assert(kAtOnce <= simd::kMostLanes);

/// The least integer that is not below x, to a millionth. std::ceil is a call.
std::int64_t not_below(double x) {
  constexpr std::int64_t kMostNodes = std::int64_t{1} << 32;  // to either side
  return kMostNodes - static_cast<std::int64_t>(kMostNodes - x);
}

/// Nodes from `first` to before `end`, along one side.
struct Nodes {
  std::int64_t first, end;

  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(end - first); }
};

struct Side {
  double origin_m, cell_m, step_m, low_m, high_m;
  double cells_per_m = 1 / cell_m, ratio = cell_m / step_m;

  [[nodiscard]] Nodes of(double centre_m) const {
    const auto I = static_cast<double>(not_below((centre_m - origin_m) * cells_per_m - 1));
    Nodes nodes{not_below(I * ratio - 0.5), not_below((I + 1) * ratio - 0.5)};
    if (centre_m - 0.5 * cell_m < low_m) nodes.first = std::min(nodes.first, -not_below((origin_m - low_m) / step_m));
    if (centre_m + 0.5 * cell_m > high_m) nodes.end = std::max(nodes.end, not_below((high_m - origin_m) / step_m));
    return nodes;
  }
  [[nodiscard]] float place_of(std::int64_t node) const {
    return static_cast<float>(origin_m + (static_cast<double>(node) + 0.5) * step_m);
  }
};

}  // namespace

std::size_t lay(const Lattices& lattices, const simd::LaneCells& cells, std::span<const std::uint32_t> chosen,
                std::size_t most, const simd::LaneCells& nodes) noexcept {
  const auto side = [&](int k) {
    return Side{lattices.origin_m[k], lattices.cell_m, lattices.step_m, lattices.window.low[k],
                lattices.window.high[k]};
  };
  const Side across = side(0), down = side(1);
  const auto step = static_cast<float>(lattices.step_m);
  std::array<float, kAtOnce> steps;
  for (std::size_t n = 0; n < kAtOnce; ++n) steps[n] = static_cast<float>(n) * step;
  std::size_t count = 0;
  for (const std::uint32_t k : chosen) {
    const Nodes columns = across.of(static_cast<double>(cells.u[k])), rows = down.of(static_cast<double>(cells.v[k]));
    if (count + columns.count() * rows.count() > most) return most + 1;
    const float first_u = across.place_of(columns.first), du = first_u - cells.u[k];
    const float s_u = cells.s_u[k], t_u = cells.t_u[k];
    for (std::int64_t row = rows.first; row < rows.end; ++row, count += columns.count()) {
      const float v = down.place_of(row), dv = v - cells.v[k];
      const float s_z = cells.s_z[k] + s_u * du + cells.s_v[k] * dv, t_z = cells.t_z[k] + t_u * du + cells.t_v[k] * dv;
      for (std::size_t i = 0; i < columns.count(); i += kAtOnce) {
        const float before = step * static_cast<float>(static_cast<std::int32_t>(i));
        std::array<float, kAtOnce> node_u, node_v, node_s, node_t;
        for (std::size_t n = 0; n < kAtOnce; ++n) {
          const float along = before + steps[n];
          node_u[n] = first_u + along, node_v[n] = v;
          node_s[n] = s_z + s_u * along, node_t[n] = t_z + t_u * along;
        }
        const std::size_t at = count + i;
        std::copy(node_u.begin(), node_u.end(), nodes.u + at), std::copy(node_v.begin(), node_v.end(), nodes.v + at);
        std::copy(node_s.begin(), node_s.end(), nodes.s_z + at);
        std::copy(node_t.begin(), node_t.end(), nodes.t_z + at);
      }
    }
  }
  return count;
}

}  // namespace farfeel::penetration
