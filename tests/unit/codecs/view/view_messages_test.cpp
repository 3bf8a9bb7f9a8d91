// What the live view's messages carry comes back as it was, and nothing else is taken.
#include "codecs/view/view_messages.h"

#include <gtest/gtest.h>

#include <cmath>

#include "codecs/view/message_stream.h"
#include "codecs/view/view_shapes.h"
#include "codecs/view/view_tick.h"

namespace farfeel::codecs {
namespace {

ViewTick some_tick() {
  ViewTick tick;
  tick.number = 4711, tick.time_ns = 5'000'000'001, tick.told_ns = 77, tick.state = 1, tick.rung = 3;
  tick.X_WT.p = {0.1, -0.2, 0.3}, tick.X_WI.p = {1, 2, 3};
  tick.F_hand_W = {{1, 2, 3}, {4, 5, 6}}, tick.F_contact_To_W = {{-1, -2, -3}, {-4, -5, -6}};
  tick.depth_max_m = 1e-4, tick.pressing = 2, tick.ticks = 8;
  tick.pushes.count = 2;
  tick.pushes.of[0] = {3,    {1, 2, 3}, {0, 0, 1}, {0.5F, -0.25F, 4.125F}, 2e-5F, 0x12, local_model::Source::kTiles,
                       false};
  tick.pushes.of[1] = {0, {4, 5, 6}, {1, 0, 0}, {1, 0, 0}, 1e-5F, 0, local_model::Source::kOldRemote, true};
  tick.moving.push_back({2, {{1, 0, 0, 0}, {7, 8, 9}}, false});
  tick.bins[0].add(3.5), tick.bins[0].add(4.5), tick.bins[6].add(120);
  return tick;
}

ViewTiles some_tiles() {
  ViewTiles tiles{2, {{0, 0, 0}, {1e-6, 1e-6, 1e-6}}, 3, {}};
  tiles.pieces.push_back({{{{0, 0, 0}, {9, 0, 0}, {9, 9, 0}}}, 2});
  tiles.pieces.push_back({{{{0, 0, 0}, {9, 9, 0}, {0, 9, 1}}}, 0});
  return tiles;
}

TEST(ViewMessages, TilesAndWhichAreHereComeBackAsTheyWere) {
  const auto tiles = read_view_tiles(write_view(some_tiles()));
  ASSERT_TRUE(tiles);
  EXPECT_EQ(tiles->body, 2);
  EXPECT_EQ(tiles->tiles, 3U);
  ASSERT_EQ(tiles->pieces.size(), 2U);
  EXPECT_EQ(tiles->pieces[1].corners, some_tiles().pieces[1].corners);
  EXPECT_EQ(tiles->pieces[0].tile, 2U);
  ViewTiles of_none = some_tiles();
  of_none.pieces[1].tile = 3;  // of three
  EXPECT_FALSE(read_view_tiles(write_view(of_none)));
  for (std::size_t count = 0; count < 20; ++count) {
    ViewPresence presence;
    for (std::size_t i = 0; i < count; ++i) presence.is_here.push_back(i % 3 == 1);
    const auto read = read_view_presence(write_view(presence));
    ASSERT_TRUE(read) << count;
    EXPECT_EQ(read->is_here, presence.is_here);
  }
  auto beyond = write_view(ViewPresence{{true}});
  beyond.back() = std::byte{2};  // of one tile
  EXPECT_FALSE(read_view_presence(beyond));
}

TEST(ViewMessages, OfALongHistoryTheNewestMomentsAreTold) {
  ViewHistory history(kMostViewMoments + 5);
  for (std::size_t i = 0; i < history.size(); ++i) history[i].time_ns = static_cast<std::int64_t>(i);
  history.back().bins[2].add(7);
  const auto read = read_view_history(write_view(history));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->size(), kMostViewMoments);
  EXPECT_EQ(read->front().time_ns, 5);
  EXPECT_EQ(read->back().bins[2].mean, 7);
}

TEST(ViewMessages, ATickComesBackAsItWas) {
  const ViewTick tick = some_tick();
  const auto read = read_view_tick(write_view(tick));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->number, tick.number);
  EXPECT_EQ(read->time_ns, tick.time_ns);
  EXPECT_EQ(read->told_ns, tick.told_ns);
  EXPECT_EQ(read->X_WT, tick.X_WT);
  EXPECT_EQ(read->X_WI, tick.X_WI);
  EXPECT_EQ(read->F_hand_W, tick.F_hand_W);
  EXPECT_EQ(read->F_contact_To_W, tick.F_contact_To_W);
  ASSERT_EQ(read->pushes.count, 2U);
  EXPECT_EQ(read->pushes.of[0].force_N, tick.pushes.of[0].force_N);
  EXPECT_EQ(read->pushes.of[0].p_WC_W, tick.pushes.of[0].p_WC_W);
  EXPECT_EQ(read->pushes.of[0].doubts, 0x12);
  EXPECT_EQ(read->pushes.of[0].source, local_model::Source::kTiles);
  EXPECT_TRUE(read->pushes.of[1].is_leaving);
  ASSERT_EQ(read->moving.size(), 1U);
  EXPECT_EQ(read->moving[0].X_WB.p, glm::dvec3(7, 8, 9));
  EXPECT_FALSE(read->moving[0].is_there);
  EXPECT_EQ(read->bins[0].low, 3.5F);
  EXPECT_EQ(read->bins[0].high, 4.5F);
  EXPECT_EQ(read->bins[0].mean, 4);
  EXPECT_EQ(read->bins[0].count, 2U);
  EXPECT_TRUE(std::isnan(read->bins[1].mean));
}

TEST(ViewMessages, NoneIsTakenThatIsShortOrLong) {
  for (const auto& message :
       {write_view(some_tick()), write_view(ViewScene{"gear", 3, {}, {}}),
        write_view(ViewStatus{ViewTone::kTrouble, true, "a", "b", {{"link", "1 ms"}}}), write_view(ViewVerb::kRecentre),
        write_view(ViewAnswer{ViewVerb::kPause, true, "paused"}), write_view(some_tiles()),
        write_view(ViewPresence{{true, false, true, true, false, false, true, false, true}}),
        write_view(ViewHistory{{5, {}}, {6, {}}}), write_view_token(std::string(kViewTokenBytes, 'a')),
        write_view_taken(9)}) {
    const auto is_taken = [](std::span<const std::byte> bytes) {
      return read_view_tick(bytes) || read_view_scene(bytes) || read_view_status(bytes) || read_view_control(bytes) ||
             read_view_answer(bytes) || read_view_tiles(bytes) || read_view_presence(bytes) ||
             read_view_history(bytes) || read_view_token(bytes) || read_view_taken(bytes);
    };
    EXPECT_TRUE(is_taken(message));
    for (std::size_t size = 0; size < message.size(); ++size) EXPECT_FALSE(is_taken(std::span(message).first(size)));
    auto longer = message;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(is_taken(longer));
    auto other_version = message;
    other_version[0] = std::byte{kViewVersion + 1};
    EXPECT_FALSE(is_taken(other_version));
  }
}

TEST(ViewMessages, WhatIsNotFiniteIsNotTaken) {
  ViewTick tick = some_tick();
  tick.pushes.of[1].force_N.y = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(read_view_tick(write_view(tick)));
  tick = some_tick();
  tick.X_WT.R.w = 2;
  EXPECT_FALSE(read_view_tick(write_view(tick)));
}

TEST(ViewMessages, ABodyIsOffByHalfAStep) {
  const geometry::TriangleMesh mesh{{{0, 0, 0}, {0.1, 0, 0}, {0.033, 0.2, -0.01}}, {{0, 1, 2}}};
  const auto read = read_view_body(write_view(view_body(1, "plate", {}, mesh)));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->name, "plate");
  EXPECT_EQ(read->triangles, mesh.triangles);
  for (std::size_t i = 0; i < mesh.positions_O.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double at =
          read->box.low_B[axis] + read->box.step_B[axis] * read->vertices[i][static_cast<std::size_t>(axis)];
      EXPECT_NEAR(at, mesh.positions_O[i][axis], 0.501 * read->box.step_B[axis]);
    }
  }
  ViewBody wrong = *read;
  wrong.triangles[0][2] = 3;  // of three vertices
  EXPECT_FALSE(read_view_body(write_view(wrong)));
}

TEST(ViewMessages, ABodyOfAScanHasItsColours) {
  const geometry::TriangleMesh mesh{{{0, 0, 0}, {0.1, 0, 0}, {0.033, 0.2, -0.01}}, {{0, 1, 2}}};
  const std::vector<ViewColour> colours{{255, 0, 1}, {2, 3, 4}, {5, 6, 7}};
  const auto bytes = write_view(view_body(1, "scan", {}, mesh, colours));
  EXPECT_EQ(bytes.size(), write_view(view_body(1, "scan", {}, mesh)).size() + 9);
  const auto read = read_view_body(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->colours, colours);
  ViewBody fewer = *read;
  fewer.colours.pop_back();
  EXPECT_FALSE(read_view_body(write_view(fewer)));
}

TEST(ViewMessages, WhatWasNotToldIsInTheNextOnesBins) {
  ViewTick first = some_tick(), second = some_tick();
  first.bins = {}, second.bins = {};
  for (const double v : {1.0, 9.0, 2.0}) first.bins[3].add(v);
  second.bins[3].add(4);
  second.absorb(first);
  EXPECT_EQ(second.ticks, 16U);
  EXPECT_EQ(second.bins[3].low, 1);
  EXPECT_EQ(second.bins[3].high, 9);
  EXPECT_EQ(second.bins[3].mean, 4);
  EXPECT_EQ(second.bins[3].count, 4U);
}

TEST(MessageStream, PutsTogetherWhatCameInPieces) {
  std::vector<std::byte> bytes;
  const auto scene = write_view(ViewScene{"gear", 3, {}, {}}), tick = write_view(some_tick());
  for (const auto& message : {scene, tick}) {
    const auto with_length = framed(message);
    bytes.insert(bytes.end(), with_length.begin(), with_length.end());
  }
  MessageStream stream(kMostViewBytes);
  std::vector<std::vector<std::byte>> came;
  for (const std::byte byte : bytes) {
    stream.put(std::span(&byte, 1));
    while (const auto message = stream.next()) came.emplace_back(message->begin(), message->end());
  }
  EXPECT_EQ(came, (std::vector{scene, tick}));
}

TEST(MessageStream, ALengthBeyondTheBoundBreaksItForGood) {
  MessageStream stream(100);
  const std::vector<std::byte> long_one(101);
  stream.put(framed(long_one));
  EXPECT_FALSE(stream.next());
  EXPECT_TRUE(stream.is_broken());
  stream.put(framed(std::span(long_one).first(5)));
  EXPECT_FALSE(stream.next());
}

}  // namespace
}  // namespace farfeel::codecs
