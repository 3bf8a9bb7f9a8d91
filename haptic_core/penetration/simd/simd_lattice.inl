// Nodes of one square lattice in cells of another, whatever the ratio of their steps. Included by simd_kernels.inl.
//
// An origin holds both: cell I of a side goes from I to I + 1 times its width, node i stands at i + 1/2 steps. So node
// i belongs to the one cell with I r <= i + 1/2 < (I + 1) r, where r is the ratio of cell and step. The origin may be
// far away: cells and nodes are counted from those at the first cell, I = I0 + J and i = floor(I0 r) + j.

namespace farfeel::penetration::simd {
namespace {

inline F floor_of(F x) {
  const F whole = __builtin_convertvector(__builtin_convertvector(x, I), F);
  return whole > x ? whole - 1 : whole;
}

/// The least integer that is not below.
inline F ceiling_of(F x) {
  return -floor_of(-x);
}

inline double floor_of(double x) {
  const auto whole = static_cast<double>(static_cast<std::int64_t>(x));
  return whole > x ? whole - 1 : whole;
}

/// Of a cell: it ends at the window's end where it ends so near to it.
constexpr float kAtEnd = 2e-4f;

/// Of a node: one that stands so near to a cell's end is at it, and the next cell's, however that was rounded.
constexpr float kTie = 1e-4f;

/// Along one side of the cells.
struct LaidSide {
  float first_cell, first_node;                  // where the one begins, where the other stands
  float cell, step, cells_a_metre, ratio, part;  // part: of I0 r, beyond the whole
  float low, high, low_node, high_node;          // the window's ends, and the nodes j that stand for what is there

  LaidSide(const LayTask& task, int side, float near)
      : cell(static_cast<float>(task.cell)),
        step(static_cast<float>(task.step)),
        cells_a_metre(static_cast<float>(1 / task.cell)),
        ratio(static_cast<float>(task.cell / task.step)),
        low(static_cast<float>(task.low[side])),
        high(static_cast<float>(task.high[side])) {
    const double origin = task.origin[side], cell_0 = floor_of((static_cast<double>(near) - origin) / task.cell),
                 along = cell_0 * task.cell / task.step, node_0 = floor_of(along);
    first_cell = static_cast<float>(origin + cell_0 * task.cell);
    first_node = static_cast<float>(origin + (node_0 + 0.5) * task.step);
    part = static_cast<float>(along - node_0);
    // At the window's ends a node beyond the last cell may stand for some of the window.
    const auto node_at = [&](double end) { return (end - origin) / task.step - node_0; };
    low_node = static_cast<float>(floor_of(node_at(task.low[side])));
    high_node = static_cast<float>(-floor_of(-node_at(task.high[side])));
  }

  struct Nodes {
    F first, count;
  };
  [[nodiscard]] Nodes of(F centre) const {
    const F mine = floor_of((centre - first_cell) * cells_a_metre);
    const float aside = part - 0.5f - kTie, reach = (0.5f + kAtEnd) * cell;
    F first = ceiling_of(mine * ratio + aside), end = ceiling_of((mine + 1) * ratio + aside);
    const I is_lowest = centre - reach < low;
    const I is_highest = centre + reach > high;
    first = is_lowest ? least(first, all(low_node)) : first;
    end = is_highest ? most(end, all(high_node)) : end;
    return {first, end - first};
  }
};

/// What is known of cells: where they are, which nodes are theirs, how the surfaces go there.
struct LaidCells {
  enum { kU, kV, kSZ, kTZ, kSU, kSV, kTU, kTV, kBow, kStands, kFirstU, kFirstV, kWide, kHere, kColumns };
  F column[kColumns];

  [[nodiscard]] F operator[](int k) const { return column[k]; }
};

inline LaidCells laid_cells(const LaneCells& cells, I chosen, const LaidSide& across, const LaidSide& down, I counts) {
  const float* const from[] = {cells.u,   cells.v,   cells.s_z, cells.t_z, cells.s_u,
                               cells.s_v, cells.t_u, cells.t_v, cells.bow, cells.stands};
  LaidCells laid;
  for (int k = 0; k <= LaidCells::kStands; ++k) laid.column[k] = gather(from[k], chosen);
  const LaidSide::Nodes columns = across.of(laid[LaidCells::kU]), rows = down.of(laid[LaidCells::kV]);
  laid.column[LaidCells::kFirstU] = across.first_node + across.step * columns.first;
  laid.column[LaidCells::kFirstV] = down.first_node + down.step * rows.first;
  laid.column[LaidCells::kWide] = columns.count;
  laid.column[LaidCells::kHere] = counts ? columns.count * rows.count : F{};
  return laid;
}

/// Four nodes of each cell at a time.
std::int32_t lay(const LayTask& task, const LaneCells& cells, const std::uint32_t* chosen, const LaneCells& nodes) {
  if (task.chosen == 0) return 0;
  const LaidSide across(task, 0, cells.u[chosen[0]]), down(task, 1, cells.v[chosen[0]]);
  const float step = across.step, half_cell = 0.5f * across.cell, per_reach_squared = 0.5f / (half_cell * half_cell);
  constexpr int kNodes = 4, kAtOnce = kLanes / kNodes;
  F node;
  I lane, of_cell;
  for (int k = 0; k < kLanes; ++k) lane[k] = k, of_cell[k] = k / kNodes, node[k] = static_cast<float>(k % kNodes);
  std::int32_t count = 0;
  for (std::int32_t n = 0; n < task.chosen; n += kLanes) {
    I which{};
    for (int k = 0; k < kLanes; ++k) which[k] = static_cast<std::int32_t>(chosen[n + k < task.chosen ? n + k : n]);
    const LaidCells all_cells = laid_cells(cells, which, across, down, lane < task.chosen - n);
    if (count + static_cast<std::int32_t>(total(all_cells[LaidCells::kHere])) > task.most) return task.most + 1;
    for (int q = 0; q < kNodes; ++q) {
      LaidCells c;
      const I from = of_cell + q * kAtOnce;
      for (int k = 0; k < LaidCells::kColumns; ++k) {
#ifdef __clang__  // which shuffles by constants only
        for (int l = 0; l < kLanes; ++l) c.column[k][l] = all_cells[k][from[l]];
#else
        c.column[k] = __builtin_shuffle(all_cells[k], from);
#endif
      }
      const F wide = c[LaidCells::kWide], here = c[LaidCells::kHere], per_wide = 1 / wide;
      const F slope_u = c[LaidCells::kSU] - c[LaidCells::kTU], slope_v = c[LaidCells::kSV] - c[LaidCells::kTV];
      const F rise = (size_of(slope_u) + size_of(slope_v)) * task.half,
              bow = c[LaidCells::kBow] < all(0) ? all(-kNowhere) : c[LaidCells::kBow] * per_reach_squared;
      const float most_here = greatest_of(here);
      for (float done = 0; done < most_here; done += kNodes) {
        const F number = node + done;
        const F row = __builtin_convertvector(__builtin_convertvector((number + 0.5f) * per_wide, I), F);
        const F u = c[LaidCells::kFirstU] + step * (number - row * wide), v = c[LaidCells::kFirstV] + step * row;
        const F du = u - c[LaidCells::kU], dv = v - c[LaidCells::kV];
        const F s = c[LaidCells::kSZ] + c[LaidCells::kSU] * du + c[LaidCells::kSV] * dv,
                t = c[LaidCells::kTZ] + c[LaidCells::kTU] * du + c[LaidCells::kTV] * dv;
        const F far_u = size_of(du) + task.half, far_v = size_of(dv) + task.half;
        const F bound = (s - t) + rise + bow * (far_u * far_u + far_v * far_v);
        // Nothing is known of cells that were not sampled: their heights are no numbers.
        const unsigned bits = bits_of(~(bound < task.lowest) & (number < here));
        if (bits == 0) continue;
        push(nodes.u + count, u, bits), push(nodes.v + count, v, bits);
        push(nodes.s_z + count, s, bits), push(nodes.t_z + count, t, bits);
        push(nodes.stands + count, c[LaidCells::kStands], bits);
        count += __builtin_popcount(bits);
      }
    }
  }
  return count;
}

}  // namespace
}  // namespace farfeel::penetration::simd
