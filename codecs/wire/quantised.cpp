#include "codecs/wire/quantised.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

namespace farfeel::codecs {
namespace {

constexpr std::uint32_t kSingleInfinity = 0x7F80'0000, kSingleNaN = 0x7FC0'0000;
constexpr double kDirectionSteps = (1 << 23) - 1;
constexpr std::int32_t kNoDirection = -(1 << 23);
constexpr double kRotationSteps = (1 << 19) - 1;
constexpr std::uint64_t kNoRotation = 0;  // components of -2^19
constexpr std::uint32_t kRotationMiddle = 1 << 19, kRotationMask = (1 << 20) - 1;

double sign_of(double v) {
  return v < 0 ? -1 : 1;
}

}  // namespace

std::uint16_t half_of(double value) noexcept {
  constexpr std::uint32_t kOverflow = 0x477F'F000;     // 65520, half way from the greatest half to what is next
  constexpr std::uint32_t kLeastNormal = 0x3880'0000;  // 2^-14
  constexpr std::uint32_t kExponentsApart = (127 - 15) << 10;
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  const std::uint32_t sign = bits >> 16 & 0x8000, size = bits & 0x7FFF'FFFF;
  std::uint32_t half = 0;
  if (size > kSingleInfinity) {
    half = 0x7E00;
  } else if (size >= kOverflow) {
    half = 0x7C00;
  } else if (size < kLeastNormal) {
    half = static_cast<std::uint32_t>(std::nearbyint(std::ldexp(std::bit_cast<float>(size), 24)));
  } else {
    half = ((size + 0xFFF + (size >> 13 & 1)) >> 13) - kExponentsApart;
  }
  return static_cast<std::uint16_t>(sign | half);
}

double from_half(std::uint16_t half) noexcept {
  const int exponent = half >> 10 & 0x1F, digits = half & 0x3FF;
  double size = std::ldexp(digits, -24);
  if (exponent == 0x1F) {
    size = digits == 0 ? HUGE_VAL : std::nan("");
  } else if (exponent > 0) {
    size = std::bit_cast<float>(static_cast<std::uint32_t>((exponent + 112) << 23 | digits << 13));
  }
  return (half & 0x8000) != 0 ? -size : size;
}

std::uint32_t float24_of(double value) noexcept {
  auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  if ((bits & 0x7FFF'FFFF) > kSingleInfinity) bits = kSingleNaN;
  return (bits + 0x7F + (bits >> 8 & 1)) >> 8;
}

double from_float24(std::uint32_t code) noexcept {
  return std::bit_cast<float>(code << 8);
}

Direction direction_of(const glm::dvec3& nhat) noexcept {
  const double sum = std::abs(nhat.x) + std::abs(nhat.y) + std::abs(nhat.z);
  if (!(sum > 0) || !std::isfinite(sum)) return {kNoDirection, kNoDirection};
  double u = nhat.x / sum, v = nhat.y / sum;
  if (nhat.z < 0) {
    const double folded_u = (1 - std::abs(v)) * sign_of(u);
    v = (1 - std::abs(u)) * sign_of(v);
    u = folded_u;
  }
  const auto code = [](double c) { return static_cast<std::int32_t>(std::nearbyint(kDirectionSteps * c)); };
  return {code(u), code(v)};
}

std::optional<glm::dvec3> from_direction(Direction code) noexcept {
  if (std::abs(code.u) > kDirectionSteps || std::abs(code.v) > kDirectionSteps) return std::nullopt;
  const double u = code.u / kDirectionSteps, v = code.v / kDirectionSteps;
  const double z = 1 - std::abs(u) - std::abs(v);
  if (z >= 0) return glm::normalize(glm::dvec3{u, v, z});
  return glm::normalize(glm::dvec3{(1 - std::abs(v)) * sign_of(u), (1 - std::abs(u)) * sign_of(v), z});
}

std::uint64_t rotation_of(const glm::dquat& R) noexcept {
  constexpr double kUnit = 1e-3;
  if (!(std::abs(glm::dot(R, R) - 1) <= kUnit)) return kNoRotation;
  const std::array<double, 4> c{R.w, R.x, R.y, R.z};
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i)
    if (std::abs(c[i]) > std::abs(c[largest])) largest = i;
  const double scale = sign_of(c[largest]) * std::numbers::sqrt2 * kRotationSteps;
  std::uint64_t code = static_cast<std::uint64_t>(largest) << 60;
  for (std::size_t i = 0, shift = 0; i < 4; ++i) {
    if (i == largest) continue;
    const double steps = std::clamp(std::nearbyint(scale * c[i]), -kRotationSteps, kRotationSteps);
    code |= static_cast<std::uint64_t>(static_cast<std::int64_t>(steps) + kRotationMiddle) << shift;
    shift += 20;
  }
  return code;
}

std::optional<glm::dquat> from_rotation(std::uint64_t code) noexcept {
  if (code >> 62 != 0) return std::nullopt;
  const std::size_t largest = code >> 60;
  std::array<double, 4> c{};
  double rest = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const auto steps = static_cast<std::int32_t>(code & kRotationMask) - static_cast<std::int32_t>(kRotationMiddle);
    if (std::abs(steps) > kRotationSteps) return std::nullopt;
    c[i] = steps / (std::numbers::sqrt2 * kRotationSteps);
    rest -= c[i] * c[i];
    code >>= 20;
  }
  if (rest < 0) return std::nullopt;
  c[largest] = std::sqrt(rest);
  return glm::dquat{c[0], c[1], c[2], c[3]};
}

}  // namespace farfeel::codecs
