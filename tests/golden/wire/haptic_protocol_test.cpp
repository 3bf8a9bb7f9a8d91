// The haptic lane's compact messages, put together from transport/PROTOCOL.md alone and compared with what
// the codecs write and read. Bytes that change here change the protocol.
#include <gtest/gtest.h>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "tests/golden/wire/table.h"

namespace farfeel {
namespace {

using codecs::Fault;

constexpr std::uint64_t kNoTurn = 0x0800'0080'0008'0000;  // w taken out; x, y, z 0: 2^19 + 2^39 + 2^59
const codecs::PoseGrid kGrid{{0.5, 0, -1}, -20};

/// Number 1, scene time 0x0A0B0C0D0E0F us, heard 0x0203, at the grid's (1, -2, 3), not turned.
Table& pose_head(Table& t, unsigned flags) {
  t.u(8, flags).u(32, 1).u(48, 0x0A0B'0C0D'0E0F);
  t.u(32, 0x11121314).u(32, 0x21222324).u(16, 0x3132).u(16, 0x0203);
  return t;
}
/// 1, 2, 3, 4, 5, 6 as halves.
Table& six(Table& t) {
  for (const unsigned half : {0x3C00, 0x4000, 0x4200, 0x4400, 0x4500, 0x4600}) t.u(16, half);
  return t;
}

codecs::PoseMessage pose_message() {
  codecs::PoseMessage m;
  m.time_us = 0x0A0B'0C0D'0E0F;
  m.times = {0x11121314, 0x21222324, 0x3132};
  m.heard = 0x0203;
  m.X_WT.p = kGrid.middle_W + glm::dvec3(1, -2, 3) * 0x1p-20;
  m.V_WT_W = {{1, 2, 3}, {4, 5, 6}};
  return m;
}

TEST(HapticProtocol, PoseGrid) {
  std::array<std::byte, codecs::kPoseGridBytes> buffer;
  EXPECT_BYTES(std::span(buffer).first(codecs::write(kGrid, buffer)), Table().f64(0.5).f64(0).f64(-1).u(8, 0xEC));
}

TEST(HapticProtocol, PoseMessage) {
  codecs::PoseWriter writer;
  writer.reset(kGrid);
  codecs::PoseMessage m = pose_message(), back;
  m.felt_To_W = spatial::Wrench{{1, 2, 3}, {4, 5, 6}};
  Table table;
  six(six(pose_head(table, 1 | 4).u(24, 1).u(24, 0xFFFFFE).u(24, 3).u(64, kNoTurn)));
  ASSERT_EQ(table.bytes().size(), 64u);
  std::array<std::byte, 256> buffer;
  EXPECT_BYTES(std::span(buffer).first(writer.write(m, buffer)), table);
  ASSERT_EQ(codecs::read(table.bytes(), kGrid, back), Fault::kNone);
  EXPECT_EQ(back.X_WT, m.X_WT);
  EXPECT_EQ(back.felt_To_W->force_N, m.felt_To_W->force_N);

  codecs::PoseWriter other;
  other.reset(kGrid);
  m = pose_message();
  m.heard.reset();
  m.X_WT.p = {100, 200, 300};
  m.X_WT.R = {0, 0, 1, 0};
  m.wants_curvature = true;
  m.ahead_us = 2500;
  m.line.by = teleoperation::Controller::kPassivity;
  m.line.value << 1, 2, 3, 4, 5, 6;
  m.line.energy_in_J = 7;
  Table full;
  full.u(8, 2 | 8 | 32).u(32, 1).u(48, 0x0A0B'0C0D'0E0F).u(32, 0x11121314).u(32, 0x21222324).u(16, 0x3132).u(16, 0);
  six(full.f64(100).f64(200).f64(300).u(64, kNoTurn | 2ull << 60)).u(16, 2500);
  full.f64(1).f64(2).f64(3).f64(4).f64(5).f64(6).f64(7);
  EXPECT_BYTES(std::span(buffer).first(other.write(m, buffer)), full);
}

/// One at p_ToC = (4, -5, 6) steps, 0.25 m deep, facing z, with slopes and couples of 1/2, 1/4, 1/8 and a range of 1/2
/// m.
Table& contact_at(Table& t, unsigned place) {
  t.u(8, place).u(8, 0x84).u(24, 4).u(24, 0xFFFFFB).u(24, 6).f32(0.25f).u(24, 0).u(24, 0);
  t.u(16, 0x3800).u(16, 0x3400).u(16, 0x3000).u(16, 0x3800).u(16, 0x3400).u(16, 0x3000);
  return t.u(24, 0x3F0000);
}
Table& answer_head(Table& t, unsigned flags, unsigned n, unsigned number) {
  t.u(8, flags).u(8, n).u(8, 0).u(16, 104).u(32, number).u(32, 1);
  return six(t.u(32, 0x11121314).u(32, 0x21222324).u(16, 0x3132));
}

TEST(HapticProtocol, AnswerMessage) {
  codecs::PoseWriter sent;
  sent.reset(kGrid);
  std::array<std::byte, 1199> buffer;
  codecs::PoseMessage asked = pose_message();
  asked.sequence = 42;
  const std::size_t pose_size = sent.write(asked, buffer);
  ASSERT_EQ(codecs::read(std::span(buffer).first(pose_size), kGrid, asked), Fault::kNone);

  codecs::AnswerMessage m, back;
  m.times = {0x11121314, 0x21222324, 0x3132};
  m.set.X_WT = asked.X_WT;
  m.set.pose_sequence = 1;
  m.set.F_To_W = {{1, 2, 3}, {4, 5, 6}};
  m.set.pairs_near = 104;
  m.set.count = 1;
  contact::Contact& c = m.set.contacts[0];
  c.id = 7;
  c.object = 8;
  const glm::dvec3 p_ToC_W = glm::dvec3(4, -5, 6) * 0x1p-20;
  c.p_WC_W = asked.X_WT.p + p_ToC_W;
  c.depth_m = 0.25;
  c.nhat_ST_W = {0, 0, 1};
  const glm::dvec3 by_translation{0.5, 0.25, 0.125 - 1};
  const glm::dvec3 by_rotation = glm::dvec3(0.5, 0.25, 0.125) + glm::cross(p_ToC_W, by_translation);
  const spatial::Vector6 gradient = spatial::to_vector6(spatial::Twist{by_rotation, by_translation});
  c.gradient = gradient;
  c.lateral_range_m = 0.5;
  c.material = {2000, 0.5, 0.75, 0.25};
  c.doubts = 0x84;

  codecs::AnswerWriter writer;
  writer.reset(kGrid);
  codecs::AnswerReader reader;
  Table told;
  contact_at(answer_head(told, 0, 1, 1), 0x80).u(8, 255).u(32, 7).u(32, 8).f32(2000).f32(0.5f).f32(0.75f).f32(0.25f);
  ASSERT_EQ(told.bytes().size(), 35u + 36 + 25);
  EXPECT_BYTES(std::span(buffer).first(writer.write(m, asked.X_WT, buffer)), told);
  ASSERT_EQ(reader.read(told.bytes(), sent, back), Fault::kNone);
  EXPECT_EQ(back.set.pose_sequence, 42u);
  EXPECT_EQ(back.set.X_WT, asked.X_WT);
  EXPECT_EQ(back.set.contacts[0].p_WC_W, c.p_WC_W);
  EXPECT_EQ(back.set.contacts[0].gradient, c.gradient);
  EXPECT_EQ(back.set.contacts[0].material.static_friction, 0.75);
  EXPECT_EQ(*reader.heard(sent), 1);

  writer.acknowledge(reader.heard(sent));
  Table known;
  contact_at(answer_head(known, 0, 1, 2), 0);
  EXPECT_BYTES(std::span(buffer).first(writer.write(m, asked.X_WT, buffer)), known);
  ASSERT_EQ(reader.read(known.bytes(), sent, back), Fault::kNone);
  EXPECT_EQ(back.set.contacts[0].id, 7u);

  // Half as stiff; at another pose on the grid; with a curvature and a line.
  c.material.stiffness_N_per_m = 1000;
  c.material.damping_Ns_per_m = 0.25;
  m.set.X_WT.p = kGrid.middle_W;
  c.p_WC_W = m.set.X_WT.p + p_ToC_W;
  spatial::Matrix6 hessian = spatial::Matrix6::Constant(2);
  c.curvature = contact::Curvature::of(hessian);
  m.line.emplace();
  Table curved;
  answer_head(curved, 1 | 8 | 16, 1, 3).u(24, 0).u(24, 0).u(24, 0).u(64, kNoTurn);
  for (int i = 0; i < 7; ++i) curved.f64(0);
  contact_at(curved, 0x40).u(16, 0x3800);
  for (int i = 0; i < 21; ++i) curved.u(24, 0x400000);
  EXPECT_BYTES(std::span(buffer).first(writer.write(m, asked.X_WT, buffer)), curved);
  ASSERT_EQ(reader.read(curved.bytes(), sent, back), Fault::kNone);
  EXPECT_EQ(back.set.contacts[0].material.stiffness_N_per_m, 1000);
  EXPECT_EQ(back.set.contacts[0].curvature.matrix(), hessian);

  // In full.
  c.curvature = {};
  c.material = {2000, 0.5, 0.75, 0.25};
  m.line.reset();
  m.set.X_WT.p = {100, 200, 300};
  c.p_WC_W = {164, 200, 300};
  c.gradient << 0, 0, 0, 0, 0, -1;
  Table full;
  answer_head(full, 2 | 4, 1, 4).f64(100).f64(200).f64(300).f64(1).f64(0).f64(0).f64(0);
  full.u(8, 0).u(8, 0x84).f64(64).f64(0).f64(0).f32(0.25f).u(24, 0).u(24, 0).u(16, 0).u(16, 0).u(16, 0);
  full.u(16, 0).u(16, 0xD400).u(16, 0).u(24, 0x3F0000);  // p x -z = (0, 64, 0), and 0 was told
  EXPECT_BYTES(std::span(buffer).first(writer.write(m, asked.X_WT, buffer)), full);
  ASSERT_EQ(reader.read(full.bytes(), sent, back), Fault::kNone);
  EXPECT_EQ(back.set.X_WT, m.set.X_WT);
  EXPECT_EQ(back.set.contacts[0].gradient, c.gradient);

  // Another contact, of the same object and material.
  m.set.X_WT = asked.X_WT;
  c.p_WC_W = asked.X_WT.p + p_ToC_W;
  c.gradient = gradient;
  m.set.contacts[1] = c;
  m.set.contacts[1].id = 9;
  m.set.count = 2;
  Table like;
  contact_at(contact_at(answer_head(like, 0, 2, 5), 0), 0x81).u(8, 0).u(32, 9);
  EXPECT_BYTES(std::span(buffer).first(writer.write(m, asked.X_WT, buffer)), like);
  ASSERT_EQ(reader.read(like.bytes(), sent, back), Fault::kNone);
  EXPECT_EQ(back.set.contacts[1].id, 9u);
  EXPECT_EQ(back.set.contacts[1].object, 8u);
  EXPECT_EQ(back.set.contacts[1].material.static_friction, 0.75);
}

}  // namespace
}  // namespace farfeel
