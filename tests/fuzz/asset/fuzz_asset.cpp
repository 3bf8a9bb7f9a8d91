// Any bytes as an asset: refused with a word, or read into something without faults that can be written again.
#include <cstdlib>

#include "codecs/asset/asset.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto asset = farfeel::codecs::read_asset(std::as_bytes(std::span(data, size)));
  if (!asset) {
    if (asset.error().message.empty()) std::abort();
    return 0;
  }
  if (!farfeel::codecs::write_asset(*asset)) std::abort();
  return 0;
}
