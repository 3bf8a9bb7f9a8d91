// Boxes and groups of cells, and the fade near a patch's own edges; see facing_patch.cpp. Included by simd_kernels.inl.

namespace farfeel::penetration::simd {
namespace {

struct Box {
  float low[2], high[2];
};

inline Box box_of(F u, F v) {
  return {{least_of(u), least_of(v)}, {greatest_of(u), greatest_of(v)}};
}

/// Which of the kLanes boxes from `first` on meet a box that is grown by `reach`: a bit each.
inline unsigned meeting(const LaneBoxes& boxes, int first, const Box& box, float reach) {
  return bits_of((load(boxes.low_u + first) <= all(box.high[0] + reach)) &
                 (load(boxes.high_u + first) >= all(box.low[0] - reach)) &
                 (load(boxes.low_v + first) <= all(box.high[1] + reach)) &
                 (load(boxes.high_v + first) >= all(box.low[1] - reach)));
}

struct Fade {
  F keep, slope, curvature, inward_u, inward_v, foot[3];
  F distance;  // to the nearest edge, at most the fade's width
  bool is_near;
};

inline Fade fade_over(const LaneSide& side, F u, F v, const Box& box, float width) {
  F square = all(width * width);
  Fade fade{all(1), F{}, F{}, F{}, F{}, {F{}, F{}, F{}}, all(width), false};
  I near = I{};
  for (int first = 0; first < side.edge_boxes.count; first += kLanes) {
    for (unsigned close = meeting(side.edge_boxes, first, box, 0); close != 0; close &= close - 1) {
      const LaneEdge& e = side.edges[first + __builtin_ctz(close)];
      const F along = ((u - e.a[0]) * e.along[0] + (v - e.a[1]) * e.along[1]) * e.per_square;
      const F share = least(most(along, all(0)), all(1));
      const F du = u - e.a[0] - share * e.along[0], dv = v - e.a[1] - share * e.along[1];
      const F far = du * du + dv * dv;
      const I nearer = far < square;
      square = nearer ? far : square;
      near |= nearer;
      fade.inward_u = nearer ? du : fade.inward_u;
      fade.inward_v = nearer ? dv : fade.inward_v;
      for (int k = 0; k < 3; ++k) fade.foot[k] = nearer ? e.a[k] + share * e.along[k] : fade.foot[k];
    }
  }
  fade.is_near = bits_of(near) != 0;
  if (!fade.is_near) return fade;
  const F distance = most(root(square), all(1e-9f)), x = distance / width;
  fade.distance = distance;
  fade.keep = near ? x * x * (3 - 2 * x) : all(1);
  fade.slope = near ? 6 * x * (1 - x) / width : F{};
  fade.curvature = near ? 6 * (1 - 2 * x) / (width * width) : F{};
  fade.inward_u /= distance;
  fade.inward_v /= distance;
  return fade;
}

/// Which points lie within `band` of an edge; band >= fade, by which the edges' boxes are grown.
inline I beside_edge(const LaneSide& side, F u, F v, const Box& box, float band, float fade) {
  I beside{};
  for (int first = 0; first < side.edge_boxes.count; first += kLanes) {
    for (unsigned close = meeting(side.edge_boxes, first, box, band - fade); close != 0; close &= close - 1) {
      const LaneEdge& e = side.edges[first + __builtin_ctz(close)];
      const F along = ((u - e.a[0]) * e.along[0] + (v - e.a[1]) * e.along[1]) * e.per_square;
      const F share = least(most(along, all(0)), all(1));
      const F du = u - e.a[0] - share * e.along[0], dv = v - e.a[1] - share * e.along[1];
      beside |= du * du + dv * dv < all(band * band);
    }
  }
  return beside;
}

/// What the fade may leave, at most, within `reach` of the point: no farther in than that.
inline F most_kept(const Fade& fade, float width, float reach) {
  const F x = least((fade.distance + reach) / width, all(1));
  return x * x * (3 - 2 * x);
}

}  // namespace
}  // namespace farfeel::penetration::simd
