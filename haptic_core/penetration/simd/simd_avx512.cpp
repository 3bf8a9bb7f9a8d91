// Built with -mavx512f -mavx512dq -mavx512vl; called only where the machine has them.
#include <immintrin.h>

#define FARFEEL_LANES 16
#define FARFEEL_KERNELS kAvx512
#define FARFEEL_NAME "avx512"
#include "haptic_core/penetration/simd/simd_lanes.inl"

namespace farfeel::penetration::simd {
namespace {

inline I gather(const std::uint32_t* base, I index) {
  return reinterpret_cast<I>(_mm512_i32gather_epi32(reinterpret_cast<__m512i>(index), base, 4));
}
inline F gather(const float* base, I index) {
  return _mm512_i32gather_ps(reinterpret_cast<__m512i>(index), base, 4);
}
/// Half as many loads as by words, which is what a gather costs.
inline FourTexels gather_four(const std::uint16_t* base, I index) {
  const __m512i at = reinterpret_cast<__m512i>(index);
  const __m512i low = _mm512_i32gather_epi64(_mm512_castsi512_si256(at), base, 2);
  const __m512i high = _mm512_i32gather_epi64(_mm512_extracti64x4_epi64(at, 1), base, 2);
  const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const __m512i odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
  return {reinterpret_cast<I>(_mm512_permutex2var_epi32(low, even, high)),
          reinterpret_cast<I>(_mm512_permutex2var_epi32(low, odd, high))};
}
inline unsigned bits_of(I mask) {
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask));
}
/// Stores the lanes that have a bit, one after the other; what lies behind them, up to a whole vector, is lost.
inline void push(float* to, F x, unsigned bits) {
  _mm512_storeu_ps(to, _mm512_maskz_compress_ps(static_cast<__mmask16>(bits), x));
}
inline void push(std::int32_t* to, I x, unsigned bits) {
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), reinterpret_cast<__m512i>(x)));
}
inline F root(F x) {
  return _mm512_sqrt_ps(x);
}
/// One step of Newton on an estimate of 14 bits.
inline F reciprocal(F x) {
  const F y = _mm512_rcp14_ps(x);
  return y * (2 - x * y);
}
inline float least_of(F x) {
  return _mm512_reduce_min_ps(x);
}
inline float greatest_of(F x) {
  return _mm512_reduce_max_ps(x);
}
inline float sum_of(F x) {
  return _mm512_reduce_add_ps(x);
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd/simd_kernels.inl"
