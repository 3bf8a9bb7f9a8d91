// Vectors of kLanes floats. Included first by simd_plain.cpp, simd_avx2.cpp and simd_avx512.cpp, which differ in the
// width and in a few functions: gather (of words, of floats), gather_four, bits_of, push, root, reciprocal, least_of,
// greatest_of, sum_of. FARFEEL_LANES: floats in a vector.
#include "haptic_core/penetration/simd/simd_kernels.h"

namespace farfeel::penetration::simd {
namespace {

constexpr int kLanes = FARFEEL_LANES;
typedef float F __attribute__((vector_size(4 * kLanes)));
typedef float Unaligned __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
typedef std::int32_t I __attribute__((vector_size(4 * kLanes)));

/// Four neighbours of a row of 16-bit texels, two in each word.
struct FourTexels {
  I first, second;
};

inline F all(float x) {
  return x - F{};  // which is x, whatever its sign: nothing is left to subtract
}
inline F load(const float* p) {
  return *reinterpret_cast<const Unaligned*>(p);
}
inline void store(float* p, F x) {
  *reinterpret_cast<Unaligned*>(p) = x;
}
inline F least(F a, F b) {
  return a < b ? a : b;
}
inline F most(F a, F b) {
  return a > b ? a : b;
}
inline F size_of(F x) {
  return x < all(0) ? -x : x;
}
inline double total(F x) {
  double sum = 0;
  for (int k = 0; k < kLanes; ++k) sum += static_cast<double>(x[k]);
  return sum;
}

/// e^x within 3e-7 relative for -80 <= x <= 80: 2^n by its bits, the rest by Taylor on |r| <= ln 2 / 2.
inline F exponential(F x) {
  x = least(most(x, all(-80)), all(80));
  const F scaled = x * 1.44269504f;
  const I n = __builtin_convertvector(scaled + (scaled < all(0) ? all(-0.5f) : all(0.5f)), I);
  const F nf = __builtin_convertvector(n, F);
  const F r = (x - nf * 0.693359375f) + nf * 2.12194440e-4f;
  const F p =
      1 + r * (1 + r * (0.5f + r * (1.6666667e-1f + r * (4.1666667e-2f + r * (8.3333333e-3f + r * 1.3888889e-3f)))));
  const I power = (n + 127) << 23;
  return p * reinterpret_cast<F>(power);
}

/// ln x within 2e-4, for normal x > 0: its exponent, and a polynomial on the mantissa.
inline F logarithm(F x) {
  const I bits = reinterpret_cast<I>(x);
  const I mantissa = (bits & 0x7FFFFF) | 0x3F800000;
  const F m = reinterpret_cast<F>(mantissa);
  const F p = -1.7417939f + (2.8212026f + (-1.4699568f + (0.44717955f - 0.056570851f * m) * m) * m) * m;
  return __builtin_convertvector((bits >> 23) - 127, F) * 0.69314718f + p;
}

}  // namespace
}  // namespace farfeel::penetration::simd
