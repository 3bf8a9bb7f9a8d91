// For any machine: four lanes, which every compiler target of ours has or imitates.
#include <cstring>

#define FARFEEL_LANES 4
#define FARFEEL_KERNELS kPlain
#define FARFEEL_NAME "plain"
#include "haptic_core/penetration/simd/simd_lanes.inl"

namespace farfeel::penetration::simd {
namespace {

inline I gather(const std::uint32_t* base, I index) {
  I words;
  for (int k = 0; k < kLanes; ++k) words[k] = static_cast<std::int32_t>(base[index[k]]);
  return words;
}
inline F gather(const float* base, I index) {
  F floats;
  for (int k = 0; k < kLanes; ++k) floats[k] = base[index[k]];
  return floats;
}
inline FourTexels gather_four(const std::uint16_t* base, I index) {
  FourTexels four;
  for (int k = 0; k < kLanes; ++k) {
    std::int32_t words[2];
    std::memcpy(words, base + index[k], sizeof words);
    four.first[k] = words[0];
    four.second[k] = words[1];
  }
  return four;
}
inline unsigned bits_of(I mask) {
  unsigned bits = 0;
  for (int k = 0; k < kLanes; ++k) bits |= static_cast<unsigned>(mask[k] & 1) << k;
  return bits;
}
/// Stores the lanes that have a bit, one after the other.
inline void push(float* to, F x, unsigned bits) {
  for (; bits != 0; bits &= bits - 1) *to++ = x[__builtin_ctz(bits)];
}
inline void push(std::int32_t* to, I x, unsigned bits) {
  for (; bits != 0; bits &= bits - 1) *to++ = x[__builtin_ctz(bits)];
}
inline F root(F x) {
  F y;
  for (int k = 0; k < kLanes; ++k) y[k] = __builtin_sqrtf(x[k]);
  return y;
}
inline F reciprocal(F x) {
  return 1 / x;
}
inline float least_of(F x) {
  float least = x[0];
  for (int k = 1; k < kLanes; ++k) least = x[k] < least ? x[k] : least;
  return least;
}
inline float greatest_of(F x) {
  return -least_of(-x);
}
inline float sum_of(F x) {
  float sum = x[0];
  for (int k = 1; k < kLanes; ++k) sum += x[k];
  return sum;
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd/simd_kernels.inl"
