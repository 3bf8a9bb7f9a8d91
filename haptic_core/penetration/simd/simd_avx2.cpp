// Built with -mavx2 -mfma; called only where the machine has both.
#include <immintrin.h>

#define FARFEEL_LANES 8
#define FARFEEL_KERNELS kAvx2
#define FARFEEL_NAME "avx2"
#include "haptic_core/penetration/simd/simd_lanes.inl"

namespace farfeel::penetration::simd {
namespace {

inline I gather(const std::uint32_t* base, I index) {
  return reinterpret_cast<I>(
      _mm256_i32gather_epi32(reinterpret_cast<const int*>(base), reinterpret_cast<__m256i>(index), 4));
}
inline F gather(const float* base, I index) {
  return _mm256_i32gather_ps(base, reinterpret_cast<__m256i>(index), 4);
}
/// Half as many loads as by words, which is what a gather costs.
inline FourTexels gather_four(const std::uint16_t* base, I index) {
  const __m256i at = reinterpret_cast<__m256i>(index);
  const auto* quads = reinterpret_cast<const long long*>(base);
  const __m256 low = _mm256_castsi256_ps(_mm256_i32gather_epi64(quads, _mm256_castsi256_si128(at), 2));
  const __m256 high = _mm256_castsi256_ps(_mm256_i32gather_epi64(quads, _mm256_extracti128_si256(at, 1), 2));
  // Shuffles work on halves: words come out as 0 1 4 5 2 3 6 7.
  const __m256i order = _mm256_setr_epi32(0, 1, 4, 5, 2, 3, 6, 7);
  const __m256i first = _mm256_castps_si256(_mm256_shuffle_ps(low, high, 0x88));
  const __m256i second = _mm256_castps_si256(_mm256_shuffle_ps(low, high, 0xDD));
  return {reinterpret_cast<I>(_mm256_permutevar8x32_epi32(first, order)),
          reinterpret_cast<I>(_mm256_permutevar8x32_epi32(second, order))};
}
inline unsigned bits_of(I mask) {
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask)));
}
/// For each choice of lanes, their numbers one after the other.
struct Chosen {
  alignas(8) std::uint8_t lanes[1 << kLanes][kLanes];

  constexpr Chosen() : lanes{} {
    for (int bits = 0; bits < 1 << kLanes; ++bits) {
      for (int k = 0, n = 0; k < kLanes; ++k) {
        if ((bits >> k & 1) != 0) lanes[bits][n++] = static_cast<std::uint8_t>(k);
      }
    }
  }
};
constexpr Chosen kChosen;

/// Stores the lanes that have a bit, one after the other, and something after them.
inline void push(float* to, F x, unsigned bits) {
  const __m256i order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kChosen.lanes[bits])));
  _mm256_storeu_ps(to, _mm256_permutevar8x32_ps(x, order));
}
inline void push(std::int32_t* to, I x, unsigned bits) {
  push(reinterpret_cast<float*>(to), reinterpret_cast<F>(x), bits);
}
inline F root(F x) {
  return _mm256_sqrt_ps(x);
}
/// A division: the processor's estimate, and what Newton's steps make of it, has other bits on another maker's.
inline F reciprocal(F x) {
  return 1 / x;
}
inline float least_of(F x) {
  __m128 y = _mm_min_ps(_mm256_castps256_ps128(x), _mm256_extractf128_ps(x, 1));
  y = _mm_min_ps(y, _mm_movehl_ps(y, y));
  return _mm_cvtss_f32(_mm_min_ss(y, _mm_shuffle_ps(y, y, 1)));
}
inline float greatest_of(F x) {
  return -least_of(-x);
}
inline float sum_of(F x) {
  __m128 y = _mm_add_ps(_mm256_castps256_ps128(x), _mm256_extractf128_ps(x, 1));
  y = _mm_add_ps(y, _mm_movehl_ps(y, y));
  return _mm_cvtss_f32(_mm_add_ss(y, _mm_shuffle_ps(y, y, 1)));
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd/simd_kernels.inl"
