// Every method of `farfeel-bench link` carries what it is given, both ways. No time is asserted.
#include "tests/bench/link_turn.h"

#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::bench {
namespace {

struct Case {
  const char* name;
  std::function<MadeMethod(const TwoEnds&)> make;
};

void PrintTo(const Case& of, std::ostream* out) {
  *out << of.name;
}

std::vector<Case> cases() {
  using transport::Suite;
  return {{"ours_aes", [](const TwoEnds& e) { return make_ours(e, Suite::kAesGcm); }},
          {"ours_chacha", [](const TwoEnds& e) { return make_ours(e, Suite::kChaChaPoly); }},
          {"raw_udp", [](const TwoEnds& e) { return make_raw_udp(e); }},
          {"enet", [](const TwoEnds& e) { return make_enet(e); }},
          {"ngtcp2_aes", [](const TwoEnds& e) { return make_ngtcp2(e, Suite::kAesGcm); }},
          {"ngtcp2_chacha", [](const TwoEnds& e) { return make_ngtcp2(e, Suite::kChaChaPoly); }}};
}

const TwoEnds& ends() {
  static const TwoEnds made;
  return made;
}

/// What `from` sends, `to` has within two seconds, unchanged. A datagram may be lost: it is sent again.
void expect_carried(LinkEnd& from, LinkEnd& to, std::size_t bytes, unsigned seed) {
  std::vector<std::byte> message(bytes), received(1500);
  for (std::size_t i = 0; i < bytes; ++i) message[i] = static_cast<std::byte>(i * 7 + seed);
  std::size_t size = 0;
  for (int i = 0; i < 100 && size == 0; ++i) {
    EXPECT_TRUE(from.send(message));
    to.wait_until(realtime::monotonic_now_ns() + 20'000'000);
    for (int k = 0; k < 10 && size == 0; ++k) size = to.receive(received);
  }
  received.resize(size);
  EXPECT_EQ(received, message);
}

class LinkMethods : public testing::TestWithParam<Case> {};

TEST_P(LinkMethods, CarryMessagesBothWays) {
  auto made = GetParam().make(ends());
  if (!made) GTEST_SKIP() << made.error();
  LinkMethod& method = **made;
  for (unsigned turn = 0; turn < 3; ++turn) {
    method.begin_turn();
    for (const std::size_t bytes : {8u, 52u, 116u, 287u, 791u}) {
      expect_carried(method.master(), method.slave(), bytes, turn);  // the master speaks first
      expect_carried(method.slave(), method.master(), bytes, turn + 1);
    }
  }
}

TEST_P(LinkMethods, CountEachRoundTripOfATurn) {
  auto made = GetParam().make(ends());
  if (!made) GTEST_SKIP() << made.error();
  for (const Turn turn : {Turn{52, 287, 50}, Turn{116, 791, 50}}) {
    const TurnResult result = run_turn(**made, turn);
    EXPECT_EQ(result.rtt_us.size() + static_cast<std::size_t>(result.lost), 50u);
    EXPECT_GT(result.rtt_us.size(), 25u);
    for (const double rtt : result.rtt_us) EXPECT_GT(rtt, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, LinkMethods, testing::ValuesIn(cases()), [](const auto& of) { return of.param.name; });

}  // namespace
}  // namespace farfeel::bench
