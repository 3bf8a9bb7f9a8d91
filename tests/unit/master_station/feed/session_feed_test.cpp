// A session is told over the local socket: the scene once, the newest tick always, and nobody waits for who does not
// read.
#include "master_station/feed/session_feed.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "tests/support/private_folder.h"
#include "tests/support/tiled_plates.h"

namespace farfeel::master_station {
namespace {

class SessionFeedTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ::setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    scene_.name = "plate";
    scene_.tool.visible_T = {{{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}}, {{0, 1, 2}}};
    scene_.objects.push_back({"plate", {}, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}, {}});
    auto feed = SessionFeed::open(scene_, &tiles_, [this](codecs::ViewVerb verb) {
      ++asked_;
      return codecs::ViewAnswer{verb, asked_ > 1, "asked"};
    });
    ASSERT_TRUE(feed) << feed.error();
    feed_ = *std::move(feed);
  }

  void tick(std::uint64_t number) {
    TickRecord record;
    record.number = number;
    record.time_ns = static_cast<std::int64_t>(number) * 1'000'000;
    record.F_hand_W.force_N = {0, 0, static_cast<double>(number)};
    record.pushes.count = 1;
    record.pushes.of[0].force_N = {0, 0, static_cast<float>(number)};
    feed_->add(record);
  }

  static FeedSocket look() {
    auto socket = connect_to_feed(::getpid());
    EXPECT_TRUE(socket) << socket.error();
    return *std::move(socket);
  }

  /// What has come, by kind.
  struct Told {
    int scenes = 0, bodies = 0;
    std::vector<codecs::ViewTick> ticks;
    std::vector<codecs::ViewStatus> status;
    std::vector<codecs::ViewAnswer> answers;
    std::vector<codecs::ViewTiles> tiles;
    std::vector<codecs::ViewPresence> presence;
  };
  static void read_all(const FeedSocket& socket, codecs::MessageStream& stream, Told& told) {
    std::vector<std::byte> piece(1 << 16);
    while (const auto got = socket.receive(piece)) {
      if (*got == 0) break;
      stream.put(std::span(piece).first(*got));
      while (const auto message = stream.next()) {
        told.scenes += codecs::read_view_scene(*message).has_value();
        told.bodies += codecs::read_view_body(*message).has_value();
        if (auto tick = codecs::read_view_tick(*message)) told.ticks.push_back(*std::move(tick));
        if (auto status = codecs::read_view_status(*message)) told.status.push_back(*std::move(status));
        if (auto answer = codecs::read_view_answer(*message)) told.answers.push_back(*std::move(answer));
        if (auto tiles = codecs::read_view_tiles(*message)) told.tiles.push_back(*std::move(tiles));
        if (auto presence = codecs::read_view_presence(*message)) told.presence.push_back(*std::move(presence));
      }
    }
  }

  test_support::PrivateFolder folder_;
  test_support::TiledPlates plates_;
  local_model::TileCache tiles_{plates_.outline()};
  codecs::SceneDescription scene_;
  std::unique_ptr<SessionFeed> feed_;
  int asked_ = 0;
};

TEST_F(SessionFeedTest, TheSocketIsItsUsersAlone) {
  struct stat status {};
  ASSERT_EQ(::stat(feed_path(::getpid())->c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
}

TEST_F(SessionFeedTest, TellsTheSceneOnceAndThenTheNewestTick) {
  const FeedSocket socket = look();
  codecs::MessageStream stream(codecs::kMostViewBytes);
  Told told;
  feed_->flush();
  for (std::uint64_t number = 0; number < 40; ++number) {
    tick(number);
    if (number % 8 == 7) feed_->flush();
    read_all(socket, stream, told);
  }
  EXPECT_EQ(told.scenes, 1);
  EXPECT_EQ(told.bodies, 2);
  ASSERT_EQ(told.ticks.size(), 5U);
  EXPECT_EQ(told.ticks.back().number, 39U);
  ASSERT_EQ(told.ticks.back().pushes.count, 1U);
  EXPECT_EQ(told.ticks.back().pushes.of[0].force_N.z, 39.0F);
  EXPECT_EQ(told.ticks.back().ticks, 8U);
  EXPECT_EQ(told.ticks.back().bins[0].low, 32.0F);
  EXPECT_EQ(told.ticks.back().bins[0].high, 39.0F);
}

TEST_F(SessionFeedTest, WhoDidNotReadGetsTheNewestAndTheBinsOfAllBetween) {
  const FeedSocket socket = look();
  codecs::MessageStream stream(codecs::kMostViewBytes);
  Told told;
  feed_->flush();
  for (std::uint64_t number = 0; number < 60'000; ++number) {  // a minute that nobody reads
    tick(number);
    if (number % 8 == 7) feed_->flush();
  }
  for (int i = 0; i < 100; ++i) {
    read_all(socket, stream, told);
    feed_->flush();
  }
  ASSERT_FALSE(told.ticks.empty());
  EXPECT_LT(told.ticks.size(), 200U);  // that the kernel held
  EXPECT_EQ(told.ticks.back().number, 59'999U);
  std::uint64_t ticks = 0;
  for (const codecs::ViewTick& tick : told.ticks) ticks += tick.ticks;
  EXPECT_EQ(ticks, 60'000U);
}

TEST_F(SessionFeedTest, WordsComeWhenTheyAreNew) {
  const FeedSocket socket = look();
  codecs::MessageStream stream(codecs::kMostViewBytes);
  Told told;
  for (int i = 0; i < 10; ++i) {
    using codecs::ViewTone;
    feed_->tell({i >= 5 ? ViewTone::kTrouble : ViewTone::kQuiet, false, i >= 5 ? "held" : "free", "", {}}, {});
    feed_->flush();
    read_all(socket, stream, told);
  }
  ASSERT_EQ(told.status.size(), 2U);
  EXPECT_EQ(told.status.back().tone, codecs::ViewTone::kTrouble);
  EXPECT_EQ(told.status.back().happened, "held");
}

TEST_F(SessionFeedTest, TellsWhereTilesAreOnceAndWhichAreHereWhenThatChanges) {
  const FeedSocket socket = look();
  codecs::MessageStream stream(codecs::kMostViewBytes);
  Told told;
  const auto run = [&] {
    for (int i = 0; i < 40; ++i) {
      feed_->flush();
      read_all(socket, stream, told);
    }
  };
  run();
  ASSERT_EQ(told.tiles.size(), 2U) << "of the tool, and of the table";
  ASSERT_EQ(told.presence.size(), 1U) << "told once while nothing changes";
  const auto here = [&] { return std::ranges::count(told.presence.back().is_here, true); };
  EXPECT_EQ(told.presence.back().is_here.size(), told.tiles[0].tiles + told.tiles[1].tiles);
  EXPECT_EQ(here(), 0);
  plates_.send_all(tiles_);
  run();
  ASSERT_EQ(told.presence.size(), 2U);
  EXPECT_EQ(here(), std::ssize(told.presence.back().is_here));
  ASSERT_TRUE(tiles_.begin_epoch());
  run();
  EXPECT_EQ(here(), 0) << "of the remote that runs now";
}

TEST_F(SessionFeedTest, TakesWhatIsAskedAndHangsUpOnWhatNobodyUnderstands) {
  const FeedSocket asks = look(), babbles = look();
  const auto ask = codecs::framed(codecs::write_view(codecs::ViewVerb::kResetFault));
  EXPECT_EQ(asks.send(ask), ask.size());
  const std::vector<std::byte> nonsense(64, std::byte{0xFF});
  EXPECT_EQ(babbles.send(nonsense), nonsense.size());
  for (int i = 0; i < 3; ++i) feed_->flush();
  EXPECT_EQ(asked_, 1);
  codecs::MessageStream stream(codecs::kMostViewBytes);
  Told told;
  read_all(asks, stream, told);
  ASSERT_EQ(told.answers.size(), 1U) << "to whoever asked";
  EXPECT_EQ(told.answers[0].verb, codecs::ViewVerb::kResetFault);
  EXPECT_FALSE(told.answers[0].is_done);
  std::vector<std::byte> piece(1 << 16);
  std::optional<std::size_t> got = 1;
  for (int i = 0; i < 100 && got; ++i) got = babbles.receive(piece);
  EXPECT_FALSE(got);
  EXPECT_TRUE(asks.receive(piece));
}

}  // namespace
}  // namespace farfeel::master_station
