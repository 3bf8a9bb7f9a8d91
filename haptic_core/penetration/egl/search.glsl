R"glsl(
// One work-group finds one contact's soft or hard maximum by branch and bound over square cells, as cell_search.cpp
// does, and adds up what the processor's code finishes. A round looks at one cell an invocation; what is kept is listed in shared
// memory, and beyond that in device memory, so that a window may have any size.

layout(local_size_x = GROUP) in;
layout(std430, binding = RESULTS_BINDING) writeonly buffer Results { uint results[]; };
layout(std430, binding = WORKSPACE_BINDING) coherent buffer Workspace { uvec2 spilled[]; };  // 2 lists a work-group
uniform uint directory;  // where the frame lists this dispatch's contacts

// Two lists of kept cells (place, bound), or GROUP values of some quantities to be added up.
const uint AT_ONCE = min(12u, POOL / GROUP);
const uint LISTED = (POOL - 3u * GROUP) / 4u;
shared uint pool[POOL];
shared uint shared_best, shared_kept, shared_low, shared_high, shared_pick, shared_winner;

const float NEAR_WIDTHS = 4;       // cells this near the best decide how sharp the peak is
const float FADED_WIDTHS = 0.05;   // lost to the fade: then a cell is near an edge
const float EDGE_SHARE = 0.02;     // of the weight near a patch's edge: then the fade must be resolved too,
const float FADE_WIDTHS = 5;       // as so many widths
const float LEAST_SEEN = 0.2;      // of the best sample's own weight, before cells tell anything of the peak
const float APART = 0.3e-3;        // [m] surfaces farther apart are felt by nobody yet: coarser steps will do
const float LEAST_STEP = 3e-6, LEAST_HARD_STEP = 2e-6;  // [m] cells are divided no further
const float HIDDEN = 50e-9;        // [m] the hard maximum may miss a peak this much higher than the one found
const float STEEPEST = 2.7475;     // slope of a surface that stands at 70 degrees
const float LAYER_GAP = 0.1e-3;    // [m] two layers closer than this are one surface whose pieces meet
const uint LEAST_CELLS = 24u;

uint ordered(float x) {
  uint bits = floatBitsToUint(x);
  return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}
float from_ordered(uint bits) {
  return uintBitsToFloat((bits & 0x80000000u) != 0u ? bits & 0x7FFFFFFFu : ~bits);
}

void put(uint list, uint k, uvec2 entry) {
  if (k < LISTED) {
    uint at = 3u * GROUP + 2u * (list * LISTED + k);
    pool[at] = entry.x, pool[at + 1u] = entry.y;
  } else if (k < MOST_KEPT) {
    spilled[(gl_WorkGroupID.x * 2u + list) * MOST_KEPT + k] = entry;
  }
}
uvec2 get(uint list, uint k) {
  if (k >= LISTED) return spilled[(gl_WorkGroupID.x * 2u + list) * MOST_KEPT + k];
  uint at = 3u * GROUP + 2u * (list * LISTED + k);
  return uvec2(pool[at], pool[at + 1u]);
}
void wait_for_all() {
  memoryBarrierShared();
  memoryBarrierBuffer();
  barrier();
}

// Column q of the pool's first `count` columns becomes its total, at pool[q * GROUP].
void add_up_columns(uint count) {
  for (uint stride = GROUP / 2u; stride > 0u; stride /= 2u) {
    memoryBarrierShared();
    barrier();
    if (gl_LocalInvocationID.x < stride) {
      for (uint q = 0u; q < count; ++q) {
        uint at = q * GROUP + gl_LocalInvocationID.x;
        pool[at] = floatBitsToUint(uintBitsToFloat(pool[at]) + uintBitsToFloat(pool[at + stride]));
      }
    }
  }
  wait_for_all();
}

#ifdef HESSIAN
const uint QUANTITIES = 42u;
#else
const uint QUANTITIES = 12u;
#endif
float total[QUANTITIES];  // weight, edge, border, steep, point 3, gradient 5, square 15, curvature 15: simd::Sums

void add_cell(Look look, vec2 uv, vec2 step, float level, float width, vec3 To, vec4 border) {
  if (!(look.overlap > level - 60 * width)) return;
  float keep = look.s_fade.keep * look.t_fade.keep;
  float w = step.x * step.y * keep * exp((look.overlap - level) / width);
  Height t = look.t.felt;
  vec3 p = vec3(uv, t.z), r = p - To;
  // -(r x N) and -N with N = (-z_u, -z_v, 1)
  float g[5] = float[5](-(r.y + r.z * t.slope.y), r.z * t.slope.x + r.x, r.x * t.slope.y - r.y * t.slope.x, t.slope.x,
                        t.slope.y);
  float edge[5] = float[5](0, 0, 0, 0, 0);
  float relative = look.t_fade.slope / max(look.t_fade.keep, 1e-12);
  if (look.t_fade.is_near) {
    vec3 q = look.t_fade.foot - To;
    vec2 inward = look.t_fade.inward;
    edge = float[5](q.z * inward.y, -q.z * inward.x, q.y * inward.x - q.x * inward.y, -inward.x, -inward.y);
    for (int k = 0; k < 5; ++k) g[k] += width * relative * edge[k];
  }
  total[0] += w;
  if (keep < 0.999) total[1] += w;
  if (any(lessThan(uv, border.xy + step)) || any(greaterThan(uv, border.zw - step))) total[2] += w;
  vec2 s_slope = look.s.felt.slope;
  if (max(dot(s_slope, s_slope), dot(t.slope, t.slope)) > STEEPEST * STEEPEST) total[3] += w;
  for (int k = 0; k < 3; ++k) total[4 + k] += w * p[k];
  for (int k = 0; k < 5; ++k) total[7 + k] += w * g[k];
#ifdef HESSIAN
  // As add_curvature in simd_sums.inl.
  float a[5] = float[5](0, r.z, -r.y, 1, 0), b[5] = float[5](-r.z, 0, r.x, 0, 1);
  float carried[15];
  for (int k = 0; k < 5; ++k) {
    float along = t.slope.x * a[k] + t.slope.y * b[k];
    carried[k] = -b[k] - t.slope.y * along;
    carried[5 + k] = a[k] + t.slope.x * along;
    carried[10 + k] = t.slope.y * a[k] - t.slope.x * b[k];
  }
  vec3 n = vec3(-t.slope, 1);
  float fading = w * width * (look.t_fade.curvature / max(look.t_fade.keep, 1e-12) - relative * relative);
  bool fades = look.t_fade.is_near && look.t_fade.keep > 1e-6;
  int k = 0;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j, ++k) {
      float up = t.bend.x * a[i] * a[j] + t.bend.y * (a[i] * b[j] + b[i] * a[j]) + t.bend.z * b[i] * b[j];
      if (i < 3) up += carried[5 * i + j];
      if (j < 3) up += carried[5 * j + i];
      if (i < 3 && j < 3) up += 0.5 * (r[i] * n[j] + n[i] * r[j]);
      if (i < 3 && i == j) up -= dot(r, n);
      total[12 + k] += w * g[i] * g[j];
      total[27 + k] += (fades ? fading * edge[i] * edge[j] : 0) - w * up;
    }
  }
#endif
}

bool has_layers(Patch side, vec2 uv) {
  wait_for_all();  // the last call's result has been read
  if (gl_LocalInvocationID.x == 0u) shared_low = 0xFFFFFFFFu, shared_high = 0u;
  wait_for_all();
  for (uint i = gl_LocalInvocationID.x; i < side.facet_count; i += GROUP) {
    uint facet = side.facets + 4u * i;
    if (distance_inside(facet, uv) < -ON_EDGE) continue;
    vec4 plane = floats_at(facet);
    uint z = ordered(plane.x + dot(plane.yz, uv));
    atomicMin(shared_low, z);
    atomicMax(shared_high, z);
  }
  wait_for_all();
  return shared_high != 0u && from_ordered(shared_high) - from_ordered(shared_low) > LAYER_GAP;
}

void main() {
  uint me = gl_LocalInvocationID.x;
  uvec4 entry = frame[directory + gl_WorkGroupID.x];
  uint contact = entry.x, result = entry.y;
  uvec4 h0 = frame[contact], h1 = frame[contact + 1u], h2 = frame[contact + 2u];
  Patch S = Patch(h0.x, h0.y, h1.x, h1.y, h2.x, 1.0), T = Patch(h0.z, h0.w, h1.z, h1.w, h2.y, -1.0);
  uint flags = h2.z, parts = 1u;
  uvec2 across = uvec2(h2.w & 0xFFFFu, h2.w >> 16);  // cells along u and v
  vec4 grid = floats_at(contact + 3u), To_width = floats_at(contact + 4u), border = floats_at(contact + 5u);
  vec4 limits = floats_at(contact + 6u), recalled = floats_at(contact + 7u);
  vec2 low = grid.xy, step = grid.zw;
  float width = To_width.w, deepest = limits.x, most_step = limits.y, tail = limits.z, step_widths = limits.w;
  bool is_hard = (flags & HARD) != 0u, is_raw = (flags & RAW) != 0u;
  const uint most = MOST_CELLS;

  for (uint q = 0u; q < QUANTITIES; ++q) total[q] = 0;
  if (me == 0u) shared_best = ordered(NOWHERE), shared_kept = 0u;
  float my_best = NOWHERE, best = NOWHERE;
  vec2 my_uv = vec2(0);
  uint list = 0u;  // written to; the other one is read
  uint parents = 0u, count, kept = 0u, rounds = 0u;
  const uint RECALL = 0u, SEARCH = 1u, SUM = 2u;
  uint phase = (flags & HAS_RECALL) != 0u ? RECALL : SEARCH;
  bool is_coarse = false, is_first = true, overflows = false;
  wait_for_all();

  while (true) {
    count = phase == RECALL ? 16u : phase == SUM ? kept : is_first ? across.x * across.y : parents * parts * parts;
    vec2 cell_step = phase == RECALL ? vec2(recalled.z) : step;
    Half cell = Half(0.5 * cell_step, 0.5 * length(cell_step));
    if (is_raw) cell = Half(vec2(0), 0.0);
    float near = 0, at_edge = 0, square = 0;
    for (uint base = 0u; base < count; base += GROUP) {
      uint k = base + me;
      bool is_mine = k < count;
      uvec2 place = uvec2(0);
      if (is_mine && phase != RECALL) {
        if (phase == SUM) {
          uvec2 own = get(list, k);
          place = uvec2(own.x & 0xFFFFu, own.x >> 16);
          is_mine = uintBitsToFloat(own.y) >= best - tail;
        } else if (is_first) {
          place = uvec2(k % across.x, k / across.x);
        } else {
          uvec2 parent = get(1u - list, k / (parts * parts));
          uint child = k % (parts * parts);
          place = uvec2(parent.x & 0xFFFFu, parent.x >> 16) * parts + uvec2(child % parts, child / parts);
          is_mine = uintBitsToFloat(parent.y) >= best - tail;
        }
      }
      vec2 uv = low + step * (vec2(place) + 0.5);
      if (phase == RECALL) {
        uv = clamp(recalled.xy + cell_step * (vec2(k & 3u, (k >> 2) & 3u) - 1.5), border.xy, border.zw);
      }
      Look look;
      look.overlap = look.faded = look.bound = NOWHERE;
      if (is_mine) look = look_at(S, T, uv, cell, deepest, width, phase == SUM ? NOWHERE : best - tail);
      if (phase == SUM) {
        if (is_mine) add_cell(look, uv, step, best, width, To_width.xyz, border);
        continue;
      }
      if (look.faded > my_best) my_best = look.faded, my_uv = uv;
      if (look.faded > best) atomicMax(shared_best, ordered(look.faded));
      wait_for_all();
      float now = from_ordered(shared_best);
      if (now > best && !is_hard) {
        float scale = exp(max((best - now) / width, -80.0));
        near *= scale, at_edge *= scale, square *= scale;
      }
      best = now;
      if (phase == SEARCH && look.bound >= best - tail && !is_raw) {
        put(list, atomicAdd(shared_kept, 1u), uvec2(place.x | place.y << 16, floatBitsToUint(look.bound)));
        float at = look.is_known ? look.faded : min(look.guess, best);
        if (!is_hard && at >= best - NEAR_WIDTHS * width) {
          float p = exp((at - best) / width);
          near += p;
          if (!look.is_known || look.faded < look.overlap - FADED_WIDTHS * width) at_edge += p;
          square += p * look.sharp * look.sharp;
        }
      }
      wait_for_all();
      ++rounds;
    }
    if (phase == SUM || is_raw) break;
    if (phase == RECALL) {
      phase = SEARCH;
      continue;
    }
    kept = shared_kept;
    if (kept > MOST_KEPT) {
      overflows = true;
      break;
    }
    float longest = max(step.x, step.y);
    bool can_divide = max(across.x, across.y) <= 0xFFFFu / 2u;
    if (is_hard) {
      is_coarse = 4u * kept > most || !can_divide;
      if (kept == 0u || longest < LEAST_HARD_STEP || is_coarse) break;
      parts = 16u * kept <= most && max(across.x, across.y) <= 0xFFFFu / 4u ? 4u : 2u;
    } else {
      pool[me] = floatBitsToUint(near);
      pool[GROUP + me] = floatBitsToUint(at_edge);
      pool[2u * GROUP + me] = floatBitsToUint(square);
      add_up_columns(3u);
      near = uintBitsToFloat(pool[0]), at_edge = uintBitsToFloat(pool[GROUP]), square = uintBitsToFloat(pool[2u * GROUP]);
      if (kept == 0u) break;
      bool is_apart = best < -APART;
      float peak = near < LEAST_SEEN ? 0 : sqrt(width / max(sqrt(square / near), 1e-9));
      if (at_edge > EDGE_SHARE * near) peak = min(peak, EDGE_FADE / FADE_WIDTHS);
      float target = min(peak * (is_apart ? 2.0 : 1.0) * step_widths, most_step);
      if (longest <= target && kept >= LEAST_CELLS) {
        phase = SUM;
      } else {
        uint room = is_apart ? most / 8u : most;
        float wanted = target > 0 ? clamp(ceil(longest / target), 2.0, 4.0) : 2.0;
        parts = uint(wanted);
        while (parts > 2u && (parts * parts * kept > room || max(across.x, across.y) > 0xFFFFu / parts)) --parts;
        is_coarse = longest < LEAST_STEP || 4u * kept > room || !can_divide;
        if (is_coarse) phase = SUM;
      }
    }
    if (phase == SUM) {
      wait_for_all();
      continue;
    }
    parents = kept;
    across *= parts;
    step /= float(parts);
    list = 1u - list;
    is_first = false;
    wait_for_all();
    if (me == 0u) shared_kept = 0u;
    wait_for_all();
  }

  uint out_at = result * RESULT_WORDS;
  vec2 Q = vec2(0);
  bool is_known = best > 0.99 * NOWHERE && !overflows;
  if (is_hard) {
    // The best sample, and what may still hide a greater overlap.
    if (me == 0u) shared_winner = 0xFFFFFFFFu;
    wait_for_all();
    if (my_best == best) atomicMin(shared_winner, me);
    wait_for_all();
    if (is_known && shared_winner == me) {
      results[out_at + 48u] = floatBitsToUint(my_uv.x), results[out_at + 49u] = floatBitsToUint(my_uv.y);
      results[out_at + 50u] = floatBitsToUint(best);
      pool[0] = floatBitsToUint(my_uv.x), pool[1] = floatBitsToUint(my_uv.y);
    }
    wait_for_all();
    Q = uintBitsToFloat(uvec2(pool[0], pool[1]));
    uint candidates = is_known ? 1u : 0u;
    for (; candidates < 16u && is_known && !is_raw; ++candidates) {
      wait_for_all();
      if (me == 0u) shared_pick = ordered(NOWHERE), shared_winner = 0xFFFFFFFFu;
      wait_for_all();
      float mine = NOWHERE;
      uint mine_at = 0u;
      for (uint k = me; k < kept; k += GROUP) {
        float bound = uintBitsToFloat(get(list, k).y);
        if (bound > mine && bound >= best - tail) mine = bound, mine_at = k;
      }
      atomicMax(shared_pick, ordered(mine));
      wait_for_all();
      if (from_ordered(shared_pick) <= 0.99 * NOWHERE) break;
      if (ordered(mine) == shared_pick) atomicMin(shared_winner, mine_at);
      wait_for_all();
      if (ordered(mine) == shared_pick && shared_winner == mine_at) {
        uvec2 own = get(list, mine_at);
        vec2 uv = low + step * (vec2(own.x & 0xFFFFu, own.x >> 16) + 0.5);
        uint at = out_at + 48u + 3u * candidates;
        results[at] = floatBitsToUint(uv.x), results[at + 1u] = floatBitsToUint(uv.y), results[at + 2u] = own.y;
        put(list, mine_at, uvec2(own.x, floatBitsToUint(NOWHERE)));
      }
    }
    if (me == 0u) results[out_at + 2u] = candidates;
  } else {
    wait_for_all();
    for (uint first = 0u; first < QUANTITIES; first += AT_ONCE) {
      uint columns = min(AT_ONCE, QUANTITIES - first);
      for (uint q = 0u; q < columns; ++q) pool[q * GROUP + me] = floatBitsToUint(total[first + q]);
      add_up_columns(columns);
      if (me < columns) results[out_at + 4u + first + me] = pool[me * GROUP];
      if (first == 0u) {
        float weight = uintBitsToFloat(pool[0]);
        is_known = is_known && weight > 0;
        Q = vec2(uintBitsToFloat(pool[4u * GROUP]), uintBitsToFloat(pool[5u * GROUP])) / max(weight, 1e-37);
      }
      wait_for_all();
    }
  }
  bool s_has = has_layers(S, Q), t_has = has_layers(T, Q), has_several = is_known && (s_has || t_has);
  // Mesa's software drivers end every loop after 65,535 turns of all loops together: then one of two turns is missing.
  uint turns = 0u;
  while (turns < entry.w) ++turns;
  if (me == 0u) shared_pick = 0u;
  wait_for_all();
  if (turns < entry.w) atomicOr(shared_pick, 1u);
  wait_for_all();
  overflows = overflows || shared_pick != 0u;
  if (me == 0u) {
    results[out_at + STAMP] = entry.z;
    results[out_at] = (is_known ? KNOWN : 0u) | (is_coarse ? COARSE : 0u) | (has_several ? LAYERS : 0u) |
                      (overflows ? OVERFLOWS : 0u);
    results[out_at + 1u] = floatBitsToUint(best);
    results[out_at + 3u] = rounds;
    results[out_at + 46u] = floatBitsToUint(step.x), results[out_at + 47u] = floatBitsToUint(step.y);
  }
}
)glsl"
