#include "codecs/wire/answer_message.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "codecs/wire/quantised.h"
#include "tests/unit/codecs/wire/random_touch.h"

namespace farfeel::codecs {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Buffer = std::array<std::byte, 4096>;

/// Both ends, with nothing between them.
struct Lane {
  Lane() {
    sent.reset(grid);
    writer.reset(grid);
  }
  /// Sends a pose and takes it over, with what was heard.
  const SentPose& pose(const PoseMessage& m) {
    PoseMessage message = m;
    message.heard = reader.heard(sent);
    std::array<std::byte, 256> bytes;
    const std::size_t length = sent.write(message, bytes);
    EXPECT_EQ(read(std::span(bytes).first(length), grid, asked), Fault::kNone);
    if (hears) writer.acknowledge(asked.heard);
    return *sent.find(asked.number);
  }
  Fault answer(AnswerMessage m, std::size_t most = 1199) {
    m.set.pose_sequence = asked.number;
    size = writer.write(m, asked.X_WT, std::span(buffer).first(most));
    return reader.read(std::span(buffer).first(size), sent, back);
  }
  Fault answer(const contact::ContactSet& set, std::size_t most = 1199) {
    AnswerMessage m;
    m.set = set;
    return answer(m, most);
  }
  PoseGrid grid;
  PoseWriter sent;
  AnswerWriter writer;
  AnswerReader reader;
  PoseMessage asked;
  bool hears = true;
  Buffer buffer{};
  std::size_t size = 0;
  AnswerMessage back;
};

void expect_close(const contact::Contact& a, const contact::Contact& b, double step_m) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.object, b.object);
  EXPECT_EQ(a.doubts, b.doubts);
  EXPECT_LE(glm::distance(a.p_WC_W, b.p_WC_W), 0.9 * step_m);
  EXPECT_EQ(static_cast<float>(a.depth_m), static_cast<float>(b.depth_m));
  EXPECT_LE(glm::distance(a.nhat_ST_W, b.nhat_ST_W), 3e-7);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a.gradient[i], b.gradient[i], 1e-4) << "0.1 m of arm, slopes of 0.5";
  for (int i = 3; i < 6; ++i) EXPECT_NEAR(a.gradient[i], b.gradient[i], 4.9e-4 * 0.5);
  EXPECT_NEAR(a.lateral_range_m, b.lateral_range_m, 1.53e-5 * a.lateral_range_m);
  EXPECT_EQ(static_cast<float>(a.material.stiffness_N_per_m), static_cast<float>(b.material.stiffness_N_per_m));
  EXPECT_EQ(static_cast<float>(a.material.damping_Ns_per_m), static_cast<float>(b.material.damping_Ns_per_m));
  EXPECT_EQ(static_cast<float>(a.material.static_friction), static_cast<float>(b.material.static_friction));
  EXPECT_EQ(static_cast<float>(a.material.dynamic_friction), static_cast<float>(b.material.dynamic_friction));
}

TEST(AnswerMessage, ComesBackToWithinItsSteps) {
  Random random(1);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    Lane lane;
    const std::uint32_t count = i % 20;
    PoseMessage pose = random_pose(random);
    const SentPose& sent = lane.pose(pose);
    AnswerMessage m;
    m.set = random_set(random, lane.asked.X_WT, count);
    m.times = {random.number(), random.number(), 77};
    ASSERT_EQ(lane.answer(m), Fault::kNone);
    ASSERT_EQ(lane.size, kAnswerBlockBytes + count * (kContactBytes + kIdentityBytes));
    const contact::ContactSet& back = lane.back.set;
    EXPECT_EQ(back.pose_sequence, pose.sequence);
    EXPECT_EQ(back.pose_time_ns, 1000 * pose.time_us);
    EXPECT_EQ(back.X_WT, sent.X_WT);
    EXPECT_EQ(back.pairs_near, m.set.pairs_near);
    EXPECT_EQ(lane.back.times, m.times);
    EXPECT_EQ(lane.back.left_out, 0);
    EXPECT_FALSE(lane.back.line);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(back.F_To_W.force_N[k], m.set.F_To_W.force_N[k], 4.9e-4 * 30);
    ASSERT_EQ(back.count, count);
    for (std::uint32_t k = 0; k < count; ++k) expect_close(m.set.contacts[k], back.contacts[k], lane.grid.step_m());
  }
}

TEST(AnswerMessage, FitsTheBudgetOnceItsContactsAreKnown) {
  // All of IPv4 and UDP 28, the seal 32, the message's type 1: 3 Mbit/s at 1 kHz are 375 bytes.
  constexpr std::size_t kHeaders = 28 + 32 + 1;
  Random random(2);
  for (std::uint32_t count = 0; count <= 11; ++count) {
    Lane lane;
    const contact::ContactSet set = random_set(random, {}, count);
    for (int round = 0; round < 3; ++round) {
      lane.pose({});
      ASSERT_EQ(lane.answer(set), Fault::kNone);
      const std::size_t identities = round == 0 ? count * kIdentityBytes : 0;
      EXPECT_EQ(lane.size, 35 + 36 * count + identities);
    }
    EXPECT_LE(kHeaders + lane.size, 492u);
    if (count <= 7) {
      EXPECT_LE(kHeaders + 20 + lane.size, 375u) << "with IPv6's headers, too";
    }
  }
}

TEST(AnswerMessage, MostContactsFitOnceTheyAreKnownAndTheDeepestUntilThen) {
  Random random(3);
  Lane lane;
  lane.pose({});
  contact::ContactSet set = random_set(random, {}, contact::kMaxContacts);
  ASSERT_EQ(lane.answer(set), Fault::kNone);
  const std::uint32_t first = lane.back.set.count;
  EXPECT_EQ(first, (1199 - 35) / 61u);
  EXPECT_EQ(lane.back.left_out, contact::kMaxContacts - first);
  double least_m = 1, most_m = -1;
  std::uint32_t k = 0;
  for (const contact::Contact& c : set.contacts) {
    const bool went = k < first && lane.back.set.contacts[k].id == c.id;
    if (went) {
      least_m = std::min(least_m, c.depth_m);
      ++k;
    } else {
      most_m = std::max(most_m, c.depth_m);
    }
  }
  EXPECT_EQ(k, first) << "in the set's order";
  EXPECT_GE(least_m, most_m);
  for (int round = 0; round < 6; ++round) {
    lane.pose({});
    ASSERT_EQ(lane.answer(set), Fault::kNone);
  }
  EXPECT_EQ(lane.back.set.count, 31u) << "of 32, as the last one's identity is 25 bytes more";
  EXPECT_EQ(lane.size, 35u + 31 * 36);
  EXPECT_EQ(lane.writer.write({}, {}, std::span(lane.buffer).first(34)), 0u);
}

TEST(AnswerMessage, TellsOtherPosesAndFarPointsInFull) {
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    Lane lane;
    lane.pose(random_pose(random));
    // Where it leads, told on the grid; as the slave does, which computes there.
    const spatial::Pose ahead = on_grid(random.pose(), lane.grid);
    contact::ContactSet set = random_set(random, ahead, 3);
    ASSERT_EQ(lane.answer(set), Fault::kNone);
    // A rotation may have two codes, where two components are nearly alike: then it is told in full.
    EXPECT_TRUE(lane.size == 35 + 17 + 3 * 61 || lane.size == 35 + 56 + 3 * 61);
    EXPECT_EQ(lane.back.set.X_WT, ahead);
    set = random_set(random, random.pose(3000), 3);
    ASSERT_EQ(lane.answer(set), Fault::kNone);
    EXPECT_EQ(lane.size, 35u + 56 + 3 * 61);
    EXPECT_EQ(lane.back.set.X_WT, set.X_WT) << "as it was computed";
    for (std::uint32_t k = 0; k < 3; ++k) expect_close(set.contacts[k], lane.back.set.contacts[k], lane.grid.step_m());
    set.contacts[1].p_WC_W += glm::dvec3(100, 0, 0);
    ASSERT_EQ(lane.answer(set), Fault::kNone);
    EXPECT_EQ(lane.size, 35u + 56 + 3 * (61 + 15));
    for (std::uint32_t k = 0; k < 3; ++k)
      EXPECT_LE(glm::distance(set.contacts[k].p_WC_W, lane.back.set.contacts[k].p_WC_W), 1e-11);
  }
}

TEST(AnswerMessage, CarriesCurvaturesAndTheLine) {
  Random random(5);
  Lane lane;
  lane.pose({});
  AnswerMessage m;
  m.set = random_set(random, {}, 4);
  spatial::Matrix6 hessian = spatial::Matrix6::Zero();
  for (int i = 0, k = 1; i < 6; ++i)
    for (int j = i; j < 6; ++j, ++k) hessian(i, j) = hessian(j, i) = k;
  m.set.contacts[2].curvature = contact::Curvature::of(hessian);
  m.line.emplace();
  m.line->value << 1, 2, 3, 4, 5, 6;
  m.line->energy_in_J = 7;
  ASSERT_EQ(lane.answer(m), Fault::kNone);
  EXPECT_EQ(lane.size, 35u + 56 + 4 * (61 + 63));
  EXPECT_EQ(lane.back.set.contacts[2].curvature.matrix(), hessian);
  EXPECT_FALSE(lane.back.set.contacts[1].curvature.is_known);
  ASSERT_TRUE(lane.back.line);
  EXPECT_EQ(lane.back.line->value, m.line->value);
  m.set.contacts[2].curvature = {};
  m.line.reset();
  ASSERT_EQ(lane.answer(m), Fault::kNone);
  EXPECT_FALSE(lane.back.set.contacts[2].curvature.is_known) << "nothing of the answer before";
  EXPECT_FALSE(lane.back.line);
}

TEST(AnswerMessage, AShareOfAMaterialIsTwoBytesAndBecomesItsOwnWhenItStands) {
  Random random(6);
  Lane lane;
  contact::ContactSet set = random_set(random, {}, 1);
  contact::Contact& c = set.contacts[0];
  const contact::Material whole = c.material = {2000, 0.5, 0.3, 0.25};
  const auto tell = [&](double share) {
    c.material.stiffness_N_per_m = share * whole.stiffness_N_per_m;
    c.material.damping_Ns_per_m = share * whole.damping_Ns_per_m;
    lane.pose({});
    EXPECT_EQ(lane.answer(set), Fault::kNone);
    const contact::Material& back = lane.back.set.contacts[0].material;
    EXPECT_NEAR(back.stiffness_N_per_m, c.material.stiffness_N_per_m, 4.9e-4 * c.material.stiffness_N_per_m);
    EXPECT_NEAR(back.damping_Ns_per_m, c.material.damping_Ns_per_m, 1.5e-3 * c.material.damping_Ns_per_m);
    return lane.size;
  };
  EXPECT_EQ(tell(0.02), 35u + 36 + 25);
  for (int i = 3; i <= 50; ++i) EXPECT_EQ(tell(0.02 * i), 35u + 36 + 2) << i;
  EXPECT_EQ(tell(1), 35u + 36 + 25) << "it stands";
  EXPECT_EQ(lane.back.set.contacts[0].material.stiffness_N_per_m, 2000);
  EXPECT_EQ(tell(1), 35u + 36);
  EXPECT_EQ(tell(1e-6), 35u + 36 + 25) << "a half has no digits for it";
  EXPECT_EQ(tell(0), 35u + 36 + 25);
  EXPECT_EQ(tell(0), 35u + 36);
  c.material.static_friction = 0.4;
  EXPECT_EQ(lane.answer(set), Fault::kNone);
  EXPECT_EQ(lane.size, 35u + 36 + 25);
  EXPECT_EQ(static_cast<float>(lane.back.set.contacts[0].material.static_friction), 0.4f);
}

TEST(AnswerMessage, TellsWhatIsLikeAnotherPlaceByThatPlace) {
  Random random(8);
  Lane lane;
  contact::ContactSet set = random_set(random, {}, 7);
  for (contact::Contact& c : set.contacts) {
    c.object = 3;
    c.material = {2000, 0.5, 0.3, 0.25};
  }
  const auto tell = [&] {
    lane.pose({});
    EXPECT_EQ(lane.answer(set), Fault::kNone);
    EXPECT_EQ(lane.back.set.count, set.count);
    for (std::uint32_t i = 0; i < lane.back.set.count; ++i) {
      EXPECT_EQ(lane.back.set.contacts[i].id, set.contacts[i].id);
      EXPECT_EQ(lane.back.set.contacts[i].object, set.contacts[i].object);
      EXPECT_EQ(static_cast<float>(lane.back.set.contacts[i].material.stiffness_N_per_m),
                static_cast<float>(set.contacts[i].material.stiffness_N_per_m));
    }
    return lane.size - 35 - 36 * set.count;
  };
  EXPECT_EQ(tell(), 25u + 6 * 5) << "all new: the first in full";
  EXPECT_EQ(tell(), 0u);
  for (contact::Contact& c : set.contacts) c.id = random.number();
  EXPECT_EQ(tell(), 7u * 5) << "all like one that is acknowledged";
  set.contacts[6].id = random.number();
  set.contacts[6].material.stiffness_N_per_m = 1000;
  set.contacts[6].material.damping_Ns_per_m = 0.25;
  EXPECT_EQ(tell(), 5u + 2) << "new, and half as stiff";
  EXPECT_EQ(tell(), 25u) << "it stands";
  set.contacts[0].id = random.number();
  set.contacts[0].object = 4;
  EXPECT_EQ(tell(), 25u) << "of another object";
  // A place that gets another identity is no model for what is told after it in the same answer.
  set.count = 1;
  tell();
  set.contacts[0].material.static_friction = 0.5;
  set.contacts[1] = set.contacts[0];
  set.contacts[1].id = random.number();
  set.contacts[1].material.static_friction = 0.3;
  set.count = 2;
  EXPECT_EQ(tell(), 25u + 25);
}

TEST(AnswerMessage, RefusesALikenessToAnEmptyPlace) {
  Random random(9);
  Lane lane;
  const contact::ContactSet set = random_set(random, {}, 1);
  lane.pose({});
  ASSERT_EQ(lane.answer(set), Fault::kNone);
  AnswerReader fresh;
  AnswerMessage back;
  auto like = [&](unsigned place) {
    std::vector<std::byte> bytes(lane.buffer.begin(), lane.buffer.begin() + 35 + 36 + 5);
    bytes[35 + 36] = static_cast<std::byte>(place);
    return fresh.read(bytes, lane.sent, back);
  };
  EXPECT_EQ(like(0), Fault::kNoBase) << "itself";
  EXPECT_EQ(like(63), Fault::kNoBase);
  EXPECT_NE(like(64), Fault::kNone);
  EXPECT_NE(like(254), Fault::kNone);
}

TEST(AnswerMessage, TwoContactsOfOneIdAreTwo) {
  Random random(7);
  Lane lane;
  contact::ContactSet set = random_set(random, {}, 2);
  set.contacts[1].id = set.contacts[0].id;
  set.contacts[1].object = set.contacts[0].object;
  set.contacts[1].material = set.contacts[0].material;
  for (int round = 0; round < 3; ++round) {
    lane.pose({});
    ASSERT_EQ(lane.answer(set), Fault::kNone);
    ASSERT_EQ(lane.back.set.count, 2u);
    EXPECT_GT(glm::distance(lane.back.set.contacts[0].p_WC_W, lane.back.set.contacts[1].p_WC_W), 1e-4);
  }
  EXPECT_EQ(lane.size, 35u + 72);
}

TEST(AnswerMessage, WhatIsNotFiniteOrAbsurdIsRefusedAndChangesNothing) {
  Random random(8);
  const auto refused = [&](auto spoil) {
    Lane lane;
    lane.pose({});
    EXPECT_EQ(lane.answer(random_set(random, {}, 2)), Fault::kNone);
    const AnswerMessage before = lane.back;
    AnswerMessage bad;
    bad.set = random_set(random, {}, 3);
    spoil(bad.set.contacts[1], bad.set);
    lane.pose({});
    const Fault fault = lane.answer(bad);
    EXPECT_EQ(lane.back.number, before.number);
    EXPECT_EQ(lane.back.set.count, 2u);
    lane.pose({});
    EXPECT_EQ(*lane.asked.heard, before.number);
    EXPECT_EQ(lane.answer(random_set(random, {}, 3)), Fault::kNone);
    return fault;
  };
  using contact::Contact;
  using contact::ContactSet;
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.depth_m = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.depth_m = 1e5; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.p_WC_W.y = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.p_WC_W.y = 2e4; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.nhat_ST_W = {kNaN, 0, 1}; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.nhat_ST_W = {0, 0, 0}; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.gradient[4] = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.gradient[4] = 2e4; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.gradient[1] = 1e9; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.lateral_range_m = -1; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.material.stiffness_N_per_m = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.material.stiffness_N_per_m = -1; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.material.damping_Ns_per_m = 1e7; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact& c, ContactSet&) { c.material.dynamic_friction = 101; }), Fault::kRange);
  EXPECT_EQ(refused([](Contact&, ContactSet& s) { s.F_To_W.force_N.x = kNaN; }), Fault::kNotFinite);
  EXPECT_EQ(refused([](Contact&, ContactSet& s) { s.X_WT.p.x = kNaN; }), Fault::kNotFinite);
}

TEST(AnswerMessage, OtherLengthsUnknownFlagsAndUnknownPosesAreRefused) {
  Random random(9);
  Lane lane;
  lane.hears = false;
  lane.pose({});
  ASSERT_EQ(lane.answer(random_set(random, {}, 3)), Fault::kNone);
  AnswerMessage m;
  m.set = random_set(random, {}, 3);
  m.set.pose_sequence = lane.asked.number;
  const std::size_t size = lane.writer.write(m, lane.asked.X_WT, lane.buffer);
  const auto whole = std::span(lane.buffer).first(size);
  AnswerMessage out;
  for (std::size_t n = 0; n < size; ++n)
    EXPECT_EQ(lane.reader.read(whole.first(n), lane.sent, out), Fault::kLength) << n;
  EXPECT_EQ(lane.reader.read(std::span(lane.buffer).first(size + 1), lane.sent, out), Fault::kLength);
  for (const unsigned bit : {0x20u, 0x40u, 0x80u, 3u}) {
    Buffer other = lane.buffer;
    other[0] |= static_cast<std::byte>(bit);
    EXPECT_EQ(lane.reader.read(std::span(other).first(size), lane.sent, out), Fault::kRange) << bit;
  }
  Buffer twice = lane.buffer;  // the second contact at the first one's place
  twice[35 + 60] = twice[35];
  EXPECT_EQ(lane.reader.read(std::span(twice).first(size), lane.sent, out), Fault::kRange);
  m.set.pose_sequence = lane.asked.number + 1;
  Buffer unsent;
  const std::size_t length = lane.writer.write(m, lane.asked.X_WT, unsent);
  EXPECT_EQ(lane.reader.read(std::span(unsent).first(length), lane.sent, out), Fault::kNoBase);
  EXPECT_EQ(lane.reader.read(whole, lane.sent, out), Fault::kNone) << "none of it did harm";
  EXPECT_EQ(lane.reader.read(whole, lane.sent, out), Fault::kOld) << "twice";
}

}  // namespace
}  // namespace farfeel::codecs
