// Every code of the short ones, and the codes next to the one that an encoder gave, as the slow obvious search.
#include "codecs/wire/quantised.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace farfeel::codecs {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

TEST(Half, IsBinary16) {
  EXPECT_EQ(half_of(1), 0x3C00);
  EXPECT_EQ(half_of(-2), 0xC000);
  EXPECT_EQ(half_of(65504), 0x7BFF);
  EXPECT_EQ(half_of(65519), 0x7BFF);
  EXPECT_EQ(half_of(65520), 0x7C00);
  EXPECT_EQ(half_of(std::ldexp(1, -24)), 1);
  EXPECT_EQ(half_of(std::ldexp(1, -14)), 0x0400);
  EXPECT_EQ(half_of(1.0 / 3), 0x3555);
  EXPECT_EQ(from_half(0x3555), 1365.0 / 4096);
  EXPECT_TRUE(std::isnan(from_half(half_of(kNaN))));
  EXPECT_EQ(from_half(half_of(kInfinity)), kInfinity);
  EXPECT_EQ(from_half(half_of(-1e300)), -kInfinity);
  for (std::uint32_t code = 0; code <= 0xFFFF; ++code) {
    const double value = from_half(static_cast<std::uint16_t>(code));
    if (!std::isnan(value)) {
      ASSERT_EQ(half_of(value), code);
    }
  }
}

TEST(Half, IsTheNearest) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-26, 15.9);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::exp2(exponent(random));
    const std::uint16_t code = half_of(value);
    const double off = std::abs(from_half(code) - value);
    for (const int beside : {-1, 1}) {  // but for what is lost on the way through a single
      if (code == 0 && beside < 0) continue;
      EXPECT_LE(off, std::abs(from_half(static_cast<std::uint16_t>(code + beside)) - value) * (1 + 3e-4)) << value;
    }
    if (value > 6.2e-5) {
      EXPECT_LE(off, 4.9e-4 * value);
    }
  }
}

TEST(Float24, KeepsSixteenDigits) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponent(-100, 100);
  for (int i = 0; i < 100000; ++i) {
    const double value = (i % 2 == 0 ? 1 : -1) * std::exp2(exponent(random));
    const std::uint32_t code = float24_of(value);
    EXPECT_LE(code, 0xFF'FFFFu);
    EXPECT_LE(std::abs(from_float24(code) - value), 1.53e-5 * std::abs(value));
    EXPECT_EQ(float24_of(from_float24(code)), code);
  }
  EXPECT_EQ(from_float24(float24_of(0)), 0);
  EXPECT_EQ(from_float24(float24_of(1)), 1);
  for (const double value : {kNaN, kInfinity, 1e300, static_cast<double>(std::numeric_limits<float>::max())})
    EXPECT_FALSE(std::isfinite(from_float24(float24_of(value)))) << value;
}

TEST(DirectionCode, IsWithin300NanoradAndUnit) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  double worst_rad = 0;
  const auto check = [&](const glm::dvec3& nhat) {
    const auto back = from_direction(direction_of(nhat));
    ASSERT_TRUE(back);
    EXPECT_NEAR(glm::length(*back), 1, 1e-15);
    worst_rad = std::max(worst_rad, glm::length(glm::cross(*back, nhat)));
    EXPECT_GT(glm::dot(*back, nhat), 0);
  };
  for (int i = 0; i < 100000; ++i) check(glm::normalize(glm::dvec3{normal(random), normal(random), normal(random)}));
  for (int i = 0; i < 27; ++i) {
    const glm::dvec3 corner{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    if (glm::length(corner) > 0) check(glm::normalize(corner));
    if (glm::length(corner) == 1) {
      EXPECT_EQ(from_direction(direction_of(corner)), corner);
    }
  }
  EXPECT_LT(worst_rad, 3e-7);
  EXPECT_FALSE(from_direction(direction_of({kNaN, 0, 1})));
  EXPECT_FALSE(from_direction(direction_of({kInfinity, 0, 1})));
  EXPECT_FALSE(from_direction(direction_of({0, 0, 0})));
}

TEST(RotationCode, IsWithin4Microrad) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  double worst_rad = 0;
  const auto check = [&](const glm::dquat& R) {
    const auto back = from_rotation(rotation_of(R));
    ASSERT_TRUE(back);
    EXPECT_NEAR(glm::length(*back), 1, 1e-12);
    worst_rad = std::max(worst_rad, glm::length(spatial::vector_from_rotation(*back * glm::conjugate(R))));
  };
  for (int i = 0; i < 100000; ++i)
    check(glm::normalize(glm::dquat{normal(random), normal(random), normal(random), normal(random)}));
  for (int i = 0; i < 81; ++i) {
    const glm::dquat R(i % 3 - 1, i / 3 % 3 - 1, i / 9 % 3 - 1, i / 27 - 1);
    if (glm::length(R) > 0) check(glm::normalize(R));
  }
  EXPECT_LT(worst_rad, 4e-6);
  EXPECT_EQ(from_rotation(rotation_of({1, 0, 0, 0})), glm::dquat(1, 0, 0, 0));
  EXPECT_EQ(from_rotation(rotation_of({-1, 0, 0, 0})), glm::dquat(1, 0, 0, 0)) << "the same rotation";
}

TEST(RotationCode, WhatIsNoRotationIsRefused) {
  EXPECT_FALSE(from_rotation(rotation_of({kNaN, 0, 0, 0})));
  EXPECT_FALSE(from_rotation(rotation_of({1, 1, 1, 1})));
  EXPECT_FALSE(from_rotation(0)) << "-2^19";
  EXPECT_FALSE(from_rotation(~std::uint64_t{0}));
  const std::uint64_t identity = rotation_of({1, 0, 0, 0});
  EXPECT_FALSE(from_rotation(identity | std::uint64_t{1} << 62));
  EXPECT_FALSE(from_rotation(identity | std::uint64_t{1} << 63));
  const std::uint64_t most = (1 << 20) - 1;
  EXPECT_FALSE(from_rotation(most | most << 20 | most << 40)) << "1.5 of 1";
}

}  // namespace
}  // namespace farfeel::codecs
