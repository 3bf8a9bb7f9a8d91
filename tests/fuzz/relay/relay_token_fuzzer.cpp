// Any text as a token: refused with a message, or written as it was read, but for the space around it.

#include <cstdlib>

#include "transport/relay/relay_token.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  const auto token = parse_token(text);
  if (!token) {
    if (token.error().message.empty()) std::abort();
    return 0;
  }
  const std::string again = to_string(*token);
  if (text.find(again) == std::string::npos || text.size() < again.size()) std::abort();
  return 0;
}
