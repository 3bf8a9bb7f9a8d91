// Points against facets, as foot_of() of their tests says plainly. Included by simd_kernels.inl.

namespace farfeel::penetration::simd {
namespace {

constexpr float kSureSquare = 1e20f;  // greater than that of any distance

/// The points from a facet's anchor.
struct FromAnchor {
  F x, y, z;
};

[[gnu::always_inline]] inline FromAnchor from_anchor(const FootFacet& facet, const double centre_S[3], const F p[3]) {
  return {p[0] + static_cast<float>(centre_S[0] - facet.anchor_S[0]),
          p[1] + static_cast<float>(centre_S[1] - facet.anchor_S[1]),
          p[2] + static_cast<float>(centre_S[2] - facet.anchor_S[2])};
}

[[gnu::always_inline]] inline F row_of(const FootFacet& facet, int row, const FromAnchor& p) {
  return facet.at_anchor[row] + facet.per[0][row] * p.x + facet.per[1][row] * p.y + facet.per[2][row] * p.z;
}

/// Beside which edge a point lies, and how; of those that it lies beside, the nearest.
struct Beside {
  F square = all(kSureSquare), inside, past;
  I edge{};

  [[gnu::always_inline]] void look(const FootFacet& facet, const FromAnchor& p) {
    for (int k = 0; k < 3; ++k) {
      const F in = row_of(facet, FootFacet::kInside + k, p), to = row_of(facet, FootFacet::kAlong + k, p);
      const F over = to - least(most(to, all(0)), all(facet.length[k])), one = in * in + over * over;
      const I takes = (in < all(0)) & (one < square);
      square = takes ? one : square, inside = takes ? in : inside, past = takes ? over : past;
      edge = takes ? I{} + k : edge;
    }
  }
  [[nodiscard]] F square_or_none() const { return square < all(kSureSquare) ? square : F{}; }
};

/// The points of a group of lanes, from the leaf's centre; those beyond the last are the last again.
inline void points_at(const FeetTask& task, int first, F p[3]) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const int i = first + lane < task.count ? first + lane : task.count - 1;
    const double* q = task.points_T + 3 * i;
    for (int k = 0; k < 3; ++k) {
      p[k][lane] = static_cast<float>(task.from_centre[k] + task.R_ST[k][0] * q[0] + task.R_ST[k][1] * q[1] +
                                      task.R_ST[k][2] * q[2]);
    }
  }
}

inline float cosine_of(const FootFacet& facet, const FeetTask& task) {
  return facet.per[0][FootFacet::kAbove] * task.nhat_S[0] + facet.per[1][FootFacet::kAbove] * task.nhat_S[1] +
         facet.per[2][FootFacet::kAbove] * task.nhat_S[2];
}

constexpr float kPrefers = static_cast<float>(kPrefersSquare);

/// The nearest of some facets, by the square that tells them apart.
struct NearestFoot {
  F square = all(kSureSquare), above{}, relief{};
  I which = I{} - 1;

  void note(F one, F one_above, float one_relief, int k) {
    const I takes = one < square;
    square = takes ? one : square, above = takes ? one_above : above, which = takes ? I{} + k : which;
    relief = takes ? all(one_relief) : relief;
  }
  /// So far, but for its own relief, another may be whose felt place is nearer.
  [[nodiscard]] F reach() const { return (1 + kPrefers) * root(square) + relief; }
};

inline F square_of(F x) {
  return x * x;
}

/// Squares of distances, of those facets that may be nearer than the limit; the others' are left out.
struct FlatDistances {
  F above, square_beside;
};

/// False where all points are farther above or below than the limit.
[[gnu::always_inline]] inline bool measure(const FootFacet& facet, const FromAnchor& p, F square_limit,
                                           FlatDistances& at) {
  at.above = row_of(facet, FootFacet::kAbove, p);
  if (bits_of(at.above * at.above <= square_limit) == 0) return false;
  Beside beside;
  beside.look(facet, p);
  at.square_beside = beside.square_or_none();
  return true;
}

std::int32_t sift_facets(const FeetTask& task, const FeetMargin& margin, std::uint32_t* kept) {
  F squares[kMostSifted];  // of one group's distances
  bool is_kept[kMostSifted];
  float most_relief = 0;
  for (int k = 0; k < task.near_count; ++k) {
    is_kept[k] = false;
    const float relief = task.facets[task.near[k]].relief;
    most_relief = relief > most_relief ? relief : most_relief;
  }
  for (int n = 0; n < task.count; n += kLanes) {
    F p[3];
    points_at(task, n, p);
    // Those that are not asked about may as well be told apart with the others.
    const auto reach_of = [&](F nearest_square) {
      const F reach = (1 + kPrefers) * (root(nearest_square) + margin.way) + most_relief;
      return least(reach, all(task.tolerance)) + margin.way;
    };
    F nearest = all(task.tolerance * task.tolerance), reach = reach_of(nearest);
    for (int k = 0; k < task.near_count; ++k) {
      const FootFacet& facet = task.facets[task.near[k]];
      FlatDistances at;
      squares[k] = all(kSureSquare);
      if (!measure(facet, from_anchor(facet, task.centre_S, p), square_of(reach + facet.relief), at)) continue;
      squares[k] = at.above * at.above + at.square_beside;
      if (!(cosine_of(facet, task) < static_cast<float>(kNotAbove) - margin.turn)) continue;
      if (bits_of(squares[k] < nearest) == 0) continue;
      nearest = least(nearest, squares[k]);
      reach = reach_of(nearest);
    }
    for (int k = 0; k < task.near_count; ++k) {
      const F limit = square_of(reach + task.facets[task.near[k]].relief);
      is_kept[k] = is_kept[k] || bits_of(squares[k] <= limit) != 0;
    }
  }
  int count = 0;
  for (int k = 0; k < task.near_count && count < kMostLeafFacets; ++k)
    if (is_kept[k]) kept[count++] = task.near[k];
  return count;
}

/// The deepest felt place of some facets, or the least deep: sign times the depth is least.
struct BestFoot {
  F signed_depth = all(kSureSquare), slope[3] = {};
  I which{};
};

/// Goes on to one facet in some lanes. sign: 1 on the inner side of S, -1 on the outer. Returns where it is the best.
[[gnu::always_inline]] inline I try_facet(const FootFacet& facet, const FromAnchor& p, F sign, F square_beside, int k,
                                          I mine, BestFoot& best) {
  F slope[3], depth;
  if (facet.heights) {
    const F s = row_of(facet, FootFacet::kChart, p), t = row_of(facet, FootFacet::kChart + 1, p),
            r = row_of(facet, FootFacet::kChart + 2, p);
    const Spline at = spline_at(facet, s, t);
    depth = facet.scale * at.value - r;
    for (int i = 0; i < 3; ++i) {
      const float* const per = facet.per[i] + FootFacet::kChart;
      slope[i] = facet.scale * (per[0] * at.s + per[1] * at.t) - per[2];
    }
  } else {
    depth = -row_of(facet, FootFacet::kAbove, p);
    for (int i = 0; i < 3; ++i) slope[i] = all(-facet.per[i][FootFacet::kAbove]);
  }
  F out = sign * depth;
  const I is_beside = mine & (square_beside > all(0));
  if (bits_of(is_beside) != 0) {
    Beside beside;
    beside.look(facet, p);
    const F size = root(square_beside), per_size = 1 / most(size, all(1e-12f)),
            away = root(depth * depth + square_beside), per_away = 1 / most(away, all(1e-12f));
    const I is_short = is_beside & ~(out > all(0)), is_far = is_beside & (out > all(0));
    for (int i = 0; i < 3; ++i) {
      F way{};
      for (int e = 0; e < 3; ++e) {
        const F one =
            beside.inside * facet.per[i][FootFacet::kInside + e] + beside.past * facet.per[i][FootFacet::kAlong + e];
        way = beside.edge == I{} + e ? one : way;
      }
      way *= per_size * sign;
      slope[i] = is_short ? slope[i] + way : (is_far ? (size_of(depth) * slope[i] + size * way) * per_away : slope[i]);
    }
    out = is_short ? out + size : (is_far ? away : out);
  }
  const I takes = mine & (out < best.signed_depth);
  best.signed_depth = takes ? out : best.signed_depth;
  best.which = takes ? I{} + k : best.which;
  for (int i = 0; i < 3; ++i) best.slope[i] = takes ? slope[i] : best.slope[i];
  return takes;
}

inline F smooth_step(F x) {
  return x * x * (3 - 2 * x);
}

FeetSeen feel(const FeetTask& task, Feet& feet) {
  float cosine[kMostLeafFacets];
  float most_relief = 0;
  for (int k = 0; k < task.near_count; ++k) {
    const FootFacet& facet = task.facets[task.near[k]];
    cosine[k] = cosine_of(facet, task);
    most_relief = facet.relief > most_relief ? facet.relief : most_relief;
  }
  constexpr auto kBelow = static_cast<float>(kFacesBelow), kAbove = static_cast<float>(kNotAbove);
  FeetSeen seen{kNowhere, kNowhere, true};
  for (int n = 0; n < kLeafPoints; n += kLanes) {
    store(feet.depth + n, all(kNowhere)), store(feet.share + n, F{});
    if (n >= task.count) continue;
    F p[3];
    points_at(task, n, p);
    F heights[kMostLeafFacets], besides[kMostLeafFacets];
    NearestFoot of_all, facing;
    F reach = all((1 + kPrefers) * task.tolerance + most_relief);
    for (int k = 0; k < task.near_count; ++k) {
      const FootFacet& facet = task.facets[task.near[k]];
      FlatDistances at;
      besides[k] = all(kSureSquare);
      if (!measure(facet, from_anchor(facet, task.centre_S, p), square_of(reach + most_relief), at)) continue;
      const F square = (1 - kPrefers) * at.above * at.above + at.square_beside;
      of_all.note(square, at.above, facet.relief, k);
      if (cosine[k] < kAbove && bits_of(square < facing.square) != 0) {
        facing.note(square, at.above, facet.relief, k);
        reach = least(reach, (1 + kPrefers) * root(facing.square) + most_relief);
      }
      heights[k] = at.above, besides[k] = at.square_beside;
    }
    I valid;
    for (int lane = 0; lane < kLanes; ++lane)
      valid[lane] = n + lane < task.count && (task.is_far >> (n + lane) & 1) == 0 ? -1 : 0;
    const I is_beneath = of_all.above < all(0), is_same = of_all.which == facing.which;
    const F sign = is_beneath ? all(1) : all(-1);
    const F all_m = root(of_all.square), facing_m = root(facing.square);
    F most_m = is_beneath ? all(kEndlessWay) : most_relief - all_m;
    const F deepest = most_relief + (is_beneath ? (1 + kPrefers) * facing_m : -facing_m);
    const I has_facing = facing.square < task.tolerance * task.tolerance,
            is_bounded = has_facing & (deepest <= task.lowest);
    const I wanted = valid & has_facing & ~is_bounded & (is_beneath | (facing.above > all(0)));
    most_m = is_bounded ? ((is_beneath | is_same) ? deepest : least(most_m, all(task.lowest))) : most_m;
    if (bits_of(wanted) != 0) {
      BestFoot best;
      F share = all(1), turn[3] = {};
      const F facing_reach = facing.reach(), all_reach = of_all.reach();
      const auto is_within = [&](int k, F reach_m) {
        return heights[k] * heights[k] + besides[k] <= square_of(reach_m + task.facets[task.near[k]].relief);
      };
      for (int k = 0; k < task.near_count; ++k) {
        if (!(cosine[k] < kAbove)) continue;
        const I mine = wanted & (heights[k] * sign <= all(0)) & is_within(k, facing_reach);
        if (bits_of(mine) == 0) continue;
        const FootFacet& facet = task.facets[task.near[k]];
        const I takes = try_facet(facet, from_anchor(facet, task.centre_S, p), sign, besides[k], k, mine, best);
        const float x = (kAbove - cosine[k]) / (kAbove - kBelow);
        share = takes ? all(x < 1 ? x * x * (3 - 2 * x) : 1) : share;
        const float steep = x < 1 ? -6 * (1 - x) / (x * (3 - 2 * x)) / (kAbove - kBelow) : 0;
        for (int i = 0; i < 3; ++i) {
          const int j = (i + 1) % 3, l = (i + 2) % 3;
          turn[i] = takes ? all(steep * (task.nhat_S[j] * facet.per[l][FootFacet::kAbove] -
                                         task.nhat_S[l] * facet.per[j][FootFacet::kAbove]))
                          : turn[i];
        }
      }
      const I is_known = wanted & (best.signed_depth < all(kSureSquare));
      F depth = sign * best.signed_depth;
      most_m = is_known ? ((is_same | is_beneath) ? depth : most(depth, most_m)) : most_m;
      const I is_other = is_known & is_beneath & ~is_same & (depth > all(0));
      if (bits_of(is_other) != 0) {
        BestFoot any = best;
        for (int k = 0; k < task.near_count; ++k) {
          if (cosine[k] < kAbove) continue;  // was looked at
          const I mine = is_other & (heights[k] <= all(0)) & is_within(k, all_reach);
          if (bits_of(mine) == 0) continue;
          const FootFacet& facet = task.facets[task.near[k]];
          try_facet(facet, from_anchor(facet, task.centre_S, p), sign, besides[k], k, mine, any);
        }
        constexpr auto kLeast = static_cast<float>(kLeastNearness), kFull = static_cast<float>(kFullNearness),
                       kWithin = static_cast<float>(kNearnessWithin_m);
        const F per_most = 1 / (most(depth, all(0)) + kWithin);
        const F nearness = (most(any.signed_depth, all(0)) + kWithin) * per_most;
        const F y = least(most((nearness - kLeast) * (1 / (kFull - kLeast)), all(0)), all(1));
        const I is_less = is_other & (y < all(1));
        share = (is_less & (y <= all(0))) ? F{} : share;
        const F keeps = smooth_step(y), bends = 6 * y * (1 - y) * depth * per_most * (1 / (kFull - kLeast));
        for (int i = 0; i < 3; ++i) {
          const F slope = keeps * best.slope[i] + bends * (any.slope[i] - nearness * best.slope[i]);
          best.slope[i] = is_less ? slope : best.slope[i];
        }
        depth = is_less ? keeps * depth : depth;
      }
      const I is_felt = is_known & (share > all(0));
      const F felt = is_felt ? depth : all(kNowhere);
      const float group = greatest_of(felt);
      seen.deepest = group > seen.deepest ? group : seen.deepest;
      store(feet.depth + n, felt);
      store(feet.share + n, is_felt ? share : F{});
      for (int i = 0; i < 3; ++i) {
        store(feet.p[i] + n, p[i]);
        store(feet.slope[i] + n, is_felt ? best.slope[i] : F{});
        store(feet.ln_share_by_rotation[i] + n, turn[i]);
      }
      for (int lane = 0; lane < kLanes; ++lane) feet.which[n + lane] = best.which[lane];
    }
    seen.is_all = seen.is_all && bits_of(valid & is_bounded) == 0;
    const float group = greatest_of(valid ? most_m : all(kNowhere));
    seen.most = group > seen.most ? group : seen.most;
  }
  return seen;
}

void add_feet(const FeetSumTask& task, FeetSums& sums) {
  const Feet& feet = *task.feet;
  for (int n = 0; n < kLeafPoints; n += kLanes) {
    const F depth = load(feet.depth + n);
    const I counts = depth > all(task.lowest);
    if (bits_of(counts) == 0) continue;
    F w = (task.weight * load(feet.share + n)) * exponential((depth - task.level) * (1 / task.width));
    w = counts ? w : F{};
    if (task.counts) {
      for (int lane = 0; lane < kLanes; ++lane)
        if (counts[lane]) w[lane] *= task.counts[feet.which[n + lane]];
    }
    sums.weight += static_cast<double>(sum_of(w));
    F p[3], slope[3];
    for (int i = 0; i < 3; ++i) {
      p[i] = counts ? load(feet.p[i] + n) : F{};
      slope[i] = counts ? load(feet.slope[i] + n) : F{};
      sums.point[i] += static_cast<double>(sum_of(w * p[i]));
      sums.moving[i] += static_cast<double>(sum_of(w * slope[i]));
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      const F turn = counts ? load(feet.ln_share_by_rotation[i] + n) : F{};
      sums.turning[i] += static_cast<double>(sum_of(w * (p[j] * slope[k] - p[k] * slope[j] + task.width * turn)));
    }
  }
}

}  // namespace
}  // namespace farfeel::penetration::simd
