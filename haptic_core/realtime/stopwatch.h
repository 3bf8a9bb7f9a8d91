// Wall-clock time of what a thread does, lap by lap.
#pragma once

#include <chrono>

namespace farfeel::realtime {

class Stopwatch {
 public:
  /// Microseconds since the last lap, or since construction.
  double lap_us() noexcept {
    const auto now = std::chrono::steady_clock::now();
    const double us = std::chrono::duration<double, std::micro>(now - last_).count();
    last_ = now;
    return us;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace farfeel::realtime
