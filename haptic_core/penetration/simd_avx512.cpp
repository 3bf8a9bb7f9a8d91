// Built with -mavx512f -mavx512dq -mavx512vl; called only where the machine has them.
#include <immintrin.h>

#define FARFEEL_LANES 16
#define FARFEEL_KERNELS kAvx512
#define FARFEEL_NAME "avx512"

namespace farfeel::penetration::simd {
namespace {

typedef int Index __attribute__((vector_size(64)));

inline Index gather(const unsigned short* base, Index index) {
  return reinterpret_cast<Index>(_mm512_i32gather_epi32(reinterpret_cast<__m512i>(index), base, 2));
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd_kernels.inl"
