#include "transport/object_transfer.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/transport/simulated_network.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kStep_ns = 100'000;

std::shared_ptr<const Object> object(std::size_t size, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return make_object(std::move(bytes));
}

/// One transfer over a simulated network, with a byte in front that tells offers, chunks and acknowledgements apart.
struct Transfer {
  Transfer(std::shared_ptr<const Object> what, const std::string& link, std::uint64_t seed)
      : sender(1, std::move(what)), network(parse_link_spec(link).value(), seed) {}

  void step() {
    PayloadBuffer payload;
    network.now_ns += kStep_ns;
    if (!sender.is_wanted() && network.now_ns >= next_offer_ns) {
      next_offer_ns = network.now_ns + 100'000'000;
      send(SimulatedNetwork::kDown, 'o', write(sender.offer(), payload));
    }
    while (const auto chunk = sender.next_chunk(network.now_ns)) {
      ++chunks_sent;
      send(SimulatedNetwork::kDown, 'c', write(*chunk, payload));
    }
    bool has_news = false;
    network.deliver(SimulatedNetwork::kDown, [&](std::span<const std::byte> d) {
      if (d[0] == std::byte{'o'}) receiver.on_offer(read_offer(d.subspan(1)).value());
      if (d[0] == std::byte{'c'}) receiver.on_chunk(read_chunk(d.subspan(1)).value(), network.now_ns);
      has_news = true;
    });
    if (has_news && receiver.has_offer())
      send(SimulatedNetwork::kUp, 'a', write(receiver.acknowledge(network.now_ns), payload));
    network.deliver(SimulatedNetwork::kUp, [&](std::span<const std::byte> d) {
      sender.on_acknowledge(read_acknowledge(d.subspan(1)).value(), network.now_ns);
    });
  }
  void send(SimulatedNetwork::Direction way, char kind, std::span<const std::byte> payload) {
    std::vector<std::byte> datagram{static_cast<std::byte>(kind)};
    datagram.insert(datagram.end(), payload.begin(), payload.end());
    network.send(way, datagram);
  }
  bool runs_for(double seconds) {
    const std::int64_t until = network.now_ns + static_cast<std::int64_t>(seconds * 1e9);
    while (!sender.is_complete() && network.now_ns < until) step();
    return sender.is_complete();
  }

  ObjectSender sender;
  ObjectReceiver receiver;
  SimulatedNetwork network;
  std::int64_t next_offer_ns = 0;
  std::uint64_t chunks_sent = 0;
};

TEST(ObjectTransfer, DeliversEverySizeWhole) {
  for (const std::size_t size : {std::size_t{1}, kChunkBytes - 1, kChunkBytes, kChunkBytes + 1, 10 * kChunkBytes}) {
    const auto what = object(size);
    Transfer transfer(what, "rtt=2ms", 1);
    ASSERT_TRUE(transfer.runs_for(5)) << size;
    ASSERT_TRUE(transfer.receiver.object());
    EXPECT_EQ(transfer.receiver.object()->bytes, what->bytes);
    EXPECT_EQ(transfer.sender.resent_chunks(), 0u);
  }
}

TEST(ObjectTransfer, SurvivesEveryLinkOfTheMatrix) {
  const auto what = object(300'000);
  for (const char* rtt : {"rtt=0ms", "rtt=20ms", "rtt=100ms"}) {
    for (const char* jitter : {"", " jitter=5ms"}) {
      for (const char* loss : {"", " loss=1%,burst=4", " loss=20%,burst=8"}) {
        for (const char* disorder : {"", " reorder=5% duplicate=5%"}) {
          for (const char* rate : {"", " rate=20Mbit queue=30ms"}) {
            const std::string link = std::string(rtt) + jitter + loss + disorder + rate;
            Transfer transfer(what, link, 42);
            ASSERT_TRUE(transfer.runs_for(60)) << link;
            ASSERT_TRUE(transfer.receiver.object()) << link;
            ASSERT_EQ(transfer.receiver.object()->bytes, what->bytes) << link;
          }
        }
      }
    }
  }
}

TEST(ObjectTransfer, DoesNotTakeReorderingForLoss) {
  Transfer transfer(object(1'000'000), "rtt=40ms reorder=2%", 5);
  ASSERT_TRUE(transfer.runs_for(60));
  EXPECT_LE(transfer.sender.resent_chunks(), 2u);
}

TEST(ObjectTransfer, ResendsLittleMoreThanWasLost) {
  Transfer transfer(object(1'000'000), "rtt=20ms loss=2%", 5);
  ASSERT_TRUE(transfer.runs_for(60));
  EXPECT_LT(static_cast<double>(transfer.sender.resent_chunks()), 0.05 * static_cast<double>(transfer.chunks_sent));
}

// On a busy machine a thread may get the processor a few times a second only.
TEST(ObjectTransfer, IsNotOneChunkAWakeUpWhenWakeUpsAreRare) {
  Transfer transfer(object(1'000'000), "rtt=50ms", 1);
  int wake_ups = 0;
  for (; !transfer.sender.is_complete() && wake_ups < 1000; ++wake_ups) {
    transfer.network.now_ns += 60'000'000;
    transfer.step();
  }
  EXPECT_LT(wake_ups, 100);  // for 870 chunks
}

TEST(ObjectTransfer, ResumesInAnotherSessionWhereItStopped) {
  const auto what = object(1'000'000);
  Transfer transfer(what, "rtt=20ms", 1);
  while (transfer.receiver.progress() < 0.5) transfer.step();
  const std::uint64_t sent_before = transfer.chunks_sent;
  transfer.network.forget_all();
  transfer.sender = ObjectSender(2, what);  // the slave was restarted
  ASSERT_TRUE(transfer.runs_for(60));
  EXPECT_EQ(transfer.receiver.object()->bytes, what->bytes);
  EXPECT_LT(transfer.chunks_sent, chunks_of(what->bytes.size()) * 5 / 4);
  EXPECT_GT(sent_before, 0u);
}

TEST(ObjectTransfer, IsDoneAtOnceWhenTheReceiverHasItAlready) {
  const auto what = object(100'000);
  Transfer transfer(what, "rtt=20ms", 1);
  ASSERT_TRUE(transfer.runs_for(10));
  transfer.sender = ObjectSender(2, what);
  transfer.chunks_sent = 0;
  ASSERT_TRUE(transfer.runs_for(10));
  EXPECT_EQ(transfer.chunks_sent, 0u);
}

TEST(ObjectTransfer, StartsOverForAnotherObject) {
  Transfer transfer(object(100'000, 1), "rtt=20ms", 1);
  ASSERT_TRUE(transfer.runs_for(10));
  const auto other = object(100'000, 2);
  transfer.sender = ObjectSender(2, other);
  transfer.next_offer_ns = 0;
  ASSERT_TRUE(transfer.runs_for(10));
  EXPECT_EQ(transfer.receiver.object()->bytes, other->bytes);
}

TEST(ObjectReceiver, StartsOverWhenTheHashIsWrong) {
  const auto what = object(3 * kChunkBytes);
  ObjectReceiver receiver;
  receiver.on_offer({1, what->bytes.size(), what->hash});
  const auto all = std::span(what->bytes);
  std::vector<std::byte> wrong(kChunkBytes);
  EXPECT_TRUE(receiver.on_chunk({1, 0, 1, wrong}, 1));
  EXPECT_TRUE(receiver.on_chunk({1, 1, 1, all.subspan(kChunkBytes, kChunkBytes)}, 1));
  EXPECT_TRUE(receiver.on_chunk({1, 2, 1, all.subspan(2 * kChunkBytes, kChunkBytes)}, 1));
  EXPECT_FALSE(receiver.object());
  EXPECT_EQ(receiver.corrupt_objects(), 1u);
  EXPECT_EQ(receiver.progress(), 0);
  for (std::uint32_t i = 0; i < 3; ++i) receiver.on_chunk({1, i, 1, all.subspan(i * kChunkBytes, kChunkBytes)}, 1);
  ASSERT_TRUE(receiver.object());
  EXPECT_EQ(receiver.object()->bytes, what->bytes);
}

TEST(ObjectReceiver, IsUnmovedByChunksThatDoNotFitTheOffer) {
  const auto what = object(3 * kChunkBytes + 10);
  ObjectReceiver receiver;
  const std::vector<std::byte> bytes(kChunkBytes);
  EXPECT_FALSE(receiver.on_chunk({1, 0, 1, bytes}, 1));  // before any offer
  receiver.on_offer({1, what->bytes.size(), what->hash});
  EXPECT_FALSE(receiver.on_chunk({2, 0, 1, bytes}, 1));                       // another object
  EXPECT_FALSE(receiver.on_chunk({1, 4, 1, bytes}, 1));                       // beyond the end
  EXPECT_FALSE(receiver.on_chunk({1, 3, 1, bytes}, 1));                       // the last one is short
  EXPECT_FALSE(receiver.on_chunk({1, 0, 1, std::span(bytes).first(10)}, 1));  // the others are not
  EXPECT_EQ(receiver.progress(), 0);
  EXPECT_TRUE(receiver.on_chunk({1, 3, 1, std::span(bytes).first(10)}, 1));
  EXPECT_FALSE(receiver.on_chunk({1, 3, 1, std::span(bytes).first(10)}, 1));  // again
}

TEST(ObjectSender, IsUnmovedByAcknowledgementsOfWhatItNeverSent) {
  ObjectSender sender(1, object(3 * kChunkBytes));
  Acknowledge ack;
  ack.object = 2;
  ack.complete = 3;
  sender.on_acknowledge(ack, 1);
  EXPECT_FALSE(sender.is_wanted());
  ack.object = 1;
  ack.complete = 4;
  sender.on_acknowledge(ack, 1);
  EXPECT_FALSE(sender.is_wanted());
  EXPECT_FALSE(sender.is_complete());
}

}  // namespace
}  // namespace farfeel::transport
