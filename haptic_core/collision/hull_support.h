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

struct Reach {
  std::uint32_t vertex;
  double along_m;  ///< vertex . d
};

[[gnu::always_inline]] inline void load_four(Four& v, const double* from) {
  std::memcpy(&v, from, sizeof v);
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
  const bool second = best[1] > best[0], fourth = best[3] > best[2];
  const double low = second ? best[1] : best[0], high = fourth ? best[3] : best[2];
  const std::int64_t low_at = second ? where[1] : where[0], high_at = fourth ? where[3] : where[2];
  return high > low ? Reach{std::uint32_t(high_at), high} : Reach{std::uint32_t(low_at), low};
}

/// Only how far: max over the hull of vertex . d.
[[gnu::always_inline]] inline double extent_along(const HullVertices& hull, const glm::dvec3& d) {
  Four x, y, z;
  load_four(x, hull.x), load_four(y, hull.y), load_four(z, hull.z);
  Four best = x * d.x + y * d.y + z * d.z;
  for (std::uint32_t i = 4; i < hull.count; i += 4) {
    load_four(x, hull.x + i), load_four(y, hull.y + i), load_four(z, hull.z + i);
    const Four along = x * d.x + y * d.y + z * d.z;
    best = along > best ? along : best;
  }
  const double low = best[1] > best[0] ? best[1] : best[0], high = best[3] > best[2] ? best[3] : best[2];
  return high > low ? high : low;
}

}  // namespace farfeel::collision
