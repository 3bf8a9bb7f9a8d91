// Any text as an address: refused with a message, or read the same from its own words.

#include <cstdlib>

#include "transport/net/address.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto address = parse_address(std::string(reinterpret_cast<const char*>(bytes), size), 7);
  if (!address) {
    if (address.error().message.empty()) std::abort();
    return 0;
  }
  if (parse_address(to_string(*address)) != *address) std::abort();
  return 0;
}
