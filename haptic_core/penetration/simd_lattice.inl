// Nodes of one square lattice in cells of another, whatever the ratio of their steps. Included by simd_kernels.inl.
//
// An origin holds both: cell I of a side goes from I to I + 1 times its width, node i stands at i + 1/2 steps. So node
// i belongs to the one cell with I r <= i + 1/2 < (I + 1) r, where r is the ratio of cell and step.

namespace farfeel::penetration::simd {
namespace {

/// The least integer that is not below x, to a millionth. ceil() is a call.
inline std::int64_t not_below(double x) {
  constexpr std::int64_t kMostNodes = std::int64_t{1} << 32;  // to either side
  return kMostNodes - static_cast<std::int64_t>(kMostNodes - x);
}

/// Along one side of the cells.
struct LaidSide {
  double origin, cell, step, low, high, cells_a_metre, ratio;

  struct Nodes {
    float first;  // where it stands
    int count;
  };
  [[nodiscard]] Nodes of(double centre) const {
    const double mine = static_cast<double>(not_below((centre - origin) * cells_a_metre - 1));  // I above
    std::int64_t first = not_below(mine * ratio - 0.5), end = not_below((mine + 1) * ratio - 0.5);
    // At the window's ends a node beyond the last cell may stand for some of the window.
    if (centre - 0.5 * cell < low) {
      const std::int64_t outer = -not_below((origin - low) / step);
      first = outer < first ? outer : first;
    }
    if (centre + 0.5 * cell > high) {
      const std::int64_t outer = not_below((high - origin) / step);
      end = outer > end ? outer : end;
    }
    return {static_cast<float>(origin + (static_cast<double>(first) + 0.5) * step), static_cast<int>(end - first)};
  }
};

std::int32_t lay(const LayTask& task, const LaneCells& cells, const std::uint32_t* chosen, const LaneCells& nodes) {
  const auto side = [&](int k) {
    return LaidSide{task.origin[k],       task.cell, task.step, task.low[k], task.high[k], 1 / task.cell,
                    task.cell / task.step};
  };
  const LaidSide across = side(0), down = side(1);
  const float step = static_cast<float>(task.step), half_cell = 0.5f * static_cast<float>(task.cell);
  const float per_reach_squared = 0.5f / (half_cell * half_cell);
  F lane;
  for (int k = 0; k < kLanes; ++k) lane[k] = static_cast<float>(k);
  std::int32_t count = 0;
  for (std::int32_t n = 0; n < task.chosen; ++n) {
    const std::uint32_t k = chosen[n];
    const LaidSide::Nodes columns = across.of(static_cast<double>(cells.u[k])),
                          rows = down.of(static_cast<double>(cells.v[k]));
    const int here = columns.count * rows.count;
    if (count + here > task.most) return task.most + 1;
    const float wide = static_cast<float>(columns.count), per_wide = 1 / wide;
    const float s_z = cells.s_z[k], t_z = cells.t_z[k], slope_u = cells.s_u[k] - cells.t_u[k],
                slope_v = cells.s_v[k] - cells.t_v[k],
                bow = cells.bow[k] < 0 ? -kNowhere : cells.bow[k] * per_reach_squared;
    const float rise = (__builtin_fabsf(slope_u) + __builtin_fabsf(slope_v)) * task.half;
    for (int done = 0; done < here; done += kLanes) {
      const F number = lane + static_cast<float>(done);
      const F row = __builtin_convertvector(__builtin_convertvector((number + 0.5f) * per_wide, I), F);
      const F u = columns.first + step * (number - row * wide), v = rows.first + step * row;
      const F du = u - cells.u[k], dv = v - cells.v[k];
      const F s = s_z + cells.s_u[k] * du + cells.s_v[k] * dv, t = t_z + cells.t_u[k] * du + cells.t_v[k] * dv;
      const F far_u = size_of(du) + task.half, far_v = size_of(dv) + task.half;
      const F bound = (s - t) + rise + bow * (far_u * far_u + far_v * far_v);
      // Nothing is known of cells that were not sampled: their heights are no numbers.
      const unsigned bits = bits_of(~(bound < task.lowest) & (number < all(static_cast<float>(here))));
      if (bits == 0) continue;
      push(nodes.u + count, u, bits), push(nodes.v + count, v, bits);
      push(nodes.s_z + count, s, bits), push(nodes.t_z + count, t, bits);
      count += __builtin_popcount(bits);
    }
  }
  return count;
}

}  // namespace
}  // namespace farfeel::penetration::simd
