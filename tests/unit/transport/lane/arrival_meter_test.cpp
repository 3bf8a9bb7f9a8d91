#include "transport/lane/arrival_meter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace farfeel::transport {
namespace {

TEST(ArrivalMeter, TellsTheSameAsALookAtAllArrivals) {
  std::mt19937 random(5);
  for (const std::uint32_t between_clocks_us : {0u, 12'345u, 0xFFFF'0000u}) {
    ArrivalMeter meter;
    struct Arrival {
      double at_us, transit_us;
    };
    std::vector<Arrival> all;
    double jitter = 0, most = 0;
    double at_us = 4'290'000'000.0;  // wraps on the way
    for (int i = 0; i < 20'000; ++i) {
      at_us += 1000;
      const double transit_us = 20'000 + static_cast<double>(random() % 3000) + (i > 12'000 ? 4'000 : 0);
      const auto arrived = static_cast<std::uint32_t>(static_cast<std::uint64_t>(at_us));
      meter.on_transit(arrived - static_cast<std::uint32_t>(transit_us) + between_clocks_us, arrived);
      if (!all.empty()) jitter += (std::abs(transit_us - all.back().transit_us) - jitter) / 16;
      all.push_back({at_us, transit_us});
      // The window is between 1.75 and 2 s; the least of 1,750 arrivals is the least of 2,000 to some us.
      double least = transit_us;
      for (auto a = all.rbegin(); a != all.rend() && a->at_us > at_us - 1'750'000; ++a)
        least = std::min(least, a->transit_us);
      most = std::max(most, transit_us - least);
    }
    EXPECT_NEAR(meter.jitter_us(), jitter, 1e-6 * jitter);
    EXPECT_EQ(meter.excess().count(), 20'000u);
    EXPECT_NEAR(static_cast<double>(meter.excess().max_ns()), 1000 * most, 20'000);
    EXPECT_GT(most, 6000) << "the step of 4 ms, until the window forgets what was before";
    EXPECT_LT(static_cast<double>(meter.excess().quantile_ns(0.7)), 3.2e6);
  }
}

TEST(ArrivalMeter, ForgetsTheLeastAfterAPause) {
  ArrivalMeter meter;
  meter.on_transit(0, 1000);
  meter.on_transit(10'000'000, 10'050'000);
  EXPECT_EQ(meter.excess().max_ns(), 0);
  meter.on_transit(10'100'000, 10'151'000);
  EXPECT_EQ(meter.excess().max_ns(), 1'000'000);
}

TEST(ArrivalMeter, CountsBytesAndMarks) {
  ArrivalMeter meter;
  EXPECT_EQ(meter.dscp(), -1);
  std::array<std::byte, 50> bytes{};
  Received received;
  received.bytes = bytes;
  meter.on_datagram(received);
  received.has_marking = true;
  received.dscp = 46;
  received.ecn = Ecn::kCongestion;
  meter.on_datagram(received);
  EXPECT_EQ(meter.bytes(), 100u);
  EXPECT_EQ(meter.dscp(), 46);
  EXPECT_EQ(meter.congestion_marks(), 1u);
}

}  // namespace
}  // namespace farfeel::transport
