// What is sealed comes out as it went in, once, and nothing else comes out.

#include "transport/lane/sealed_lane.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <limits>
#include <set>
#include <vector>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

Key32 key_of(std::uint8_t fill) {
  Key32 key;
  key.fill(static_cast<std::byte>(fill));
  return key;
}

/// Both ends of a lane, after so many handshakes.
struct Ends {
  explicit Ends(Suite with = Suite::kChaChaPoly) : suite(with) { shake(); }
  LaneKeys keys(bool is_initiator) const {
    const auto fill = static_cast<std::uint8_t>(2 * generation);
    LaneKeys made{generation,
                  suite,
                  2 * static_cast<std::uint32_t>(generation),
                  2 * static_cast<std::uint32_t>(generation) + 1000,
                  key_of(fill),
                  key_of(static_cast<std::uint8_t>(fill + 1)),
                  now,
                  9,
                  5};
    if (is_initiator) return made;
    std::swap(made.send, made.receive);
    std::swap(made.local_index, made.remote_index);
    return made;
  }
  void shake() {
    ++generation;
    responder.adopt(keys(false));
    initiator.adopt(keys(true));
  }
  static std::vector<std::byte> sealed(SealedLane& by, std::uint8_t type, std::size_t bytes, std::int64_t now_ns) {
    std::vector<std::byte> message(bytes, std::byte{0x5A}), datagram(kMaxDatagramBytes);
    datagram.resize(by.seal(type, message, datagram, now_ns));
    return datagram;
  }
  Suite suite;
  std::uint64_t generation = 0;
  std::int64_t now = 1;
  SealedLane initiator{SealedLane::Role::kInitiator}, responder{SealedLane::Role::kResponder};
};

std::vector<Suite> suites() {
  if (is_available(Suite::kAesGcm)) return {Suite::kAesGcm, Suite::kChaChaPoly};
  return {Suite::kChaChaPoly};
}

TEST(SealedLane, CarriesMessagesBothWays) {
  for (const Suite suite : suites()) {
    Ends ends(suite);
    EXPECT_FALSE(ends.responder.can_send(ends.now)) << "nobody has shown to hold the keys";
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{116}, kMaxMessageBytes}) {
      auto up = Ends::sealed(ends.initiator, 16, bytes, ends.now);
      ASSERT_EQ(up.size(), bytes + kSealBytes);
      const auto opened = ends.responder.open(up, ends.now);
      ASSERT_TRUE(opened);
      EXPECT_EQ(opened->type, 16);
      EXPECT_EQ(opened->message.size(), bytes);
      EXPECT_TRUE(opened->is_newest);
      EXPECT_EQ(opened->session, 5u);
      auto down = Ends::sealed(ends.responder, 17, bytes, ends.now);
      EXPECT_TRUE(ends.initiator.open(down, ends.now));
    }
    EXPECT_EQ(Ends::sealed(ends.initiator, 16, kMaxMessageBytes + 1, ends.now).size(), 0u);
  }
}

TEST(SealedLane, OpensNothingThatWasChanged) {
  for (const Suite suite : suites()) {
    Ends ends(suite);
    const auto whole = Ends::sealed(ends.initiator, 16, 40, ends.now);
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const unsigned flip : {1u, 0x80u, 0xFFu}) {
        auto bent = whole;
        bent[at] ^= static_cast<std::byte>(flip);
        ASSERT_FALSE(ends.responder.open(bent, ends.now)) << at;
      }
    }
    for (std::size_t size = 0; size < whole.size(); ++size) {
      auto cut = whole;
      cut.resize(size);
      ASSERT_FALSE(ends.responder.open(cut, ends.now)) << size;
    }
    EXPECT_FALSE(ends.responder.can_send(ends.now));
    const LaneRejects& rejects = ends.responder.rejects();
    EXPECT_EQ(rejects.malformed + rejects.unknown_index + rejects.forged, 4 * whole.size());
    auto first = whole, again = whole;
    EXPECT_TRUE(ends.responder.open(first, ends.now)) << "forged counters have not moved the window";
    EXPECT_FALSE(ends.responder.open(again, ends.now)) << "a replay";
    EXPECT_EQ(ends.responder.counters().duplicate, 1u);
    auto own = Ends::sealed(ends.responder, 17, 40, ends.now);
    EXPECT_FALSE(ends.responder.open(own, ends.now)) << "its own, sent back";
  }
}

TEST(SealedLane, ChangesKeysWithoutLosingWhatIsUnderWay) {
  Ends ends;
  auto first = Ends::sealed(ends.initiator, 16, 8, ends.now);
  ASSERT_TRUE(ends.responder.open(first, ends.now));
  auto old_up = Ends::sealed(ends.initiator, 16, 8, ends.now), old_down = Ends::sealed(ends.responder, 17, 8, ends.now);
  ends.shake();
  EXPECT_EQ(ends.initiator.sending_generation(), 2u);
  EXPECT_EQ(ends.responder.sending_generation(), 1u) << "until the initiator is heard with the new keys";
  auto new_up = Ends::sealed(ends.initiator, 16, 8, ends.now);
  const auto opened_new = ends.responder.open(new_up, ends.now);
  ASSERT_TRUE(opened_new && opened_new->is_newest);
  EXPECT_EQ(ends.responder.sending_generation(), 2u);
  const auto opened_old = ends.responder.open(old_up, ends.now);
  ASSERT_TRUE(opened_old);
  EXPECT_FALSE(opened_old->is_newest) << "older keys are older news";
  EXPECT_TRUE(ends.initiator.open(old_down, ends.now));
  EXPECT_EQ(ends.responder.counters().received, 3u);
}

TEST(SealedLane, KeysDieAfterTheirLife) {
  Ends ends;
  auto up = Ends::sealed(ends.initiator, 16, 8, ends.now), late = Ends::sealed(ends.initiator, 16, 8, ends.now);
  ASSERT_TRUE(ends.responder.open(up, ends.now));
  EXPECT_EQ(Ends::sealed(ends.initiator, 16, 8, ends.now + kKeyLife_ns).size(), 0u);
  EXPECT_EQ(Ends::sealed(ends.responder, 16, 8, ends.now + kKeyLife_ns).size(), 0u);
  EXPECT_FALSE(ends.responder.open(late, ends.now + kKeyLife_ns));
}

// The nonce is the key's and the counter's: both together must never come twice.
TEST(SealedLane, NeverUsesACounterTwiceWithAKey) {
  Ends ends;
  std::set<std::pair<std::uint32_t, std::uint64_t>> used;
  for (int i = 0; i < 1000; ++i) {
    if (i % 100 == 99) ends.shake();
    if (i % 7 == 0) ends.initiator.adopt(ends.keys(true));  // the same handshake again is no news
    const auto datagram = Ends::sealed(ends.initiator, 16, 8, ends.now);
    const std::uint64_t counter = ByteReader(std::span(datagram).subspan(8)).u64();
    EXPECT_TRUE(used.emplace(receiver_index(datagram), counter).second);
  }
}

// Counters end before they wrap: the lane says that it cannot send, and the next keys begin anew.
TEST(SealedLane, StopsBeforeItsCountersWrap) {
  constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
  for (const Suite suite : suites()) {
    Ends ends(suite);
    ends.initiator.skip_to(kLast - 3);
    ends.initiator.skip_to(5);  // never back
    for (std::uint64_t counter = kLast - 3; counter < kLast; ++counter) {
      ASSERT_TRUE(ends.initiator.can_send(ends.now));
      auto datagram = Ends::sealed(ends.initiator, 16, 8, ends.now);
      EXPECT_EQ(ByteReader(std::span(datagram).subspan(8)).u64(), counter);
      auto again = datagram;
      const auto opened = ends.responder.open(datagram, ends.now);
      EXPECT_TRUE(opened && opened->is_newest);
      EXPECT_FALSE(ends.responder.open(again, ends.now));
    }
    EXPECT_FALSE(ends.initiator.can_send(ends.now));
    EXPECT_EQ(Ends::sealed(ends.initiator, 16, 8, ends.now).size(), 0u);
    EXPECT_TRUE(ends.responder.can_send(ends.now)) << "its counters are others";
    ends.shake();
    auto datagram = Ends::sealed(ends.initiator, 16, 8, ends.now);
    EXPECT_EQ(ByteReader(std::span(datagram).subspan(8)).u64(), 0u);
    const auto opened = ends.responder.open(datagram, ends.now);
    EXPECT_TRUE(opened && opened->is_newest);
  }
}

// Two processes must not make the same keys either: what is random differs between a child and its parent.
TEST(SealedLane, AChildProcessMakesOtherKeysThanItsParent) {
  (void)new_key_pair();
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const Key32 key = new_key_pair().public_key;
    _exit(write(ends[1], key.data(), key.size()) == static_cast<ssize_t>(key.size()) ? 0 : 1);
  }
  const Key32 own = new_key_pair().public_key;
  Key32 other{};
  ASSERT_EQ(read(ends[0], other.data(), other.size()), static_cast<ssize_t>(other.size()));
  EXPECT_NE(own, other);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(SealedLane, AChildProcessDoesNotSealWithItsParentsKeys) {
  Ends ends;
  ASSERT_GT(Ends::sealed(ends.initiator, 16, 8, ends.now).size(), 0u);
  const pid_t child = fork();
  if (child == 0) _exit(Ends::sealed(ends.initiator, 16, 8, ends.now).empty() ? 0 : 1);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_GT(Ends::sealed(ends.initiator, 16, 8, ends.now).size(), 0u);
}

}  // namespace
}  // namespace farfeel::transport
