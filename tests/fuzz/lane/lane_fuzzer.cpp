// A history of two ends of a lane and of somebody between them who has no keys. First u8: the suite, and where the
// counters begin. Then entries, u8 what:
//   what % 8 = 0, 1: the initiator, the responder seals a message of the next u8 bytes, which is kept
//   2: a kept one arrives, by u8; 3: it arrives with the byte at u16 changed by u8; 4: it arrives cut to u16 bytes
//   5: so many bytes as they are arrive, u8 and the bytes; 6: a handshake; 7: time passes, u8 seconds
// What is opened is what the other end sealed, byte for byte, once, and the newest is newer than all before.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <vector>

#include "transport/bytes/byte_cursor.h"
#include "transport/lane/sealed_lane.h"

using namespace farfeel::transport;

namespace {

void demand(bool is_so) {
  if (!is_so) std::abort();
}

struct Kept {
  std::size_t from = 0;
  std::vector<std::byte> datagram, message;
  std::uint64_t number = 0;
  bool was_opened = false;
};

struct Ends {
  explicit Ends(std::uint8_t how) : suite(how & 1 ? Suite::kAesGcm : Suite::kChaChaPoly), is_late(how & 2) {
    if (!is_available(suite)) suite = Suite::kChaChaPoly;
    shake();
  }
  void shake() {
    LaneKeys keys;
    keys.generation = ++generation;
    keys.suite = suite;
    keys.local_index = static_cast<std::uint32_t>(2 * generation);
    keys.remote_index = keys.local_index + 1;
    keys.send.fill(static_cast<std::byte>(generation));
    keys.receive.fill(static_cast<std::byte>(~generation));
    keys.made_ns = now_ns;
    lanes[0].adopt(keys);
    std::swap(keys.send, keys.receive);
    std::swap(keys.local_index, keys.remote_index);
    lanes[1].adopt(keys);
  }
  void seal(std::size_t from, std::size_t bytes) {
    constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
    if (is_late) lanes[from].skip_to(kLast - 20);
    Kept one;
    one.from = from;
    one.message.resize(bytes + 8);
    ByteWriter(one.message).u64(one.number = kept.size());
    one.datagram.resize(kMaxDatagramBytes);
    one.datagram.resize(lanes[from].seal(16, one.message, one.datagram, now_ns));
    if (one.datagram.empty()) return;
    const std::uint64_t counter = ByteReader(std::span(one.datagram).subspan(8)).u64();
    demand(used.emplace(std::pair(receiver_index(one.datagram), counter), from).second);
    kept.push_back(std::move(one));
  }
  /// true_one: that the bytes are equal to, if they are.
  void arrive(std::size_t to, std::vector<std::byte> bytes, Kept* true_one) {
    const auto opened = lanes[to].open(bytes, now_ns);
    if (!opened) return;
    demand(true_one != nullptr && true_one->from != to && !true_one->was_opened && opened->type == 16);
    demand(std::ranges::equal(opened->message, true_one->message));
    true_one->was_opened = true;
    if (opened->is_newest) {
      demand(!has_newest[to] || true_one->number > newest[to]);
      newest[to] = true_one->number;
      has_newest[to] = true;
    }
  }
  Suite suite;
  bool is_late;
  std::uint64_t generation = 0;
  std::int64_t now_ns = 1;
  std::array<SealedLane, 2> lanes{SealedLane(SealedLane::Role::kInitiator), SealedLane(SealedLane::Role::kResponder)};
  std::vector<Kept> kept;
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::size_t> used;
  std::array<std::uint64_t, 2> newest{};
  std::array<bool, 2> has_newest{};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  std::size_t at = 0;
  const auto u8 = [&]() -> std::uint8_t { return at < size ? bytes[at++] : 0; };
  const auto u16 = [&] {
    const std::size_t low = u8();
    return low | static_cast<std::size_t>(u8()) << 8;
  };
  Ends ends(u8());
  for (int entries = 0; at < size && entries < 500; ++entries) {
    const std::uint8_t what = u8();
    const std::size_t to = what >> 7;
    switch (what % 8) {
      case 0:
      case 1:
        ends.seal(what % 8, u8());
        break;
      case 5: {
        std::vector<std::byte> junk(u8());
        for (std::byte& b : junk) b = static_cast<std::byte>(u8());
        ends.arrive(to, junk, nullptr);
        break;
      }
      case 6:
        ends.shake();
        break;
      case 7:
        ends.now_ns += std::int64_t{u8()} * 1'000'000'000;
        break;
      default: {
        if (ends.kept.empty()) break;
        Kept& one = ends.kept[u8() % ends.kept.size()];
        auto datagram = one.datagram;
        if (what % 8 == 3) datagram[u16() % datagram.size()] ^= static_cast<std::byte>(u8());
        if (what % 8 == 4) datagram.resize(u16() % (datagram.size() + 1));
        ends.arrive(to, datagram, datagram == one.datagram ? &one : nullptr);
      }
    }
  }
  return 0;
}
