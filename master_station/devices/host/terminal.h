// The person at the other end of standard input and output: a terminal, or a pipe in its place.
#pragma once

#include <termios.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace farfeel::devices {

/// One thread. Restores the terminal when it goes.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  [[nodiscard]] bool has_screen() const noexcept { return has_screen_; }
  /// The next byte that was typed, as it is typed; nothing: none waits. Does not wait.
  [[nodiscard]] std::optional<char> key();
  [[nodiscard]] bool has_ended() const noexcept { return has_ended_; }  ///< nobody can type any more

  void say(std::string_view line);
  /// In place of what was drawn before.
  void draw(std::string_view picture);

 private:
  bool has_screen_, has_ended_ = false;
  std::optional<termios> before_;
  std::size_t drawn_lines_ = 0;
};

/// Set by Ctrl-C and SIGTERM once called: a command then ends in order.
[[nodiscard]] const std::atomic<bool>& asked_to_end();

}  // namespace farfeel::devices
