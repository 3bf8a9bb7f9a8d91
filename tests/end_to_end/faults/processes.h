// This program again, as another process.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace farfeel::end_to_end {

/// While it lasts this thread, and all threads and processes that it starts, run before all ordinary ones, where that
/// is allowed: what else this machine does is not to decide how long a session takes to come back, or how long an
/// answer takes.
class Calm {
 public:
  Calm();
  ~Calm();
  Calm(const Calm&) = delete;
  Calm& operator=(const Calm&) = delete;
};

/// Killed with its owner, and when its owner's process dies.
class OtherProcess {
 public:
  /// The arguments, and "--tell N": a descriptor that it writes to.
  OtherProcess(const std::string& program, std::vector<std::string> arguments);
  ~OtherProcess();
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  void stop() const;  ///< SIGSTOP
  void go_on() const;
  void kill9();
  /// The next so many bytes that it writes; nothing if it ends before or patience_s passes.
  [[nodiscard]] bool hear(void* to, std::size_t bytes, double patience_s) const;
  template <typename Word>
  [[nodiscard]] std::optional<Word> hear(double patience_s = 60) const {
    Word word{};
    if (!hear(&word, sizeof word, patience_s)) return std::nullopt;
    return word;
  }

 private:
  int pid_ = -1, from_ = -1;
};

}  // namespace farfeel::end_to_end
