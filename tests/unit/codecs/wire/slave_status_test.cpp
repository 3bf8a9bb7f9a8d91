#include "codecs/wire/slave_status.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

namespace farfeel::codecs {
namespace {

TEST(SlaveStatus, ComesBackAndRefusesNonsense) {
  SlaveStatus status{512.5, 1000, 2000, 3000, 10, 20, 30, 1, 2, 3, 4, 5, 6, 7};
  std::array<std::byte, 200> buffer;
  ASSERT_EQ(write(status, buffer), kSlaveStatusBytes);
  SlaveStatus back;
  ASSERT_EQ(read(std::span(buffer).first(kSlaveStatusBytes), back), Fault::kNone);
  EXPECT_EQ(back.contact_hz, 512.5);
  EXPECT_EQ(back.contact_us_max, 3000);
  EXPECT_EQ(back.poses_received, 1u);
  EXPECT_EQ(back.contacts_left_out, 7u);
  EXPECT_EQ(read(std::span(buffer).first(kSlaveStatusBytes - 1), back), Fault::kLength);
  status.contact_hz = -1;
  (void)write(status, buffer);
  EXPECT_EQ(read(std::span(buffer).first(kSlaveStatusBytes), back), Fault::kRange);
  status.contact_hz = std::numeric_limits<double>::quiet_NaN();
  (void)write(status, buffer);
  EXPECT_EQ(read(std::span(buffer).first(kSlaveStatusBytes), back), Fault::kNotFinite);
}

}  // namespace
}  // namespace farfeel::codecs
