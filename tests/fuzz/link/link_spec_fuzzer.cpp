// Any text as a link: refused with a message, or read the same from its own words.

#include <cmath>
#include <cstdlib>

#include "transport/link/link_spec.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto spec = parse_link_spec(std::string(reinterpret_cast<const char*>(bytes), size));
  if (!spec) {
    if (spec.error().message.empty()) std::abort();
    return 0;
  }
  const bool is_sane = spec->round_trip_ns >= 0 && spec->loss >= 0 && spec->loss <= 1 && spec->burst >= 1 &&
                       std::isfinite(spec->rate_bit_per_s);
  if (!is_sane) std::abort();
  (void)to_string(*spec);
  return 0;
}
