// The memory that a device's owner (farfeel-device), its keeper and the station that feels it share.
//
// Made by the station as an anonymous file, and handed on as a descriptor: nobody else can open it. Every byte in it
// may be whatever a broken program wrote there, so who reads takes values as a copy and checks them.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "haptic_core/realtime/shared_value.h"
#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

/// Text of a fixed size, cut where it is too long; always ends.
template <std::size_t kSize>
struct FixedText {
  std::array<char, kSize> letters{};

  FixedText& operator=(std::string_view text) noexcept {
    letters.fill(0);
    text.copy(letters.data(), kSize - 1);
    return *this;
  }
  [[nodiscard]] std::string text() const {
    const std::string_view all(letters.data(), kSize);
    return std::string(all.substr(0, all.find('\0')));
  }
};

/// What the owner has opened.
struct OpenedDevice {
  FixedText<64> model, serial;
  FixedText<128> path;
  FixedText<4096> model_toml;  ///< what the device itself says of its figures, over the data of its model
  std::uint32_t opening = 0;   ///< which of the samples belong to it
  bool has_keeper = false;     ///< somebody takes it off when the owner is gone
};

struct LinkMemory {
  static constexpr std::uint64_t kMagic = 0x3145'4349'5645'4446;  // "FDEVICE1"
  std::uint64_t magic = kMagic;
  std::uint64_t size = sizeof(LinkMemory);  ///< of programs that were built together they are the same

  realtime::SharedValue<Sample> sample;          ///< owner -> station
  realtime::SharedValue<Command> command;        ///< station -> owner
  realtime::SharedValue<OpenedDevice> opened;    ///< owner -> station
  realtime::SharedValue<FixedText<512>> advice;  ///< owner -> station: what to do next, for a person
  std::atomic<std::int64_t> owner_beat_ns;       ///< owner -> keeper, each step; 0: no force, nothing to keep
  std::atomic<std::int64_t> keeper_beat_ns;      ///< keeper -> owner
  std::atomic<std::uint32_t> taken_off;          ///< how often a keeper took force off
  std::atomic<std::int64_t> step_ns;             ///< owner -> station: how long the driver's last step took
};

/// A mapping of it, and the descriptor to hand on.
class MappedLink {
 public:
  [[nodiscard]] static tl::expected<MappedLink, std::string> create();
  /// Takes the descriptor over. Refuses what is not such a memory, or of another build.
  [[nodiscard]] static tl::expected<MappedLink, std::string> open(int fd);

  [[nodiscard]] LinkMemory& memory() const noexcept { return *memory_; }
  [[nodiscard]] int fd() const noexcept { return *fd_; }

 private:
  struct Unmap {
    void operator()(LinkMemory* memory) const noexcept;
  };
  struct Close {
    void operator()(int* fd) const noexcept;
  };
  MappedLink(LinkMemory* memory, int fd) : memory_(memory), fd_(new int(fd)) {}

  std::unique_ptr<LinkMemory, Unmap> memory_;
  std::unique_ptr<int, Close> fd_;
};

}  // namespace farfeel::devices
