// Brings the Falcon's firmware into it: greeting the boot loader, then blocks of the file, each of which it echoes.
//
// Steps and figures after libnifalcon, which has met hardware: 9600 baud and DTR from low to high wake the loader,
// which answers 0a 43 0d with 0a 44 2c 0d; at the loading speed with DTR low it answers 'A' with 'A'; then it echoes
// all it gets. Loading is known to fail now and then, so it begins anew, kMostLoadings times.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "master_station/devices/channel/channel.h"

namespace farfeel::devices {

class FalconLoader {
 public:
  static constexpr int kMostLoadings = 10;

  enum class Progress : std::uint8_t { kGoesOn, kLoaded, kFailed, kGone };

  /// firmware: codecs::falcon_firmware_trouble finds nothing in it.
  explicit FalconLoader(std::vector<std::byte> firmware) : firmware_(std::move(firmware)) {}

  /// Goes on until deadline_ns at most, but for one control request, which may take 1 s.
  Progress step(UsbChannel& channel, std::int64_t now_ns, std::int64_t deadline_ns) noexcept;
  void begin() noexcept;  ///< anew, with all its tries

  [[nodiscard]] int loadings() const noexcept { return loading_ + 1; }
  [[nodiscard]] bool has_failed() const noexcept { return loading_ >= kMostLoadings; }
  /// Of the last failure: what the device did.
  [[nodiscard]] std::string_view trouble() const noexcept { return trouble_; }

 private:
  enum class Phase : std::uint8_t { kWake, kGreet, kFaster, kSecond, kBlocks };
  void enter(Phase phase, std::int64_t now_ns) noexcept;
  Progress fail(std::string_view trouble, std::int64_t now_ns) noexcept;
  Progress request(UsbChannel& channel, std::int64_t now_ns) noexcept;
  Progress converse(UsbChannel& channel, std::int64_t now_ns) noexcept;
  void hear(std::span<const std::byte> bytes, std::int64_t now_ns) noexcept;
  void say(UsbChannel& channel, std::span<const std::byte> bytes, std::int64_t now_ns) noexcept;

  std::vector<std::byte> firmware_;
  Phase phase_ = Phase::kWake;
  int loading_ = 0, greetings_ = 0;
  std::size_t request_ = 0;
  std::size_t at_ = 0, block_ = 0, echoed_ = 0;  // in the file: where the block begins, its size, how much came back
  std::array<std::byte, 4> heard_{};             // the newest bytes, the newest last
  bool is_said_ = false, is_wrong_ = false, is_answered_ = false;
  std::int64_t since_ns_ = 0;  // the phase, or what was said last
  std::string_view trouble_;
};

}  // namespace farfeel::devices
