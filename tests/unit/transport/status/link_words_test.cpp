#include "transport/status/link_words.h"

#include <gtest/gtest.h>

namespace farfeel::transport {
namespace {

constexpr double kFelt_ms = 1250;

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

/// A session of a link for so long, looked at four times a second: all that is said.
class Session {
 public:
  double least_ms = 1, p50_ms = 1, p99_ms = 2;
  double poses_lost = 0, contacts_lost = 0;  // shares

  std::string said(double seconds) {
    std::string all;
    for (double end_s = now_s_ + seconds; now_s_ < end_s; now_s_ += 0.25) {
      LinkStatus s;
      s.haptic.is_used = true;
      sent_ += 250;
      up_lost_ += 250 * poses_lost;
      down_lost_ += 250 * contacts_lost;
      s.haptic.round_trip = {p50_ms, p99_ms, p99_ms, sent_, least_ms};
      s.haptic.up.sent = sent_;
      s.haptic.up.sent_bytes = sent_ * 72;
      s.haptic.up.lost = static_cast<std::uint64_t>(up_lost_);
      s.haptic.up.arrived = sent_ - s.haptic.up.lost;
      s.haptic.down.lost = static_cast<std::uint64_t>(down_lost_);
      s.haptic.down.arrived = sent_ - s.haptic.down.lost;
      s.haptic.down.arrived_bytes = s.haptic.down.arrived * 125;
      if (const auto words = words_.look(s, now_s_)) all += *words + "\n";
    }
    return all;
  }

 private:
  LinkWords words_{kFelt_ms};
  double now_s_ = 100, up_lost_ = 0, down_lost_ = 0;
  std::uint64_t sent_ = 0;
};

TEST(LinkWords, OfAGoodLinkNothingIsSaid) {
  Session session;
  EXPECT_EQ(session.said(20), "");
  session.p50_ms = 60, session.p99_ms = 400;  // the machine stood still now and then
  EXPECT_EQ(session.said(20), "");
  session.poses_lost = 0.02;
  session.p50_ms = 1;
  EXPECT_EQ(session.said(20), "");
}

TEST(LinkWords, ALinkThatIsTooFarIsToldOnceWithItsRoundTrip) {
  Session session;
  session.least_ms = 1200, session.p50_ms = 1210, session.p99_ms = 1300;
  EXPECT_EQ(session.said(5), "");
  session.least_ms = 1500, session.p50_ms = session.p99_ms = 1510;
  const std::string said = session.said(30);
  EXPECT_TRUE(says(said, "takes 1.50 s, and what is older than 1.25 s is not felt")) << said;
  EXPECT_EQ(said.find('\n'), said.size() - 1) << said;
}

TEST(LinkWords, ALinkThatIsTooNarrowIsToldWithWhatItCarries) {
  Session session;
  session.least_ms = 60, session.p50_ms = 461, session.p99_ms = 480;
  session.contacts_lost = 0.54;
  const std::string said = session.said(30);
  EXPECT_TRUE(says(said, "grown from 60 to 461 ms")) << said;
  EXPECT_TRUE(says(said, "54 % of the contacts are lost")) << said;
  EXPECT_TRUE(says(said, "sends 0.80 Mbit/s and gets 0.46")) << said;  // 1000 of 72 + 28 bytes; 460 of 125
  EXPECT_TRUE(says(said, "--rate 250")) << said;
  EXPECT_EQ(said.find('\n'), said.size() - 1) << said;
}

TEST(LinkWords, LossOfALinkThatIsNotFullIsToldAsThat) {
  Session session;
  session.least_ms = 20, session.p50_ms = 21;
  session.poses_lost = 0.1;
  const std::string said = session.said(30);
  EXPECT_TRUE(says(said, "10 % of the poses and 0 % of the contacts are lost")) << said;
  EXPECT_TRUE(says(said, "stays at 21.0 ms")) << said;
  EXPECT_FALSE(says(said, "too narrow")) << said;
}

TEST(LinkWords, ASceneThatDoesNotComeIsExplained) {
  EXPECT_TRUE(says(why_no_scene({10, 0, 5, 40, 548, ""}), "none longer than 548 bytes"));
  EXPECT_TRUE(says(why_no_scene({10, 0, 5, 40, 548, ""}), "MTU of 1280"));
  EXPECT_TRUE(says(why_no_scene({10, 0.3, 5, 400, 1232, ""}), "30 % of it came, and nothing more for 10 s"));
  EXPECT_TRUE(says(why_no_scene({10, 0.3, 3000, 4, 1232, "nothing was heard from the slave for 2 s"}), "took 3.00 s"));
}

}  // namespace
}  // namespace farfeel::transport
