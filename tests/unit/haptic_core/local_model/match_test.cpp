#include "haptic_core/local_model/match.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
namespace {

/// At rest at the world's origin, its point at x, facing z.
FeltContact contact_at(double x_m, std::uint32_t id, Source source, double stiffness_N_per_m = 2000) {
  contact::Contact contact;
  contact.id = id;
  contact.p_WC_W = {x_m, 0, 0};
  contact.nhat_ST_W = {0, 0, 1};
  contact.depth_m = 1e-3;
  contact.gradient = spatial::to_vector6(spatial::Twist{glm::cross(contact.p_WC_W, glm::dvec3(0, 0, -1)), {0, 0, -1}});
  contact.lateral_range_m = 1e-3;
  contact.material.stiffness_N_per_m = stiffness_N_per_m;
  FeltContact felt = felt_contact(received(contact, {}, {.source = source}));
  felt.look_from({});
  return felt;
}

Match match_new(const std::vector<FeltContact>& felt, const std::vector<FeltContact>& arriving) {
  const std::vector<std::size_t> stays_as(arriving.size(), kNoContact);
  return match(felt, arriving, stays_as);
}

TEST(Match, FromTilesAContactGoesOnUnderItsNameAndElseByItsPlace) {
  const std::vector felt{contact_at(0, 1, Source::kTiles), contact_at(0.01, 2, Source::kTiles)};
  const std::vector arriving{contact_at(0.011, 7, Source::kTiles), contact_at(0.001, 1, Source::kTiles)};
  const Match pairs = match_new(felt, arriving);
  ASSERT_EQ(pairs.goes_on_count, 2u);
  EXPECT_EQ(pairs.goes_on[0].felt, 0u) << "names come first";
  EXPECT_EQ(pairs.goes_on[0].arriving, 1u);
  EXPECT_EQ(pairs.goes_on[1].felt, 1u);
  EXPECT_EQ(pairs.goes_on[1].arriving, 0u);
}

TEST(Match, WhatIsFarUnderAnotherNameHasASuccessorAndDoesNotGoOn) {
  const std::vector felt{contact_at(0, 1, Source::kTiles), contact_at(0.1, 2, Source::kTiles)};
  const std::vector arriving{contact_at(2 * kRenamedRange_m, 7, Source::kTiles), contact_at(0.2, 8, Source::kTiles)};
  const Match pairs = match_new(felt, arriving);
  EXPECT_EQ(pairs.goes_on_count, 0u);
  EXPECT_EQ(pairs.successor[0], 0u);
  EXPECT_EQ(pairs.successor[1], kNoContact) << "it leaves";
}

TEST(Match, WhatTheRemoteTellsAnewSucceedsAndDoesNotGoOn) {
  const std::vector felt{contact_at(0, 1, Source::kNewRemote)};
  const Match pairs =
      match_new(felt, {contact_at(0.005, 5, Source::kNewRemote), contact_at(0.05, 1, Source::kNewRemote)});
  EXPECT_EQ(pairs.goes_on_count, 0u);
  EXPECT_EQ(pairs.successor[0], 1u) << "of the same name, however far";
}

TEST(Match, NobodySucceedsFacingAwayOnAnotherObjectSofterOrApart) {
  const FeltContact old = contact_at(0, 1, Source::kNewRemote);
  const auto successor = [&](auto spoil) {
    FeltContact now = contact_at(0, 1, Source::kNewRemote);
    spoil(now);
    return match_new({old}, {now}).successor[0];
  };
  EXPECT_EQ(successor([](FeltContact&) {}), 0u);
  EXPECT_EQ(successor([](FeltContact& f) { f.received.contact.nhat_ST_W = {0, 0, -1}; }), kNoContact);
  EXPECT_EQ(successor([](FeltContact& f) { f.received.contact.object = 3; }), kNoContact);
  EXPECT_EQ(successor([](FeltContact& f) { f.received.contact.material.stiffness_N_per_m = 900; }), kNoContact);
  EXPECT_EQ(successor([](FeltContact& f) { f.here.depth_m = -2 * kSuccessorsGap_m; }), kNoContact);
}

TEST(Match, OneThatWasLeavingComesBackOnlyAsOneWithNoOtherPast) {
  FeltContact leaving = contact_at(0, 1, Source::kNewRemote);
  leaving.transition.is_leaving = true;
  const std::vector now{contact_at(0.001, 2, Source::kNewRemote)};
  EXPECT_EQ(match_new({leaving}, now).successor[0], 0u);
  const Match both = match_new({leaving, contact_at(0.001, 2, Source::kNewRemote)}, now);
  EXPECT_EQ(both.successor[0], kNoContact);
  EXPECT_EQ(both.successor[1], 0u);
}

TEST(Match, WhatStaysIsNeitherPairedNorSucceeded) {
  const std::vector felt{contact_at(0, 1, Source::kNewRemote), contact_at(0, 2, Source::kNewRemote)};
  const std::vector<std::size_t> stays_as{1};
  const Match pairs = match(felt, std::vector{felt[1]}, stays_as);
  EXPECT_EQ(pairs.goes_on_count, 0u);
  EXPECT_TRUE(pairs.stays[1] && pairs.is_old[0]);
  EXPECT_FALSE(pairs.stays[0]);
  EXPECT_EQ(pairs.successor[0], kNoContact);
}

}  // namespace
}  // namespace farfeel::local_model
