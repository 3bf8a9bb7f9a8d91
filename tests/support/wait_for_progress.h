// A master's --progress=machine lines, read until one of them is as wished.
#pragma once

#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <string_view>

#include "deploy/front/child.h"
#include "deploy/front/progress.h"

namespace farfeel::test_support {

/// False when the master ended, or the time is up.
template <typename Wish>
[[nodiscard]] bool wait_for_progress(const front::Child& master, std::chrono::seconds patience, const Wish& wish) {
  const auto end = std::chrono::steady_clock::now() + patience;
  std::string text;
  while (std::chrono::steady_clock::now() < end) {
    pollfd output{master.output_fd(), POLLIN, 0};
    poll(&output, 1, 100);
    if (output.revents == 0) continue;
    char bytes[4096];
    const ssize_t got = read(master.output_fd(), bytes, sizeof bytes);
    if (got <= 0) return false;
    text.append(bytes, static_cast<std::size_t>(got));
    for (std::size_t line_end = 0; (line_end = text.find('\n')) != std::string::npos; text.erase(0, line_end + 1))
      if (const auto p = front::progress_from(std::string_view(text).substr(0, line_end)); p && wish(*p)) return true;
  }
  return false;
}

}  // namespace farfeel::test_support
