// Built with -mavx2 -mfma; called only where the machine has both.
#include <immintrin.h>

#define FARFEEL_LANES 8
#define FARFEEL_KERNELS kAvx2
#define FARFEEL_NAME "avx2"

namespace farfeel::penetration::simd {
namespace {

typedef int Index __attribute__((vector_size(32)));

inline Index gather(const unsigned short* base, Index index) {
  return reinterpret_cast<Index>(
      _mm256_i32gather_epi32(reinterpret_cast<const int*>(base), reinterpret_cast<__m256i>(index), 2));
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd_kernels.inl"
