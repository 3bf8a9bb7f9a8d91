// A key held at the station's terminal: the space bar, or a foot switch that types one. It enables force on a device
// that has no button of its own.
//
// A terminal tells no release, only that a key repeats while it is held.
#pragma once

#include <cstdint>
#include <memory>

namespace farfeel::master_station {

/// Whether a key is held, from when its letters come.
class HeldKey {
 public:
  /// Keyboards wait up to 660 ms (X's default) before a key that is held begins to repeat, and repeat it 25 times a
  /// second.
  static constexpr std::int64_t kFirst_ns = 700'000'000, kRepeats_ns = 120'000'000;

  void came(std::int64_t now_ns) noexcept {
    const bool is_repeat = now_ns < until_ns_;
    until_ns_ = now_ns + (is_repeat ? kRepeats_ns : kFirst_ns);
  }
  /// CLOCK_MONOTONIC: held until then, unless it comes again.
  [[nodiscard]] std::int64_t until_ns() const noexcept { return until_ns_; }

 private:
  std::int64_t until_ns_ = 0;
};

/// Takes single letters from standard input while it lives, and puts the terminal back as it was. One thread.
class StationKey {
 public:
  /// Null where standard input is no terminal.
  [[nodiscard]] static std::unique_ptr<StationKey> open();
  ~StationKey();
  StationKey(const StationKey&) = delete;
  StationKey& operator=(const StationKey&) = delete;

  /// At least every 50 ms: until when the key counts as held.
  [[nodiscard]] std::int64_t held_until_ns(std::int64_t now_ns);

 private:
  struct Terminal;
  explicit StationKey(std::unique_ptr<Terminal> before);
  std::unique_ptr<Terminal> before_;
  HeldKey key_;
};

}  // namespace farfeel::master_station
