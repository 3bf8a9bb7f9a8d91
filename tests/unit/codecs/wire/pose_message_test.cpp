#include "codecs/wire/pose_message.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "codecs/wire/quantised.h"
#include "tests/unit/codecs/wire/random_touch.h"

namespace farfeel::codecs {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Buffer = std::array<std::byte, 256>;

struct Lane {
  explicit Lane(const PoseGrid& grid = {}) { writer.reset(grid); }
  Fault carry(const PoseMessage& m) {
    size = writer.write(m, buffer);
    return read(std::span(buffer).first(size), writer.grid(), back);
  }
  PoseWriter writer;
  Buffer buffer{};
  std::size_t size = 0;
  PoseMessage back;
};

TEST(PoseGrid, IsTheFinestThatHoldsTwiceTheScene) {
  EXPECT_EQ(grid_around({-0.1, -0.1, 0}, {0.1, 0.1, 0.3}), (PoseGrid{{0, 0, 0.15}, kFinestExponent}));
  EXPECT_EQ(grid_around({-0.4, 0, 0}, {0.4, 0, 0}).exponent, -23);
  EXPECT_EQ(grid_around({-100, 0, 0}, {100, 0, 0}).exponent, kCoarsestExponent) << "no coarser than a texture";
  std::array<std::byte, kPoseGridBytes> bytes;
  const PoseGrid grid{{1, 2, 3}, -22};
  PoseGrid back;
  ASSERT_EQ(write(grid, bytes), kPoseGridBytes);
  ASSERT_EQ(read(bytes, back), Fault::kNone);
  EXPECT_EQ(back, grid);
  EXPECT_EQ(read(std::span(bytes).first(24), back), Fault::kLength);
  EXPECT_EQ(write(grid, std::span(bytes).first(24)), 0u);
  for (const PoseGrid& bad : {PoseGrid{{kNaN, 0, 0}, -22}, PoseGrid{{0, 0, 0}, -25}, PoseGrid{{0, 0, 0}, -19}}) {
    ASSERT_EQ(write(bad, bytes), kPoseGridBytes);
    EXPECT_NE(read(bytes, back), Fault::kNone);
  }
}

TEST(PoseMessage, IsTheSameAtBothEndsAndWithinAStep) {
  Random random(1);
  Lane lane;
  for (std::uint32_t i = 1; i <= 20000; ++i) {
    const PoseMessage m = random_pose(random);
    ASSERT_EQ(lane.carry(m), Fault::kNone);
    ASSERT_EQ(lane.size, kPoseMessageBytes + (m.felt_To_W ? kWrenchBytes : 0));
    EXPECT_LE(lane.size, 64u);
    const PoseMessage& back = lane.back;
    const SentPose* sent = lane.writer.find(i);
    ASSERT_TRUE(sent);
    EXPECT_EQ(back.number, i);
    EXPECT_EQ(sent->sequence, m.sequence);
    EXPECT_EQ(back.time_us, m.time_us);
    EXPECT_EQ(sent->time_us, m.time_us);
    EXPECT_EQ(back.X_WT, sent->X_WT) << "to the last bit";
    EXPECT_LE(glm::length(back.X_WT.p - m.X_WT.p), 0.9 * lane.writer.grid().step_m());
    EXPECT_LE(glm::length(spatial::vector_from_rotation(back.X_WT.R * glm::conjugate(m.X_WT.R))), 4e-6);
    EXPECT_LE(glm::length(back.V_WT_W.angular_rad_s - m.V_WT_W.angular_rad_s), 1e-2);
    EXPECT_LE(glm::length(back.V_WT_W.linear_m_s - m.V_WT_W.linear_m_s), 1e-3);
    EXPECT_EQ(back.times, m.times);
    EXPECT_EQ(back.heard, m.heard);
    ASSERT_EQ(back.felt_To_W.has_value(), m.felt_To_W.has_value());
    if (m.felt_To_W) {
      EXPECT_LE(glm::length(back.felt_To_W->force_N - m.felt_To_W->force_N), 5e-4 * glm::length(m.felt_To_W->force_N));
    }
    EXPECT_EQ(back.line.by, teleoperation::Controller::kOurs);
  }
}

TEST(PoseMessage, OutsideTheGridIsToldInFull) {
  Random random(2);
  Lane lane;
  for (int i = 0; i < 1000; ++i) {
    PoseMessage m = random_pose(random);
    m.X_WT.p = random.vector(9000) + glm::dvec3(1, 0, 0);
    ASSERT_EQ(lane.carry(m), Fault::kNone);
    EXPECT_EQ(lane.size, kPoseMessageBytes + 15 + (m.felt_To_W ? kWrenchBytes : 0));
    EXPECT_EQ(lane.back.X_WT.p, m.X_WT.p);
    EXPECT_EQ(lane.back.X_WT, lane.writer.find(lane.back.number)->X_WT);
  }
  PoseMessage edge;
  edge.X_WT.p.x = kGridHalf * lane.writer.grid().step_m();
  ASSERT_EQ(lane.carry(edge), Fault::kNone);
  EXPECT_EQ(lane.size, kPoseMessageBytes);
  EXPECT_EQ(lane.back.X_WT.p, edge.X_WT.p);
  edge.X_WT.p.x += 0.6 * lane.writer.grid().step_m();
  ASSERT_EQ(lane.carry(edge), Fault::kNone);
  EXPECT_EQ(lane.size, kPoseMessageBytes + 15);
}

TEST(PoseMessage, CarriesWishesAndTheLine) {
  using teleoperation::Controller;
  Lane lane;
  PoseMessage m;
  m.wants_curvature = true;
  m.ahead_us = 2500;
  ASSERT_EQ(lane.carry(m), Fault::kNone);
  EXPECT_EQ(lane.size, kPoseMessageBytes + kAheadBytes);
  EXPECT_TRUE(lane.back.wants_curvature);
  EXPECT_EQ(lane.back.ahead_us, 2500u);
  for (const Controller controller : {Controller::kWaves, Controller::kPassivity}) {
    m.line.by = controller;
    m.line.value << 1, 2, 3, 4, 5, 6e5;
    m.line.energy_in_J = 7;
    ASSERT_EQ(lane.carry(m), Fault::kNone);
    EXPECT_EQ(lane.size, kPoseMessageBytes + kAheadBytes + kLineValueBytes);
    EXPECT_EQ(lane.back.line.by, controller);
    EXPECT_EQ(lane.back.line.value, m.line.value);
    EXPECT_EQ(lane.back.line.energy_in_J, 7);
  }
  m.line.by = Controller::kDirect;
  m.ahead_us = 4'000'000'000;
  ASSERT_EQ(lane.carry(m), Fault::kNone);
  EXPECT_EQ(lane.back.line.by, Controller::kOurs);
  EXPECT_EQ(lane.back.ahead_us, kMostAhead_us);
}

TEST(PoseMessage, ExtremesAreClampedOrRefused) {
  Lane lane;
  PoseMessage m;
  m.time_us = std::numeric_limits<std::int64_t>::max();
  m.felt_To_W = spatial::Wrench{{1e300, 0, 0}, {0, -1e6, 0}};
  ASSERT_EQ(lane.carry(m), Fault::kNone);
  EXPECT_EQ(lane.back.time_us, static_cast<std::int64_t>(kMaxSceneTime_us));
  EXPECT_EQ(lane.back.felt_To_W->torque_Nm.x, kMostHalf);
  EXPECT_EQ(lane.back.felt_To_W->force_N.y, -kMostHalf);
  m.time_us = -5;
  ASSERT_EQ(lane.carry(m), Fault::kNone);
  EXPECT_EQ(lane.back.time_us, 0);
  const PoseMessage good = lane.back;
  const auto refused = [&](auto spoil) {
    PoseMessage bad;
    spoil(bad);
    const Fault fault = lane.carry(bad);
    EXPECT_EQ(lane.back.number, good.number) << "left as it was";
    return fault;
  };
  EXPECT_EQ(refused([](PoseMessage& b) { b.X_WT.p.x = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](PoseMessage& b) { b.X_WT.p.x = 1.1e4; }), Fault::kRange);
  EXPECT_EQ(refused([](PoseMessage& b) { b.X_WT.R.w = kNaN; }), Fault::kRange);
  EXPECT_EQ(refused([](PoseMessage& b) { b.V_WT_W.linear_m_s.z = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](PoseMessage& b) { b.V_WT_W.linear_m_s.z = 1.1e4; }), Fault::kRange);
}

TEST(PoseMessage, OtherLengthsAndUnknownFlagsAreRefused) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    Lane lane;
    PoseMessage m = random_pose(random);
    if (i % 3 == 1) m.X_WT.p.x = 500;
    if (i % 3 == 2) m.line.by = teleoperation::Controller::kWaves;
    ASSERT_EQ(lane.carry(m), Fault::kNone);
    PoseMessage out;
    for (std::size_t size = 0; size < lane.size; ++size)
      EXPECT_EQ(read(std::span(lane.buffer).first(size), lane.writer.grid(), out), Fault::kLength);
    EXPECT_EQ(read(std::span(lane.buffer).first(lane.size + 1), lane.writer.grid(), out), Fault::kLength);
    for (const unsigned bit : {0x40u, 0x80u}) {
      Buffer other = lane.buffer;
      other[0] ^= static_cast<std::byte>(bit);
      EXPECT_NE(read(std::span(other).first(lane.size), lane.writer.grid(), out), Fault::kNone);
    }
    Buffer small;
    const std::uint32_t before = lane.back.number;
    EXPECT_EQ(lane.writer.write(m, std::span(small).first(lane.size - 1)), 0u);
    ASSERT_EQ(lane.carry(m), Fault::kNone);
    EXPECT_EQ(lane.back.number, before + 1) << "what did not fit has no number";
  }
}

TEST(PoseWriter, RemembersTheNewestAndOfThisSessionAlone) {
  Lane lane;
  for (std::uint32_t i = 1; i <= 3 * kPosesRemembered; ++i) {
    PoseMessage m;
    m.sequence = 7 * i;
    ASSERT_EQ(lane.carry(m), Fault::kNone);
    ASSERT_EQ(lane.writer.find(i)->sequence, 7 * i);
    EXPECT_FALSE(lane.writer.find(i + 1));
    EXPECT_EQ(lane.writer.find(i - kPosesRemembered), nullptr);
    if (i > kPosesRemembered) {
      ASSERT_TRUE(lane.writer.find(i - kPosesRemembered + 1));
    }
  }
  EXPECT_FALSE(lane.writer.find(0));
  lane.writer.reset({});
  EXPECT_FALSE(lane.writer.find(3 * kPosesRemembered));
  ASSERT_EQ(lane.carry({}), Fault::kNone);
  EXPECT_EQ(lane.back.number, 3 * kPosesRemembered + 1);
}

}  // namespace
}  // namespace farfeel::codecs
