#include "codecs/device/ftdi.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace farfeel::codecs {
namespace {

TEST(FtdiPayload, leaves_out_two_bytes_at_each_start_of_64) {
  for (std::size_t size = 0; size <= 256; ++size) {
    std::vector<std::byte> transfer(size), wanted;
    for (std::size_t i = 0; i < size; ++i) {
      transfer[i] = static_cast<std::byte>(i);
      if (i % 64 >= 2) wanted.push_back(transfer[i]);
    }
    std::vector<std::byte> got(256);
    got.resize(ftdi_payload(transfer, got));
    EXPECT_EQ(got, wanted) << size;
  }
}

TEST(FtdiPayload, never_writes_past_its_end) {
  const std::vector<std::byte> transfer(512, std::byte{7});
  for (std::size_t room = 0; room < 100; ++room) {
    std::vector<std::byte> got(room);  // exactly so large: a sanitizer sees one byte more
    EXPECT_EQ(ftdi_payload(transfer, got), room);
  }
}

}  // namespace
}  // namespace farfeel::codecs
