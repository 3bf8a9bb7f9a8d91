R"glsl(
// Both felt surfaces over one square cell of C's plane, and a bound of their overlap in it. As look_at in
// simd_kernels.inl: with y = z for S and -z for T either texture rises away from its own body, the overlap is
// d = y_S + y_T, and over a cell of reach r around its centre, with g the slope there,
//   d <= y_S + y_T + |g_S + g_T| . half + (bend_S + bend_T) r^2 / 2    and    d <= two planes above the relief.

const float NOWHERE = -1e30;
const float ON_EDGE = 1e-8;  // [m] points this close outside still count: neighbours leave no gap

// What a contact's record says of one side.
struct Patch {
  uint facets, facet_count, edges, edge_count, charts;
  float outward;  // S: 1, T: -1
};

struct Half {
  vec2 sides;  // half of each
  float reach;  // to a corner
};

float rise(Half cell, vec2 slope) { return dot(abs(slope), cell.sides); }

// The facets of one side that touch a cell.
struct Touched {
  bool any;
  float coarse_y, lowest_y;  // of the felt facet at the centre; of any
  int felt, only;            // facet felt at the centre, -1 without; the one that speaks for a single chart
  int charts;                // touched
  float felt_z, only_z, only_bend;
  float top;  // a plane above everything felt in the cell, in y
  vec2 top_slope;
};

float distance_inside(uint facet, vec2 uv) {
  vec3 a = floats_at(facet + 1).xyz, b = floats_at(facet + 2).xyz, c = floats_at(facet + 3).xyz;
  return min(min(a.x + dot(a.yz, uv), b.x + dot(b.yz, uv)), c.x + dot(c.yz, uv));
}

// Facets of one chart follow each other; a chart of -1 is the bare facet.
Touched touched_by(Patch side, vec2 uv, Half cell, float small) {
  Touched by;
  by.any = false;
  by.coarse_y = NOWHERE, by.lowest_y = FAR;
  by.felt = by.only = -1;
  by.charts = 0;
  by.felt_z = by.only_z = by.only_bend = by.top = 0;
  by.top_slope = vec2(0);
  int last = -2;
  for (uint i = 0; i < side.facet_count; ++i) {
    uint facet = side.facets + 4 * i;
    float inside = distance_inside(facet, uv);
    if (inside < -cell.reach) continue;
    vec4 plane = floats_at(facet);
    float z = plane.x + dot(plane.yz, uv), y = side.outward * z;
    int chart_index = int(frame[facet].w);
    by.lowest_y = min(by.lowest_y, y);
    bool is_new = chart_index < 0 || chart_index != last;
    if (inside >= -ON_EDGE && y > by.coarse_y) {
      by.coarse_y = y, by.felt = int(i), by.felt_z = z;
      if (!is_new && by.charts == 1) by.only = int(i), by.only_z = z;
    }
    if (!is_new) continue;
    last = chart_index;
    float top = y, bend = 0;
    vec2 slope = side.outward * plane.yz;
    if (chart_index >= 0) {
      Limit limit = limit_over(chart_at(side.charts + 8 * uint(chart_index)), uv, z, cell.reach, small);
      top = side.outward * limit.top, slope = side.outward * limit.slope, bend = limit.bend;
    }
    by.top = by.any ? max(by.top, top + rise(cell, slope - by.top_slope)) : top;
    by.top_slope = by.any ? by.top_slope : slope;
    by.any = true;
    by.only = int(i), by.only_z = z, by.only_bend = bend;
    ++by.charts;
  }
  return by;
}

struct Side {
  Height felt;  // at the centre, by the facet that is felt there
  bool is_felt;
  float y, bend, turn;  // bounds everything felt in the cell; greatest difference of slopes between its charts
  vec2 slope;           // of y
};

void add_chart(inout Side over, Patch side, Half cell, Height h, float bend, float tilt, bool is_felt, bool is_first) {
  float stretch = 1 + tilt * (abs(h.slope.x) + abs(h.slope.y)), y = side.outward * h.z;
  vec2 slope = side.outward * h.slope;
  bend *= stretch * stretch;
  if (is_first || is_felt) over.felt = h;
  if (is_first) {
    over.y = y, over.slope = slope, over.bend = bend;
    return;
  }
  vec2 difference = slope - over.slope;
  over.turn = max(over.turn, length(difference));
  over.y = max(over.y, y + rise(cell, difference));
  over.bend = max(over.bend, bend);
}

Height bare(vec4 plane, float z) {
  Height h;
  h.z = z, h.slope = plane.yz, h.bend = vec3(0), h.is_met = true;
  return h;
}

Side side_over(Patch side, Touched by, vec2 uv, Half cell, float small) {
  Side over;
  over.y = NOWHERE, over.bend = over.turn = 0;
  over.slope = vec2(0);
  over.is_felt = by.felt >= 0;
  int last = -2;
  bool is_first = true;
  uint first = by.charts == 1 ? uint(by.only) : 0u, end = by.charts == 1 ? first + 1 : side.facet_count;
  int felt_chart = by.felt >= 0 ? int(frame[side.facets + 4 * uint(by.felt)].w) : -1;
  for (uint i = first; i < end; ++i) {
    uint facet = side.facets + 4 * i;
    if (by.charts > 1 && distance_inside(facet, uv) < -cell.reach) continue;
    vec4 plane = floats_at(facet);
    int chart_index = int(frame[facet].w);
    if (chart_index >= 0 && chart_index == last) continue;
    last = chart_index;
    bool is_felt = by.felt >= 0 && (chart_index >= 0 ? chart_index == felt_chart : int(i) == by.felt);
    float z = by.charts == 1 ? by.only_z : is_felt ? by.felt_z : plane.x + dot(plane.yz, uv);
    if (chart_index < 0) {
      add_chart(over, side, cell, bare(plane, z), 0, 0, is_felt, is_first);
    } else {
      Chart chart = chart_at(side.charts + 8 * uint(chart_index));
      float bend = by.charts == 1 ? by.only_bend : limit_over(chart, uv, z, cell.reach, small).bend;
      add_chart(over, side, cell, height_over(chart, uv, z), bend, chart.tilt, is_felt, is_first);
    }
    is_first = false;
  }
  over.is_felt = over.is_felt && over.felt.is_met;
  return over;
}

// How near a point is to the patch's own edge; see facing_patch.cpp.
struct Fade {
  float keep, slope, curvature, distance;
  vec2 inward;
  vec3 foot;
  bool is_near;
};

Fade fade_at(Patch side, vec2 uv) {
  Fade fade;
  fade.keep = 1, fade.slope = fade.curvature = 0, fade.distance = EDGE_FADE;
  fade.inward = vec2(0), fade.foot = vec3(0);
  float square = EDGE_FADE * EDGE_FADE;
  for (uint i = 0; i < side.edge_count; ++i) {
    vec4 a = floats_at(side.edges + 2 * i), along = floats_at(side.edges + 2 * i + 1);
    float share = clamp(dot(uv - a.xy, along.xy) * a.w, 0.0, 1.0);
    vec2 away = uv - a.xy - share * along.xy;
    float far = dot(away, away);
    if (far >= square) continue;
    square = far;
    fade.inward = away;
    fade.foot = a.xyz + share * along.xyz;
  }
  fade.is_near = square < EDGE_FADE * EDGE_FADE;
  if (!fade.is_near) return fade;
  fade.distance = max(sqrt(square), 1e-9);
  float x = fade.distance / EDGE_FADE;
  fade.keep = x * x * (3 - 2 * x);
  fade.slope = 6 * x * (1 - x) / EDGE_FADE;
  fade.curvature = 6 * (1 - 2 * x) / (EDGE_FADE * EDGE_FADE);
  fade.inward /= fade.distance;
  return fade;
}

// What the fade may leave, at most, within `reach` of the point.
float most_kept(Fade fade, float reach) {
  float x = min((fade.distance + reach) / EDGE_FADE, 1.0);
  return x * x * (3 - 2 * x);
}

// One cell. Unknown: no overlap at its centre, though there may be inside.
struct Look {
  Side s, t;
  Fade s_fade, t_fade;
  float overlap, faded, bound, guess, sharp;
  bool is_known;
};

// Cells that the relief can't lift to `lowest` get no closer look.
Look look_at(Patch S, Patch T, vec2 uv, Half cell, float deepest, float width, float lowest) {
  Look look;
  look.overlap = look.faded = look.bound = look.guess = NOWHERE;
  look.sharp = 0;
  look.is_known = false;
  float small = 0.5 * width;
  Touched s_by = touched_by(S, uv, cell, small);
  if (!s_by.any) return look;
  Touched t_by = touched_by(T, uv, cell, small);
  // What is certainly another layer does not count, nor what the relief can't lift.
  if (!t_by.any || s_by.lowest_y + t_by.lowest_y > deepest + 2 * cell.reach) return look;
  float relief_bound = s_by.top + t_by.top + rise(cell, s_by.top_slope + t_by.top_slope);
  if (relief_bound < lowest) return look;
  look.s = side_over(S, s_by, uv, cell, small);
  look.t = side_over(T, t_by, uv, cell, small);
  vec2 slope = look.s.slope + look.t.slope;
  float bend = look.s.bend + look.t.bend;
  look.bound = min(relief_bound, look.s.y + look.t.y + rise(cell, slope) + 0.5 * cell.reach * cell.reach * bend);
  look.guess = look.s.y + look.t.y;
  look.is_known = look.s.is_felt && look.t.is_felt && s_by.coarse_y + t_by.coarse_y <= deepest;
  look.s_fade = fade_at(S, uv), look.t_fade = fade_at(T, uv);
  if (look.is_known) look.overlap = look.faded = look.s.felt.z - look.t.felt.z;
  if (look.s_fade.is_near || look.t_fade.is_near) {
    if (look.is_known) look.faded += width * log(max(look.s_fade.keep * look.t_fade.keep, 1e-20));
    look.bound += width * log(most_kept(look.s_fade, cell.reach) * most_kept(look.t_fade, cell.reach));
  }
  // Greatest eigenvalue of minus the overlap's second derivative; a crease counts as what it is over the soft width,
  // and so does the slope, for where an edge cuts a peak off.
  vec3 curve = look.s.felt.bend - look.t.felt.bend;
  float skew = 0.5 * (curve.x - curve.z), turn = max(look.s.turn, look.t.turn);
  if (look.is_known) look.sharp = sqrt(skew * skew + curve.y * curve.y) - 0.5 * (curve.x + curve.z);
  look.sharp = max(look.sharp, 0.5 / width * (dot(slope, slope) + 0.5 * turn * turn));
  return look;
}
)glsl"
