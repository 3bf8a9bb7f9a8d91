// An end that has the other's keys and means ill, on the bulk lane: what it can cost, and what it is believed.

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/unit/transport/simulated_session.h"

namespace farfeel::transport {
namespace {

/// What this process holds in memory [bytes].
std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// The bytes that follow the type, for send_message().
template <typename Message>
void say(SimulatedSession& world, const Message& message) {
  MessageBuffer buffer;
  const auto bytes = write(message, std::span(buffer));
  world.server->send_message(static_cast<MessageType>(bytes[0]), bytes.subspan(1), world.now(), world.to_master);
}

ObjectHash some_hash(std::uint64_t seed) {
  return hash_of(std::as_bytes(std::span(&seed, 1)));
}

// 37 kB of offers a second, each of another object of the greatest size: nothing is written to for them, and all that
// they hold is within the master's budget.
TEST(HostilePeer, ASlavesOffersTakeNoMemoryAndFewAnswers) {
  SimulatedSession world;
  world.seconds_until_up(5);
  const std::uint64_t before = resident_bytes();
  std::uint32_t id = 100;
  std::size_t up_bytes = 0;
  const auto to_slave = world.to_slave;
  world.to_slave = [&](LaneKind lane, std::span<const std::byte> d) {
    if (lane == LaneKind::kBulk) up_bytes += d.size();
    to_slave(lane, d);
  };
  constexpr std::size_t kOfferBytes = 51 + kSealBytes - 1;
  std::size_t down_bytes = 0;
  for (int ms = 0; ms < 4000; ++ms) {
    for (; down_bytes < 37u * static_cast<std::size_t>(ms); down_bytes += kOfferBytes) {
      say(world, ObjectOffer{++id, id % 3, 1, kMaxObjectBytes, some_hash(id)});
    }
    world.step();
    ASSERT_LE(world.client->bulk().inbox().progress().all, 3 * kMaxObjectBytes);
  }
  EXPECT_GT(id, 1500u);
  // One object that was written to would be 64 MiB. Sanitizers keep some 30 of their own.
  EXPECT_LE(resident_bytes(), before + (48u << 20));
  EXPECT_LE(up_bytes, 2 * down_bytes);
  EXPECT_TRUE(world.is_up() || world.client->is_heard(world.now()));
  EXPECT_EQ(world.scene_here(), world.object->bytes) << "what is in use stays";
}

// An older offer, however late, and a withdrawal of another change nothing of what is under way.
TEST(HostilePeer, LateOffersDoNotResetANewerTransfer) {
  SimulatedSession world("rtt=20ms rate=2Mbit", 1);
  world.start_slave(some_object(1, 400'000));
  world.object = some_object(2, 400'000);
  world.server->bulk().outbox().offer(kSceneSlot, world.object, kSceneUrgency, world.now());  // id 2
  ASSERT_LT(world.seconds_until(5, [&] { return world.client->progress() > 0.3; }), 5);
  double progress = world.client->progress();
  while (world.client->progress() < 1) {
    say(world, ObjectOffer{1, kSceneSlot, 7, 1000, some_hash(7)});
    say(world, ObjectWithdrawal{77});
    world.step();
    ASSERT_GE(world.client->progress(), progress);
    progress = world.client->progress();
    ASSERT_LT(world.now(), 20'000'000'000);
  }
  EXPECT_EQ(world.scene_here(), world.object->bytes);
}

/// The master says that these have arrived: `length` numbers up to newest, which was sent at that time.
void acknowledge(SimulatedSession& world, std::uint64_t newest, std::int64_t sent_ns, std::uint16_t length) {
  Receipt lie;
  lie.newest = static_cast<std::uint32_t>(newest);
  lie.echo_us = static_cast<std::uint32_t>(sent_ns / 1000);
  lie.arrival_us = lie.echo_us;
  lie.ranges = 1;
  lie.range[0] = {0, length};
  MessageBuffer buffer;
  const auto bytes = write(lie, std::span(buffer));
  world.client->send_message(static_cast<MessageType>(bytes[0]), bytes.subspan(1), world.now(), world.to_slave);
}

/// The scene is under way, and a message has just left.
struct UnderWay : SimulatedSession {
  UnderWay() : SimulatedSession("rtt=20ms rate=2Mbit") {
    start_slave(some_object(1, 1'000'000));
    seconds_until(5, [&] { return client->progress() > 0.3; });
    sent_before = server->bulk().counters().sent;
    seconds_until(1, [&] { return server->bulk().counters().sent > sent_before; });
    sent_before = server->bulk().counters().sent;
    newest = server->bulk().sent().next_number() - 1;
  }
  void expect_end() {
    EXPECT_LE(seconds_until(1, [&] { return !server->session(); }), 0.03);
    EXPECT_NE(server->last_end().find("acknowledged what was never sent"), std::string::npos) << server->last_end();
    // It was not believed: no more left than true receipts allow in that time.
    EXPECT_LE(server->bulk().counters().sent - sent_before, 20u);
    run(0.03);
    EXPECT_NE(client->trouble(now()).find("never sent"), std::string::npos) << client->trouble(now());
    // A true master may come again, and goes on where it was.
    const double progress = client->progress();
    EXPECT_GT(progress, 0.2);
    EXPECT_LT(seconds_until_up(20), 20);
    EXPECT_EQ(scene_here(), object->bytes);
  }
  std::uint64_t sent_before = 0, newest = 0;
};

TEST(HostilePeer, ReceiptsOfWhatWasNotYetSentEndTheSession) {
  UnderWay world;
  acknowledge(world, world.newest + 500, world.now(), 1000);
  world.expect_end();
}

// Some numbers are left out: who acknowledges what it did not get finds one of them before long.
TEST(HostilePeer, ReceiptsOfNumbersThatWereLeftOutEndTheSession) {
  UnderWay world;
  acknowledge(world, world.newest, world.now(), 100);
  world.expect_end();
}

// Who did not get the newest one does not know when it was sent: believed is only who does.
TEST(HostilePeer, ReceiptsWithoutTheTimeOfSendingAreNotBelieved) {
  UnderWay world;
  const auto& lane = world.server->bulk();
  for (int i = 1; i <= 20; ++i) acknowledge(world, world.newest, world.now() + 1'000 * i, 1);
  const std::uint64_t before = lane.sent().disbelieved_receipts();
  world.run(0.03);
  EXPECT_GE(lane.sent().disbelieved_receipts(), before + 20);
  EXPECT_TRUE(world.server->session());
  EXPECT_LE(lane.counters().sent - world.sent_before, 30u);
  EXPECT_LT(world.seconds_until_up(20), 20);
}

// The same from the other side: a slave that acknowledges what a master never sent.
TEST(HostilePeer, AMasterLeavesASlaveThatLies) {
  SimulatedSession world;
  world.seconds_until_up(5);
  Receipt lie;
  lie.newest = 5;
  lie.ranges = 1;
  lie.range[0] = {0, 1};
  say(world, lie);
  const std::uint32_t session = world.client->session();
  EXPECT_LE(world.seconds_until(1, [&] { return world.client->session() != session; }), 0.02);
  EXPECT_NE(world.client->trouble(world.now()).find("never sent"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::transport
