#include "codecs/wire/haptic_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "codecs/wire/slave_status.h"

namespace farfeel::codecs {
namespace {

using Buffer = std::array<std::byte, kMaxHapticPayloadBytes>;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double real(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  std::uint32_t number() { return static_cast<std::uint32_t>(engine_()); }
  glm::dvec3 vector(double size) { return glm::dvec3{real(-size, size), real(-size, size), real(-size, size)}; }
  glm::dvec3 unit() { return glm::normalize(vector(1) + glm::dvec3(0, 0, 1e-3)); }
  spatial::Pose pose() {
    return {glm::normalize(glm::dquat(real(-1, 1), real(-1, 1), real(-1, 1), real(-1, 1))), vector(2)};
  }

 private:
  std::mt19937_64 engine_;
};

PoseSample random_sample(Random& random, bool with_line = false) {
  PoseSample sample;
  sample.sequence = random.number();
  sample.time_ns = random.number();
  sample.X_WT = random.pose();
  sample.V_WT_W = {random.vector(10), random.vector(1)};
  sample.times = {random.number(), random.number(), random.number()};
  sample.wants_curvature = random.number() % 2 == 0;
  sample.ahead_us = random.number() % (kMostAhead_us + 1);
  if (with_line) {
    sample.controller =
        random.number() % 2 == 0 ? teleoperation::Controller::kWaves : teleoperation::Controller::kPassivity;
    for (int i = 0; i < 6; ++i) sample.line.value[i] = random.real(-10, 10);
    sample.line.energy_in_J = random.real(0, 5);
  }
  return sample;
}

contact::Contact random_contact(Random& random) {
  contact::Contact c;
  c.id = random.number();
  c.object = random.number();
  c.p_WC_W = random.vector(2);
  c.nhat_ST_W = random.unit();
  c.depth_m = random.real(-5e-3, 5e-3);
  for (int i = 0; i < 6; ++i) c.gradient[i] = random.real(-1, 1);
  c.lateral_range_m = random.real(0, 1e-2);
  c.doubts = static_cast<std::uint8_t>(random.number() & contact::kAllDoubts);
  c.material = {random.real(0, 5000), random.real(0, 5), random.real(0, 1), random.real(0, 1)};
  return c;
}

ContactAnswer random_answer(Random& random, std::uint32_t count) {
  ContactAnswer answer;
  answer.times = {random.number(), random.number(), random.number()};
  answer.set.pose_sequence = random.number();
  answer.set.pose_time_ns = random.number();
  answer.set.X_WT = random.pose();
  answer.set.F_To_W = {random.vector(1), random.vector(30)};
  answer.set.pairs_near = random.number() % 1000;
  answer.set.count = count;
  for (std::uint32_t i = 0; i < count; ++i) answer.set.contacts[i] = random_contact(random);
  return answer;
}

/// What single precision keeps.
void expect_close(const contact::Contact& a, const contact::Contact& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.object, b.object);
  EXPECT_EQ(a.doubts, b.doubts);
  EXPECT_EQ(a.p_WC_W, b.p_WC_W);
  EXPECT_NEAR(a.depth_m, b.depth_m, 1e-9);
  EXPECT_LT(glm::length(a.nhat_ST_W - b.nhat_ST_W), 2e-7);
  EXPECT_NEAR(glm::length(b.nhat_ST_W), 1, 1e-15);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(a.gradient[i], b.gradient[i], 1e-7);
  EXPECT_NEAR(a.lateral_range_m, b.lateral_range_m, 1e-9);
  EXPECT_NEAR(a.material.stiffness_N_per_m, b.material.stiffness_N_per_m, 1e-3);
  EXPECT_NEAR(a.material.damping_Ns_per_m, b.material.damping_Ns_per_m, 1e-6);
  EXPECT_NEAR(a.material.static_friction, b.material.static_friction, 1e-7);
  EXPECT_NEAR(a.material.dynamic_friction, b.material.dynamic_friction, 1e-7);
}

TEST(PoseSample, ComesBackExactlyButForTheTwistsRounding) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const PoseSample sample = random_sample(random, i % 2 == 0);
    Buffer buffer;
    const std::size_t size = write(sample, buffer);
    ASSERT_EQ(size, kPoseSampleBytes + (i % 2 == 0 ? kLineBytes : 0));
    PoseSample back;
    ASSERT_EQ(read(std::span(buffer).first(size), back), Fault::kNone);
    EXPECT_EQ(back.sequence, sample.sequence);
    EXPECT_EQ(back.time_ns, sample.time_ns);
    EXPECT_EQ(back.X_WT, sample.X_WT);
    EXPECT_LT(glm::length(back.V_WT_W.angular_rad_s - sample.V_WT_W.angular_rad_s), 1e-5);
    EXPECT_LT(glm::length(back.V_WT_W.linear_m_s - sample.V_WT_W.linear_m_s), 1e-6);
    EXPECT_EQ(back.times.t_send_ns, sample.times.t_send_ns);
    EXPECT_EQ(back.times.t_echo_ns, sample.times.t_echo_ns);
    EXPECT_EQ(back.times.hold_us, sample.times.hold_us);
    EXPECT_EQ(back.wants_curvature, sample.wants_curvature);
    EXPECT_EQ(back.ahead_us, sample.ahead_us);
    EXPECT_EQ(back.controller, sample.controller);
    EXPECT_EQ(back.line.value, sample.line.value);
    EXPECT_EQ(back.line.energy_in_J, sample.line.energy_in_J);
    // What was written, read and written again is the same to the byte.
    Buffer again;
    ASSERT_EQ(write(back, again), size);
    EXPECT_EQ(std::memcmp(buffer.data(), again.data(), size), 0);
  }
}

TEST(ContactAnswer, ComesBackWithEveryCountThatFits) {
  Random random(2);
  for (std::uint32_t count = 0; count <= kMaxContactsPerDatagram; ++count) {
    const ContactAnswer answer = random_answer(random, count);
    Buffer buffer;
    const std::size_t size = write(answer, buffer);
    ASSERT_EQ(size, kContactBlockBytes + count * kContactRecordBytes);
    ContactAnswer back;
    ASSERT_EQ(read(std::span(buffer).first(size), back), Fault::kNone);
    EXPECT_EQ(back.set.pose_sequence, answer.set.pose_sequence);
    EXPECT_EQ(back.set.pose_time_ns, answer.set.pose_time_ns);
    EXPECT_EQ(back.set.X_WT, answer.set.X_WT);
    EXPECT_EQ(back.set.pairs_near, answer.set.pairs_near);
    EXPECT_LT(glm::length(back.set.F_To_W.force_N - answer.set.F_To_W.force_N), 1e-5);
    EXPECT_LT(glm::length(back.set.F_To_W.torque_Nm - answer.set.F_To_W.torque_Nm), 1e-6);
    EXPECT_EQ(back.left_out, 0);
    ASSERT_EQ(back.set.count, count);
    for (std::uint32_t i = 0; i < count; ++i) expect_close(answer.set.contacts[i], back.set.contacts[i]);
  }
}

TEST(ContactAnswer, CarriesALineWhereTheSlaveSimulatesTheTool) {
  Random random(12);
  for (std::uint32_t count : {0u, 3u, 32u}) {
    ContactAnswer answer = random_answer(random, count);
    answer.line.emplace();
    for (int i = 0; i < 6; ++i) answer.line->value[i] = random.real(-10, 10);
    answer.line->energy_in_J = 0.25;
    Buffer buffer;
    const std::size_t size = write(answer, buffer), sent = std::min<std::size_t>(count, 10);
    ASSERT_EQ(size, kContactBlockBytes + kLineBytes + sent * kContactRecordBytes);
    ASSERT_LE(size, kMaxHapticPayloadBytes);
    ContactAnswer back;
    ASSERT_EQ(read(std::span(buffer).first(size), back), Fault::kNone);
    ASSERT_TRUE(back.line);
    EXPECT_EQ(back.line->value, answer.line->value);
    EXPECT_EQ(back.line->energy_in_J, 0.25);
    EXPECT_EQ(back.set.count, sent);
    answer.line->value[2] = NAN;
    EXPECT_EQ(read(std::span(buffer).first(write(answer, buffer)), back), Fault::kNotFinite);
  }
}

TEST(ContactAnswer, OfSevenContactsFitsWithRoomToGrow) {
  static_assert(kMaxContactsPerDatagram >= 7);
  static_assert(kContactBlockBytes + 7 * (kContactRecordBytes + 40) <= kMaxHapticPayloadBytes);
}

TEST(ContactAnswer, KeepsTheDeepestWhenTheyDoNotAllFit) {
  Random random(3);
  for (int run = 0; run < 200; ++run) {
    const std::uint32_t count = static_cast<std::uint32_t>(kMaxContactsPerDatagram) + 1 + random.number() % 20;
    const ContactAnswer answer = random_answer(random, count);
    Buffer buffer;
    const std::size_t size = write(answer, buffer);
    ASSERT_LE(size, kMaxHapticPayloadBytes);
    ContactAnswer back;
    ASSERT_EQ(read(std::span(buffer).first(size), back), Fault::kNone);
    ASSERT_EQ(back.set.count, kMaxContactsPerDatagram);
    EXPECT_EQ(back.left_out, count - kMaxContactsPerDatagram);
    // The obvious way: sort by depth; and what is kept stays in the order of the set.
    std::vector<double> depths;
    for (std::uint32_t i = 0; i < count; ++i) depths.push_back(answer.set.contacts[i].depth_m);
    std::sort(depths.rbegin(), depths.rend());
    std::uint32_t at = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (answer.set.contacts[i].depth_m < depths[kMaxContactsPerDatagram - 1]) continue;
      expect_close(answer.set.contacts[i], back.set.contacts[at++]);
    }
    EXPECT_EQ(at, kMaxContactsPerDatagram);
  }
}

TEST(ContactAnswer, CarriesCurvaturesWhereThereAreAnyAndThenFewerContacts) {
  Random random(11);
  for (std::uint32_t count = 1; count <= contact::kMaxContacts; ++count) {
    ContactAnswer answer = random_answer(random, count);
    for (std::uint32_t i = 0; i < count; ++i) {
      spatial::Matrix6 half;
      for (int k = 0; k < 36; ++k) half(k / 6, k % 6) = random.real(-1e3, 1e3);
      answer.set.contacts[i].depth_m = -1e-4 * i;
      if (i % 3 != 1) answer.set.contacts[i].curvature = contact::Curvature::of(half + half.transpose());
    }
    Buffer buffer;
    const std::size_t size = write(answer, buffer), sent = std::min<std::size_t>(count, 7);
    ASSERT_EQ(contacts_that_fit(answer), sent);
    ASSERT_EQ(size, kContactBlockBytes + sent * (kContactRecordBytes + kCurvatureBytes));
    ContactAnswer back;
    ASSERT_EQ(read(std::span(buffer).first(size), back), Fault::kNone);
    ASSERT_EQ(back.set.count, sent);
    EXPECT_EQ(back.left_out, count - sent);
    for (std::uint32_t i = 0; i < sent; ++i) {
      const contact::Curvature &there = answer.set.contacts[i].curvature, &here = back.set.contacts[i].curvature;
      ASSERT_EQ(here.is_known, there.is_known);
      const double error = (here.matrix() - there.matrix()).cwiseAbs().maxCoeff();
      EXPECT_LE(error, there.matrix().cwiseAbs().maxCoeff() / 256);
    }
    Buffer again;
    ASSERT_EQ(write(back, again), size);
    answer = back;
    for (std::uint32_t i = 0; i < sent; ++i) answer.set.contacts[i].curvature.upper[3] = NAN;
    EXPECT_EQ(read(std::span(buffer).first(write(answer, buffer)), back), Fault::kNotFinite);
  }
}

// A later version appends fields to the block and to the records; this one reads what it knows.
TEST(ContactAnswer, IsReadWithLongerBlocksAndRecords) {
  Random random(4);
  const ContactAnswer answer = random_answer(random, 3);
  Buffer plain;
  const std::size_t size = write(answer, plain);
  constexpr std::size_t kMoreBlock = 12, kMoreRecord = 8;
  std::vector<std::byte> grown(plain.begin(), plain.begin() + kContactBlockBytes);
  grown.resize(grown.size() + kMoreBlock, std::byte{0xEE});
  for (std::size_t at = kContactBlockBytes; at < size; at += kContactRecordBytes) {
    grown.insert(grown.end(), plain.begin() + static_cast<std::ptrdiff_t>(at),
                 plain.begin() + static_cast<std::ptrdiff_t>(at + kContactRecordBytes));
    grown.resize(grown.size() + kMoreRecord, std::byte{0xEE});
  }
  grown[0] = static_cast<std::byte>(kContactBlockBytes + kMoreBlock);
  grown[2] = static_cast<std::byte>(kContactRecordBytes + kMoreRecord);
  ContactAnswer back;
  ASSERT_EQ(read(grown, back), Fault::kNone);
  for (std::uint32_t i = 0; i < 3; ++i) expect_close(answer.set.contacts[i], back.set.contacts[i]);
  grown[2] = static_cast<std::byte>(kContactRecordBytes - 1);
  EXPECT_EQ(read(grown, back), Fault::kLength);
}

TEST(ContactAnswer, IsWrittenFromNotANumberAndRefusedByTheReader) {
  Random random(5);
  ContactAnswer answer = random_answer(random, contact::kMaxContacts);
  for (auto& c : answer.set.contacts) c.depth_m = std::numeric_limits<double>::quiet_NaN();
  Buffer buffer;
  const std::size_t size = write(answer, buffer);
  ContactAnswer back;
  EXPECT_EQ(read(std::span(buffer).first(size), back), Fault::kNotFinite);
  EXPECT_EQ(back.set.count, 0u);  // untouched
}

template <typename T>
void expect_only_the_exact_length(std::span<const std::byte> good) {
  T out;
  for (std::size_t n = 0; n < good.size(); ++n) EXPECT_NE(read(good.first(n), out), Fault::kNone) << n;
  std::vector<std::byte> longer(good.begin(), good.end());
  longer.push_back({});
  EXPECT_NE(read(longer, out), Fault::kNone);
}

TEST(HapticMessages, AreReadAtTheirExactLengthOnly) {
  Random random(6);
  Buffer buffer;
  std::size_t size = write(random_sample(random), buffer);
  expect_only_the_exact_length<PoseSample>(std::span(buffer).first(size));
  size = write(random_sample(random, true), buffer);
  for (std::size_t n = 0; n < size; ++n) {
    PoseSample out;
    EXPECT_NE(read(std::span(buffer).first(n), out), Fault::kNone) << n;
  }
  size = write(random_answer(random, 5), buffer);
  expect_only_the_exact_length<ContactAnswer>(std::span(buffer).first(size));
}

TEST(HapticMessages, AreNotWrittenInTooLittleRoom) {
  Random random(7);
  Buffer buffer;
  const PoseSample sample = random_sample(random);
  for (std::size_t n = 0; n < kPoseSampleBytes; ++n) EXPECT_EQ(write(sample, std::span(buffer).first(n)), 0u);
  EXPECT_EQ(write(random_answer(random, 2), std::span(buffer).first(kContactBlockBytes + 2 * kContactRecordBytes - 1)),
            0u);
}

TEST(HapticMessages, RefuseValuesThatNobodyMeans) {
  Random random(8);
  const double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  const auto fault_of_sample = [&](auto change) {
    PoseSample sample = random_sample(random);
    change(sample);
    Buffer buffer;
    PoseSample back;
    return read(std::span(buffer).first(write(sample, buffer)), back);
  };
  EXPECT_EQ(fault_of_sample([](PoseSample&) {}), Fault::kNone);
  EXPECT_EQ(fault_of_sample([&](PoseSample& s) { s.X_WT.p.y = kNan; }), Fault::kNotFinite);
  EXPECT_EQ(fault_of_sample([&](PoseSample& s) { s.X_WT.p.y = kInfinity; }), Fault::kNotFinite);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.X_WT.p.y = 1e5; }), Fault::kRange);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.X_WT.R *= 1.001; }), Fault::kRange);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.X_WT.R *= 0.0; }), Fault::kRange);
  EXPECT_EQ(fault_of_sample([&](PoseSample& s) { s.V_WT_W.angular_rad_s.x = kNan; }), Fault::kNotFinite);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.V_WT_W.linear_m_s.z = -1e5; }), Fault::kRange);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.V_WT_W.linear_m_s.z = 1e300; }), Fault::kNotFinite);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.times.t_send_ns = -1; }), Fault::kRange);
  EXPECT_EQ(fault_of_sample([](PoseSample& s) { s.time_ns = -1; }), Fault::kRange);

  Buffer buffer_of_two;
  const auto fault_of_contact = [&](auto change) {
    ContactAnswer answer = random_answer(random, 2);
    change(answer.set.contacts[1]);
    Buffer buffer;
    ContactAnswer back;
    return read(std::span(buffer).first(write(answer, buffer)), back);
  };
  EXPECT_EQ(fault_of_contact([](contact::Contact&) {}), Fault::kNone);
  EXPECT_EQ(fault_of_contact([&](contact::Contact& c) { c.p_WC_W.x = kNan; }), Fault::kNotFinite);
  EXPECT_EQ(fault_of_contact([](contact::Contact& c) { c.nhat_ST_W *= 1.001; }), Fault::kRange);
  EXPECT_EQ(fault_of_contact([](contact::Contact& c) { c.nhat_ST_W *= 0.0; }), Fault::kRange);
  EXPECT_EQ(fault_of_contact([&](contact::Contact& c) { c.gradient[5] = kInfinity; }), Fault::kNotFinite);
  EXPECT_EQ(fault_of_contact([](contact::Contact& c) { c.material.stiffness_N_per_m = -1; }), Fault::kRange);
  EXPECT_EQ(fault_of_contact([](contact::Contact& c) { c.material.damping_Ns_per_m = -1; }), Fault::kRange);
  EXPECT_EQ(fault_of_contact([](contact::Contact& c) { c.lateral_range_m = -1e-6; }), Fault::kRange);

  const std::size_t size = write(random_answer(random, 2), buffer_of_two);
  ContactAnswer kept;
  ASSERT_EQ(read(std::span(buffer_of_two).first(size), kept), Fault::kNone);
  buffer_of_two[size - 1] |= std::byte{1};
  EXPECT_EQ(read(std::span(buffer_of_two).first(size), kept), Fault::kRange) << "a doubt that is none";
}

// Whatever single bytes are changed to: no read outside, and what is accepted is finite and within range.
TEST(HapticMessages, WithAnyByteChangedAreRefusedOrStillSane) {
  Random random(9);
  Buffer buffer;
  ContactAnswer answer = random_answer(random, 3);
  answer.set.contacts[0].curvature = contact::Curvature::of(spatial::Matrix6::Identity());
  const std::size_t size = write(answer, buffer);
  for (std::size_t at = 0; at < size; ++at) {
    for (int value = 0; value < 256; ++value) {
      Buffer bent = buffer;
      bent[at] = static_cast<std::byte>(value);
      ContactAnswer back;
      if (read(std::span(bent).first(size), back) != Fault::kNone) continue;
      ASSERT_LE(back.set.count, contact::kMaxContacts);
      ASSERT_TRUE(spatial::is_valid(back.set.X_WT));
      ASSERT_TRUE(spatial::is_finite(back.set.F_To_W));
      for (std::uint32_t i = 0; i < back.set.count; ++i) {
        ASSERT_NEAR(glm::length(back.set.contacts[i].nhat_ST_W), 1, 1e-12);
        ASSERT_TRUE(back.set.contacts[i].gradient.allFinite());
        ASSERT_TRUE(back.set.contacts[i].curvature.matrix().allFinite());
        ASSERT_GE(back.set.contacts[i].material.stiffness_N_per_m, 0);
      }
    }
  }
}

TEST(SlaveStatus, ComesBackAndRefusesNonsense) {
  SlaveStatus status{512.5, 1000, 2000, 3000, 1, 2, 3, 4, 5, 6, 7};
  Buffer buffer;
  ASSERT_EQ(write(status, buffer), kSlaveStatusBytes);
  SlaveStatus back;
  ASSERT_EQ(read(std::span(buffer).first(kSlaveStatusBytes), back), Fault::kNone);
  EXPECT_EQ(back.contact_hz, 512.5);
  EXPECT_EQ(back.contact_us_max, 3000);
  EXPECT_EQ(back.poses_received, 1u);
  EXPECT_EQ(back.contacts_left_out, 7u);
  EXPECT_EQ(read(std::span(buffer).first(kSlaveStatusBytes - 1), back), Fault::kLength);
  status.contact_hz = -1;
  (void)write(status, buffer);
  EXPECT_EQ(read(std::span(buffer).first(kSlaveStatusBytes), back), Fault::kRange);
  status.contact_hz = std::numeric_limits<double>::quiet_NaN();
  (void)write(status, buffer);
  EXPECT_EQ(read(std::span(buffer).first(kSlaveStatusBytes), back), Fault::kNotFinite);
}

}  // namespace
}  // namespace farfeel::codecs
