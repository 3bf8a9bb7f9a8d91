// A child's output, a line at a time, as it comes.
#pragma once

#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <string_view>

namespace farfeel::front {

class LineReader {
 public:
  /// Calls use(line) for every whole line that can be read now; false when the writer has closed.
  template <typename Use>
  bool read_lines(int descriptor, const Use& use) {
    std::array<char, 4096> bytes{};
    const ssize_t got = read(descriptor, bytes.data(), bytes.size());
    if (got <= 0) return got < 0 && errno == EINTR;
    rest_.append(bytes.data(), static_cast<std::size_t>(got));
    for (std::size_t end = 0; (end = rest_.find('\n')) != std::string::npos; rest_.erase(0, end + 1))
      use(std::string_view(rest_).substr(0, end));
    return true;
  }

 private:
  std::string rest_;
};

}  // namespace farfeel::front
