#include "transport/link/link_spec.h"

#include <gtest/gtest.h>

namespace farfeel::transport {
namespace {

TEST(LinkSpec, ReadsEveryKeyWithItsUnit) {
  const auto spec = parse_link_spec(
      "rtt=100ms jitter=500us loss=1%,burst=4 reorder=0.5% duplicate=0.1% rate=20Mbit queue=0.01s mtu=576");
  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->round_trip_ns, 100'000'000);
  EXPECT_EQ(spec->jitter_ns, 500'000);
  EXPECT_DOUBLE_EQ(spec->loss, 0.01);
  EXPECT_DOUBLE_EQ(spec->burst, 4);
  EXPECT_DOUBLE_EQ(spec->reorder, 0.005);
  EXPECT_DOUBLE_EQ(spec->duplicate, 0.001);
  EXPECT_DOUBLE_EQ(spec->rate_bit_per_s, 20e6);
  EXPECT_EQ(spec->queue_ns, 10'000'000);
  EXPECT_EQ(spec->mtu_bytes, 576u);
}

TEST(LinkSpec, OfNothingDoesNothing) {
  const auto spec = parse_link_spec("  ");
  ASSERT_TRUE(spec);
  EXPECT_EQ(spec->round_trip_ns, 0);
  EXPECT_EQ(spec->loss, 0);
  EXPECT_EQ(to_string(*spec), "");
}

TEST(LinkSpec, ReadsItsOwnWords) {
  const std::string text =
      "rtt=100ms jitter=0.5ms loss=1% burst=4 reorder=0.5% duplicate=0.1% rate=20Mbit queue=10ms mtu=1400";
  EXPECT_EQ(to_string(parse_link_spec(text).value()), text);
}

TEST(LinkSpec, SaysWhatIsWrong) {
  const auto complaint = [](const std::string& text) {
    const auto spec = parse_link_spec(text);
    return spec ? std::string("accepted") : spec.error().message;
  };
  EXPECT_NE(complaint("rtt=5").find("'rtt=5' is not a time"), std::string::npos);
  EXPECT_NE(complaint("rtt=-5ms").find("within 0 and 60 s"), std::string::npos);
  EXPECT_NE(complaint("rtt=nanms").find("is not a time"), std::string::npos);
  EXPECT_NE(complaint("loss=1").find("not a percentage"), std::string::npos);
  EXPECT_NE(complaint("loss=101%").find("within 0 % and 100 %"), std::string::npos);
  EXPECT_NE(complaint("loss=1%,burst=0.5").find("at least 1"), std::string::npos);
  EXPECT_NE(complaint("burst=4").find("needs 'loss'"), std::string::npos);
  EXPECT_NE(complaint("loss=90%,burst=2").find("bursts so short"), std::string::npos);
  EXPECT_NE(complaint("rate=0Mbit").find("at least 1kbit"), std::string::npos);
  EXPECT_NE(complaint("mtu=20").find("within 68 and 65535 bytes"), std::string::npos);
  EXPECT_NE(complaint("delay=5ms").find("there is no 'delay'"), std::string::npos);
  EXPECT_NE(complaint("rt=5ms").find("there is no 'rt'; did you mean 'rtt'?"), std::string::npos);
  EXPECT_EQ(complaint("delay=5ms").find("did you mean"), std::string::npos);
  EXPECT_NE(complaint("rtt=5ms rtt=6ms").find("said twice"), std::string::npos);
  EXPECT_NE(complaint("fast").find("not KEY=VALUE"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::transport
