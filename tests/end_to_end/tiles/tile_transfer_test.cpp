// The tile feed and the tile receiver at the two ends of a bulk lane over a bad link, in simulated time.
#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <set>

#include "codecs/felt/felt_outline.h"
#include "haptic_core/local_model/local_model.h"
#include "master_station/session/tile_receiver.h"
#include "slave_sim/session/tile_feed.h"
#include "tests/support/tiled_plates.h"
#include "transport/bulk/bulk_lane.h"

namespace farfeel::end_to_end {
namespace {

using test_support::TiledPlates;

constexpr std::int64_t kTick_ns = 1'000'000, kOneWay_ns = 50'000'000;

std::array<std::byte, codecs::kTileRequestBytes> request(std::uint32_t round = 1) {
  std::array<std::byte, codecs::kTileRequestBytes> payload;
  EXPECT_EQ(codecs::write(codecs::TileRequest{round}, payload), payload.size());
  return payload;
}

/// Takes all that the feed would send now.
void drain(slave_sim::TileFeed& feed, std::int64_t now_ns) {
  transport::MessageBuffer body;
  while (feed.urgency(now_ns)) ASSERT_TRUE(feed.next(body, now_ns));
}

/// A tool that slides over the table, tiles that follow it down a lossy line, receipts that come back up it.
struct Line {
  /// The tool slides over the table; or the table under the tool, which moves as fast as `speed` says.
  explicit Line(double loss_share, double speed_m_s = 0.05, const motion::ScriptedMotion* table_motion = nullptr,
                const TiledPlates& on = {})
      : loss(loss_share), speed(speed_m_s), motion(table_motion), plates(on) {
    auto outline = codecs::write_felt_outline(std::array{tool, object}, {});
    auto scene = codecs::read_felt_outline(outline.value());
    if (motion) scene->bodies.back().motion = *motion;
    cache = std::make_unique<local_model::TileCache>(std::move(scene.value()));
    receiver.emplace(*cache);
    local.emplace(*cache);
    there.add_source(feed);
  }
  [[nodiscard]] contact_service::ToolPose pose(std::int64_t tick) const {
    const double x_m = from_m + speed * 1e-3 * static_cast<double>(std::max<std::int64_t>(tick - rests, 0));
    const double now_m_s = tick >= rests ? speed : 0;
    return {static_cast<std::uint32_t>(tick), tick * kTick_ns, TiledPlates::pose(x_m, 0.1e-3), {{}, {now_m_s, 0, 0}}};
  }
  /// One millisecond; whether the contact at the tool's pose is felt from tiles.
  bool tick() {
    if (ticks == 0) take_scene();
    ++ticks;
    // Poses are as old as the line is long.
    feed.aim(pose(ticks - one_way_ns / kTick_ns), 0, there.pacer().round_trip_ns(), now_ns);
    if (ticks % 100 == 1) pass(up, request());
    exchange();
    const local_model::TickContacts& contacts = local->at(pose(ticks));
    return contacts.from_tiles == 1 && contacts.from_remote == 0;
  }

  /// A session begins with its scene, which opens the line for what comes afterwards.
  void take_scene() {
    there.restart(1, 2 * one_way_ns, now_ns);  // as the handshake tells
    std::vector<std::byte> scene(100'000);
    for (std::byte& b : scene) b = static_cast<std::byte>(random());
    there.outbox().offer(0, transport::make_object(std::move(scene)), 0, now_ns);
    while (!here.inbox().take_object()) exchange();
  }
  /// One millisecond of the lane.
  void exchange() {
    now_ns += kTick_ns;
    transport::MessageBuffer message;
    while (const std::size_t size = there.next(message, now_ns)) {
      largest = std::max(largest, size);
      pass(down, std::span(message).first(size));
    }
    while (!down.empty() && down.front().due_ns <= now_ns) {
      if (const auto body = here.on_message(down.front().bytes, now_ns)) receiver->on_tile(body->bytes);
      down.pop_front();
    }
    receiver->put_waiting();
    while (const std::size_t size = here.next(message, now_ns)) pass(up, std::span(message).first(size));
    while (!up.empty() && up.front().due_ns <= now_ns) {
      const auto& bytes = up.front().bytes;
      if (bytes.size() == codecs::kTileRequestBytes) {
        feed.on_request(bytes);
      } else {
        EXPECT_FALSE(there.on_message(bytes, now_ns));
      }
      up.pop_front();
    }
  }

  struct Datagram {
    std::int64_t due_ns;
    std::vector<std::byte> bytes;
  };
  void pass(std::deque<Datagram>& way, std::span<const std::byte> bytes) {
    for (int copy = 0; copy < 2; ++copy) {  // every tenth twice
      if (copy == 1 && random() % 10 != 0) return;
      if (std::uniform_real_distribution<>()(random) < loss) continue;
      way.push_back({now_ns + one_way_ns, {bytes.begin(), bytes.end()}});
      if (random() % 20 != 0 || way.size() < 2) continue;
      std::swap(way.back().bytes, way[way.size() - 2].bytes);  // overtaken, for the other one was held up
      way[way.size() - 2].due_ns = way.back().due_ns;
    }
  }

  double loss, speed, from_m = -0.012;
  std::int64_t rests = 0, one_way_ns = kOneWay_ns;  // rests: ticks before it moves
  const motion::ScriptedMotion* motion;
  TiledPlates plates;
  penetration::FeltSurface tool_felt{plates.tool}, table_felt{plates.table};
  contact_service::TouchableObject tool{&plates.tool, plates.material, {}, &tool_felt},
      object{&plates.table, plates.material, {}, &table_felt, motion};
  slave_sim::EditableSurfaces editable = [this] {
    slave_sim::EditableSurfaces both;
    both.add(plates.tool, tool_felt);
    both.add(plates.table, table_felt);
    return both;
  }();
  slave_sim::TileFeed feed{std::span(&object, 1), tool, {}, {}, &editable};
  std::shared_ptr<transport::ByteBudget> room = std::make_shared<transport::ByteBudget>(1 << 20);
  transport::BulkLane there{{}, room}, here{{}, room};
  std::unique_ptr<local_model::TileCache> cache;
  std::optional<master_station::TileReceiver> receiver;
  std::optional<local_model::LocalContacts> local;
  std::deque<Datagram> down, up;
  std::mt19937 random{1};
  std::int64_t ticks = 0, now_ns = 1'000'000'000;
  std::size_t largest = 0;
};

TEST(TileTransfer, TilesComeAheadOfTheToolAndOnlyOnce) {
  Line line(0);
  int without = 0;
  for (int i = 0; i < 400; ++i) without += !line.tick() && i > 250;
  EXPECT_EQ(without, 0);
  EXPECT_EQ(line.feed.resent_tiles(), 0u);
  EXPECT_LE(line.largest, transport::kMostMessageBytes);
  const std::uint64_t sent = line.feed.sent_bytes();
  EXPECT_LE(sent, 200e3 + 0.4 * 130e3 + 12e3) << "beyond the budget";
  EXPECT_EQ(line.receiver->malformed(), 0u);
}

TEST(TileTransfer, TilesComeAheadOfAnObjectThatMovesUnderTheTool) {
  const motion::ScriptedMotion table(std::array{motion::Keyframe{0, {}}, motion::Keyframe{0.2, {}},
                                                motion::Keyframe{0.5, {{1, 0, 0, 0}, {-0.018, 0, 0}}},
                                                motion::Keyframe{0.7, {{1, 0, 0, 0}, {-0.022, 0, 0}}}},
                                     motion::Afterwards::kStays);
  Line line(0, 0, &table);
  int without = 0;
  for (int i = 0; i < 700; ++i) without += !line.tick() && i > 250;
  EXPECT_EQ(without, 0);
}

// A contact that the loop could not hold is felt with a wider soft maximum, and so from more of its surface.
TEST(TileTransfer, AWiderContactGetsWhatItIsFeltFrom) {
  const Line line(0, 0);
  contact_service::ToolPose tilted = line.pose(0);
  tilted.X_WT.R = glm::dquat{std::cos(0.15), 0, std::sin(0.15), 0} * tilted.X_WT.R;
  contact_service::ContactService scout = line.plates.remote();
  for (const double width_m : {10e-6, 150e-6}) {
    slave_sim::TileFeed feed{std::span(&line.object, 1), line.tool, {}};
    feed.on_request(request());
    feed.aim(tilted, width_m, 0, kTick_ns);
    drain(feed, kTick_ns);
    std::set<std::pair<std::uint32_t, std::uint32_t>> sharp, wide;
    for (const auto& where : scout.tiles_needed(tilted, 0).tiles) sharp.insert({where.surface, where.tile});
    for (const auto& where : scout.tiles_needed(tilted, 0, 150e-6).tiles) wide.insert({where.surface, where.tile});
    EXPECT_GT(wide.size(), sharp.size());
    EXPECT_GE(feed.sent_tiles(), width_m > 100e-6 ? wide.size() : sharp.size());
    EXPECT_EQ(feed.sent_tiles() < wide.size(), width_m < 100e-6);
  }
}

TEST(TileTransfer, NoContactGetsMoreThanItsShareForLong) {
  const Line line(0, 0.05);
  constexpr double kBytes_per_s = 20e3, kBurst = 10e3;
  slave_sim::TileFeedOptions options;
  options.bytes_per_s_a_contact = kBytes_per_s;
  options.burst_bytes = kBurst;
  slave_sim::TileFeed feed{std::span(&line.object, 1), line.tool, {}, options};
  feed.on_request(request());
  std::uint64_t halfway = 0;
  for (std::int64_t tick = 1; tick <= 400; ++tick) {
    feed.aim(line.pose(tick), 0, 0, tick * kTick_ns);
    drain(feed, tick * kTick_ns);
    EXPECT_LE(static_cast<double>(feed.sent_bytes()), kBurst + 1e-3 * static_cast<double>(tick) * kBytes_per_s + 1184);
    if (tick == 200) halfway = feed.sent_bytes();
  }
  EXPECT_GT(feed.sent_bytes(), halfway) << "it goes on, slower";
}

// The feed does not know where a hand goes that rests, and hears of its start half a round trip late.
TEST(TileTransfer, AStrokeOverFreshGroundFindsItsHeightsThere) {
  TiledPlates plates;
  plates.table = slave_sim::ridged_plate(3e-3, 0.3e-3, {.size_m = {0.160, 0.030, 0.004}});
  Line line(0, 0.3, nullptr, plates);
  line.from_m = -0.060, line.rests = 900, line.one_way_ns = 100'000'000;
  for (std::int64_t i = 0; i < line.rests; ++i) line.tick();
  int late = 0;
  for (int i = 0; i < 400; ++i) late += !line.tick();
  EXPECT_LE(late, 4) << "of 400 ticks, 120 mm";
}

TEST(TileTransfer, WhoDoesNotAskGetsNone) {
  const Line line(0);
  slave_sim::TileFeed feed{std::span(&line.object, 1), line.tool, {}};
  for (std::int64_t now_ns = kTick_ns; now_ns < 200 * kTick_ns; now_ns += kTick_ns) {
    feed.aim(line.pose(now_ns / kTick_ns), 0, 0, now_ns);
    EXPECT_FALSE(feed.urgency(now_ns));
  }
  feed.on_request(request());
  feed.aim(line.pose(200), 0, 0, 200 * kTick_ns);
  EXPECT_TRUE(feed.urgency(200 * kTick_ns));
}

TEST(TileTransfer, LostTilesComeAgain) {
  Line line(0.2, 0.01);
  for (int i = 0; i < 600; ++i) line.tick();
  int with = 0;
  for (int i = 0; i < 200; ++i) with += line.tick();
  EXPECT_GT(with, 150);
  EXPECT_GT(line.feed.resent_tiles(), 0u);
}

/// What is felt of a tool that is held still, from tiles alone, and booked as the loop does.
struct HeldStill {
  void look(Line& line) {
    const spatial::Pose X_WT = line.pose(line.ticks).X_WT;
    model.advance(1e-3, X_WT);
    model.hear({});
    here = line.local->at(line.pose(line.ticks));
    model.refresh(here, X_WT);
    const double now_N = model.evaluate(X_WT, {}, 1e-3).response.F_To_W.tail<3>().norm();
    largest_step_N = std::max(largest_step_N, std::abs(now_N - force_N));
    force_N = now_N;
    model.settle(spatial::Vector6::Zero(), spatial::Vector6::Zero(), 1e-3, X_WT);
  }
  static local_model::LocalModelSettings settings() {
    local_model::LocalModelSettings settings;
    settings.rung = local_model::Rung::kTiles;
    return settings;
  }
  local_model::LocalModel model{settings()};
  local_model::TickContacts here;
  double force_N = 0, largest_step_N = 0;
};

// The ridges under the tool are cut to half their height, and grow again; all while the link loses and delays.
TEST(TileTransfer, ASurfaceThatChangesWhileItIsTouchedIsFeltWithoutAJump) {
  Line line(0.05, 0);
  const geometry::HapticSurface before = line.plates.table;
  HeldStill hand;
  for (int i = 0; i < 1500; ++i) line.tick(), hand.look(line);
  ASSERT_GT(hand.force_N, 0.1);
  const double pressed_N = hand.force_N, pressed_m = hand.here.set.contacts[0].depth_m;
  for (const std::uint32_t version : {1u, 2u}) {
    const std::uint64_t resent = line.feed.sent_tiles();
    for (std::uint32_t i = 0; i < before.tiles.size(); ++i) {
      geometry::HeightTile tile = before.tiles[i];
      tile.version = version;
      if (version == 1)
        for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(c / 2);
      line.feed.edit({{1, i}, tile});
      line.feed.edit({{1, i}, tile});  // the same again is no news
    }
    hand.largest_step_N = 0;
    for (int i = 0; i < 1500; ++i) line.tick(), hand.look(line);
    EXPECT_GT(line.feed.sent_tiles(), resent);
    // One that knows the edited surface from the start finds the same.
    contact_service::ContactService truth = line.plates.remote();
    const contact::ContactSet& there = truth.answer(line.pose(line.ticks));
    ASSERT_EQ(there.count, 1u);
    ASSERT_EQ(hand.here.from_tiles, 1u);
    EXPECT_NEAR(hand.here.set.contacts[0].depth_m, there.contacts[0].depth_m, 0.3e-6);
    EXPECT_LT(hand.largest_step_N, 0.35) << "a free step and a tick of letting in or go";
    EXPECT_GE(hand.model.tank().level_J(), -1e-9);
    if (version == 1) {
      EXPECT_LT(hand.here.set.contacts[0].depth_m, pressed_m - 0.1e-3);
      EXPECT_EQ(hand.force_N, 0) << "nothing is left to press on";
    } else {
      EXPECT_NEAR(hand.force_N, pressed_N, 0.1 * pressed_N) << "let in, as the tank's allowance pays for it";
    }
  }
}

TEST(TileTransfer, GarbledAndLateMessagesChangeNothing) {
  Line line(0);
  for (int i = 0; i < 150; ++i) line.tick();
  const std::uint64_t tiles = line.cache->tiles();
  std::vector<std::byte> payload(900);
  for (int i = 0; i < 2000; ++i) {
    for (std::byte& b : payload) b = static_cast<std::byte>(line.random());
    payload.resize(line.random() % 1184);
    line.receiver->on_tile(payload);
    if (payload.size() != codecs::kTileRequestBytes) line.feed.on_request(payload);
  }
  EXPECT_EQ(line.cache->tiles(), tiles);
  EXPECT_EQ(line.receiver->malformed(), 2000u);
}

TEST(TileTransfer, ANewMasterGetsEverythingAnew) {
  Line line(0, 0);
  for (int i = 0; i < 1000; ++i) line.tick();
  const std::uint64_t first = line.feed.sent_tiles();
  for (int i = 0; i < 100; ++i) line.tick();
  EXPECT_EQ(line.feed.sent_tiles(), first) << "sent without need";
  line.feed.restart();
  for (int i = 0; i < 1000; ++i) line.tick();
  EXPECT_EQ(line.feed.sent_tiles(), 2 * first);
}

// A slave that was started anew knows nothing of what its master holds; the master tells it. What is as it was is not
// sent again, whether it was edited meanwhile and changed back or never; what is another is.
TEST(TileTransfer, WhatAMasterHoldsIsNotSentAgain) {
  for (const bool tells_truth : {true, false}) {
    Line line(0, 0);
    for (int i = 0; i < 1000; ++i) line.tick();
    const std::uint64_t first = line.feed.sent_tiles(), bytes = line.feed.sent_bytes();
    contact_service::ContactService scout = line.plates.remote();
    const auto needed = scout.tiles_needed(line.pose(line.ticks), 0).tiles;
    const auto changed = std::ranges::find(needed, 1u, &contact_service::SurfaceTile::surface);
    ASSERT_NE(changed, needed.end());

    ASSERT_TRUE(line.receiver->begin_epoch());
    line.feed.restart();
    geometry::HeightTile tile = line.plates.table.tiles[changed->tile];
    for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(c / 2);
    ++tile.version;
    line.feed.edit({*changed, tile});
    line.receiver->begin_telling();
    std::size_t told = 0;
    while (auto held = line.receiver->next_held()) {
      for (std::uint32_t i = 0; i < held->count; ++i) {
        told += held->hashes[i] != 0;
        held->hashes[i] += tells_truth || held->hashes[i] == 0 ? 0 : 1;
      }
      std::array<std::byte, codecs::kMostTilesHeldBytes> payload;
      line.feed.on_held(std::span(payload).first(codecs::write(*held, payload)));
    }
    EXPECT_EQ(told, first);
    EXPECT_FALSE(line.receiver->next_held()) << "told once a session";
    for (int i = 0; i < 1000; ++i) line.tick();
    EXPECT_EQ(line.feed.held_tiles(), tells_truth ? first - 1 : 0);
    EXPECT_EQ(line.feed.sent_tiles(), 2 * first);
    const std::uint64_t again = line.feed.sent_bytes() - bytes;
    // Truth: one tile, and that the others are the same.
    EXPECT_LT(again, tells_truth ? 1200 + 20 * first : 2 * bytes);
    EXPECT_GT(again, tells_truth ? 0 : bytes / 2);
    const local_model::TickContacts& here = line.local->at(line.pose(line.ticks));
    contact_service::ContactService truth = line.plates.remote();
    EXPECT_EQ(here.from_tiles, 1u);
    EXPECT_EQ(here.lacking, 0u);
    EXPECT_NEAR(here.set.contacts[0].depth_m, truth.answer(line.pose(line.ticks)).contacts[0].depth_m, 0.3e-6);
    EXPECT_EQ(line.receiver->malformed(), 0u);
  }
}

TEST(TileTransfer, ATileThatIsSaidToBeTheSameButIsNotHeldIsNone) {
  Line line(0, 0);
  std::array<std::byte, 64> payload;
  const auto part = codecs::encoded_same(0, 5);
  line.receiver->on_tile(std::span(payload).first(codecs::write(codecs::TileMessage{1, part}, payload)));
  EXPECT_EQ(line.receiver->malformed(), 1u);
  EXPECT_EQ(line.cache->given({1, 0}), std::nullopt);
}

// A master whose heights are others now says so with a greater round; the same one again, or an older, says nothing.
TEST(TileTransfer, ANewRoundGetsEverythingAnew) {
  const Line line(0);
  slave_sim::TileFeed feed{std::span(&line.object, 1), line.tool, {}};
  std::uint64_t sent = 0;
  for (std::int64_t tick = 1; const std::uint32_t round : {1u, 2u, 2u, 1u}) {
    feed.on_request(request(round));
    for (const std::int64_t end = tick + 100; tick < end; ++tick) {
      feed.aim(line.pose(0), 0, 0, tick * kTick_ns);
      drain(feed, tick * kTick_ns);
    }
    if (sent == 0) sent = feed.sent_tiles();
    EXPECT_GT(sent, 0u);
  }
  EXPECT_EQ(feed.sent_tiles(), 2 * sent);
}

// What came is not sent again: a haptic thread that stands still loses no tile.
TEST(TileTransfer, WhatTheCacheHasNoRoomForWaits) {
  Line line(0);
  geometry::HeightTile tile = line.plates.table.tiles[0];
  for (tile.version = 1; tile.version <= 600; ++tile.version) {
    tile.coefficients[0] = static_cast<std::uint16_t>(tile.version);
    for (const auto& part : codecs::encoded_tile(0, tile, codecs::kExactly)) {
      std::vector<std::byte> payload(codecs::kTileHeadBytes + part.size());
      ASSERT_GT(codecs::write(codecs::TileMessage{1, part}, payload), 0u);
      line.receiver->on_tile(payload);
    }
  }
  EXPECT_LT(line.cache->tiles(), 600u);
  const auto newest = [&] { return line.cache->scene().bodies[1].surface.tiles[0]; };
  line.cache->take_arrived(1000);
  EXPECT_LT(newest().version, 600u);
  line.receiver->put_waiting();
  line.cache->take_arrived(1000);
  EXPECT_EQ(newest().version, 600u);
  EXPECT_EQ(newest().coefficients[0], 600u);
}

// A slave that was edited, and killed and started again, knows its first heights, in versions that are older numbers.
TEST(TileTransfer, ARestartedSlavesHeightsReplaceThoseOfTheOldOne) {
  Line line(0, 0);
  const geometry::HapticSurface before = line.plates.table;
  for (std::uint32_t i = 0; i < before.tiles.size(); ++i) {
    geometry::HeightTile tile = before.tiles[i];
    tile.version = 5;
    for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(c / 2);
    line.feed.edit({{1, i}, tile});
  }
  for (int i = 0; i < 1500; ++i) line.tick();
  const double edited_m = line.local->at(line.pose(line.ticks)).set.contacts[0].depth_m;

  for (std::uint32_t i = 0; i < before.tiles.size(); ++i) {
    line.plates.table.tiles[i] = before.tiles[i];
    line.table_felt.take_tile(i);
  }
  line.feed.restart();
  ASSERT_TRUE(line.receiver->begin_epoch());
  EXPECT_FALSE(line.tick()) << "what the old one told is not believed to be current";
  for (int i = 0; i < 1500; ++i) line.tick();
  contact_service::ContactService truth = line.plates.remote();
  const contact::ContactSet& there = truth.answer(line.pose(line.ticks));
  const local_model::TickContacts& here = line.local->at(line.pose(line.ticks));
  ASSERT_EQ(there.count, 1u);
  ASSERT_EQ(here.from_tiles, 1u);
  EXPECT_NEAR(here.set.contacts[0].depth_m, there.contacts[0].depth_m, 0.3e-6);
  EXPECT_GT(here.set.contacts[0].depth_m, edited_m + 0.1e-3);
}

}  // namespace
}  // namespace farfeel::end_to_end
