// The vertex of a hull that lies farthest along a direction: four vertices at a time.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>

#include "haptic_core/collision/convex_pair.h"

// A function compiled twice, for plain x86-64 and for AVX2; the loader takes what the processor has. Contraction is off
// everywhere, so both give the same bits. Sanitizers run before the loader can choose, hence not there.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(FARFEEL_SANITIZED)
#define FARFEEL_WIDE_VECTORS [[gnu::target_clones("avx2", "default"), gnu::flatten]]
#else
#define FARFEEL_WIDE_VECTORS
#endif

namespace farfeel::collision {

using Four [[gnu::vector_size(32)]] = double;
using FourIndices [[gnu::vector_size(32)]] = std::int64_t;

struct FourVectors {
  Four x, y, z;
};

struct Reach {
  std::uint32_t vertex;
  double along_m;  ///< vertex . d
};

[[gnu::always_inline]] inline void load_four(Four& v, const double* from) {
  std::memcpy(&v, from, sizeof v);
}

[[gnu::always_inline]] inline void store_four(double* to, const Four& v) {
  std::memcpy(to, &v, sizeof v);
}

[[gnu::always_inline]] inline Reach farthest(const HullVertices& hull, const glm::dvec3& d) {
  Four x, y, z;
  load_four(x, hull.x), load_four(y, hull.y), load_four(z, hull.z);
  Four best = x * d.x + y * d.y + z * d.z;
  FourIndices where = {0, 1, 2, 3}, here = where;
  for (std::uint32_t i = 4; i < hull.count; i += 4) {
    load_four(x, hull.x + i), load_four(y, hull.y + i), load_four(z, hull.z + i);
    const Four along = x * d.x + y * d.y + z * d.z;
    here += 4;
    const FourIndices more = along > best;
    best = more ? along : best;
    where = more ? here : where;
  }
  const auto take = [&](const Four& best_there, const FourIndices& where_there) {
    const FourIndices more = best_there > best;
    best = more ? best_there : best;
    where = more ? where_there : where;
  };
  take(__builtin_shufflevector(best, best, 1, 0, 3, 2), __builtin_shufflevector(where, where, 1, 0, 3, 2));
  take(__builtin_shufflevector(best, best, 2, 3, 0, 1), __builtin_shufflevector(where, where, 2, 3, 0, 1));
  return {std::uint32_t(where[0]), best[0]};
}

/// Only how far, four lanes of it: the largest is max over the hull of vertex . d.
[[gnu::always_inline]] inline void extents_along(Four& best, const HullVertices& hull, const glm::dvec3& d) {
  Four x, y, z;
  load_four(x, hull.x), load_four(y, hull.y), load_four(z, hull.z);
  best = x * d.x + y * d.y + z * d.z;
  for (std::uint32_t i = 4; i < hull.count; i += 4) {
    load_four(x, hull.x + i), load_four(y, hull.y + i), load_four(z, hull.z + i);
    const Four along = x * d.x + y * d.y + z * d.z;
    best = along > best ? along : best;
  }
}

/// max over the hull of vertex . d.
[[gnu::always_inline]] inline double reach_along(const HullVertices& hull, const glm::dvec3& d) {
  Four best;
  extents_along(best, hull, d);
  const double low = best[1] > best[0] ? best[1] : best[0], high = best[3] > best[2] ? best[3] : best[2];
  return high > low ? high : low;
}

/// Cosine of the least angle between unit d and a hull's outward directions; 1 when there are none.
[[gnu::always_inline]] inline double outwardness(const HullVertices& outwards, const glm::dvec3& d) {
  return outwards.count == 0 ? 1 : reach_along(outwards, d);
}

/// max over A of a . d, plus max over B of -b . d.
[[gnu::always_inline]] inline double reach_of_both(const HullVertices& A, const HullVertices& B, const glm::dvec3& d) {
  Four a, b;
  extents_along(a, A, d), extents_along(b, B, -d);
  const Four even = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  const Four odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Four most = even > odd ? even : odd;  // a, b, a, b
  return (most[0] > most[2] ? most[0] : most[2]) + (most[1] > most[3] ? most[1] : most[3]);
}

}  // namespace farfeel::collision
