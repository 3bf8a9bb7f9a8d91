// A report descriptor, then reports: u8 length, bytes; ...

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "codecs/device/space_mouse.h"

using namespace farfeel::codecs;

namespace {

void demand(bool is_so) {
  if (!is_so) std::abort();
}

std::span<const std::byte> take(std::span<const std::byte>& from, std::size_t size) {
  const auto taken = from.first(std::min(size, from.size()));
  from = from.subspan(taken.size());
  return taken;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  const auto length = [&] {
    const auto one = take(bytes, 1);
    return one.empty() ? std::size_t{0} : std::to_integer<std::size_t>(one[0]);
  };
  SpaceMouseDecoder decoder(take(bytes, length()));
  while (!bytes.empty()) {
    const SpaceMouseReading before = decoder.reading();
    const bool is_taken = decoder.take(take(bytes, length()));
    demand(is_taken || decoder.reading() == before);
    for (int i = 0; i < 3; ++i) {
      demand(std::abs(decoder.reading().push[i]) <= 1 && std::abs(decoder.reading().turn[i]) <= 1);
    }
  }
  return 0;
}
