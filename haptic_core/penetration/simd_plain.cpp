// For any machine: four lanes, which every compiler target of ours has or imitates.
#include <cstring>

#define FARFEEL_LANES 4
#define FARFEEL_KERNELS kPlain
#define FARFEEL_NAME "plain"

namespace farfeel::penetration::simd {
namespace {

typedef int Index __attribute__((vector_size(16)));

inline Index gather(const unsigned short* base, Index index) {
  Index pairs;
  for (int k = 0; k < 4; ++k) {
    int pair;
    std::memcpy(&pair, base + index[k], sizeof pair);
    pairs[k] = pair;
  }
  return pairs;
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd_kernels.inl"
