// A Novint Falcon as its computer sees it: control requests and bulk bytes in, bulk bytes out. Written from the public
// tables (libnifalcon's documents, FTDI's application notes, Texas Instruments' SPRU095 for the boot loader), before
// the driver and without its codec.
//
// It does no I/O and reads no clock: tests put it behind a UsbChannel, behind an emulated usbfs node, or on a gadget's
// endpoints. One thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include "tests/support/devices/falcon_mechanism.h"

namespace farfeel::test_support {

/// What goes wrong with replies, or with the device.
enum class FalconFault : std::uint8_t {
  kNone,
  kTruncated,   ///< a reply loses its tail
  kDuplicated,  ///< it comes twice
  kReordered,   ///< it comes after the next
  kMutated,     ///< one of its bits is turned
  kGarbage,     ///< random bytes before it
  kSilent,      ///< there is none
  kStalled,     ///< both endpoints refuse
  kUnplugged    ///< nothing answers
};

struct FalconEmulatorSettings {
  bool has_firmware = false;  ///< from an earlier program; the device keeps it while it has power
  bool is_homed = false;
  unsigned deaf_hellos = 0;   ///< so many greetings of the loader go unanswered
  unsigned wrong_echoes = 0;  ///< so many loadings meet a wrong byte
  unsigned lost_echoes = 0;   ///< and so many a missing one
  std::int64_t reply_ns = 200'000;
  std::int64_t watchdog_ns = 100'000'000;  ///< motors off when no packet came for so long; this emulator's own
  std::uint32_t seed = 1;
  FalconMechanics mechanics;
};

class FalconEmulator {
 public:
  static constexpr std::uint16_t kVendor = 0x0403, kProduct = 0xcb48;
  static constexpr std::uint8_t kIn = 0x81, kOut = 0x02;
  static constexpr std::size_t kPacketBytes = 64;
  static constexpr std::string_view kManufacturer = "Novint", kProductName = "FALCON HAPTIC", kSerial = "FF000001";

  explicit FalconEmulator(const FalconEmulatorSettings& = {});

  [[nodiscard]] static std::span<const std::byte> device_descriptor();         ///< 18 bytes
  [[nodiscard]] static std::span<const std::byte> configuration_descriptor();  ///< with interface and endpoints, 32

  /// A vendor's request without data. False: the device refuses (stalls).
  bool control(std::int64_t now_ns, std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index);
  /// Bytes to endpoint 2. False: refused.
  bool bulk_out(std::int64_t now_ns, std::span<const std::byte> bytes);
  struct In {
    bool is_stalled = false;
    std::size_t bytes = 0;
  };
  /// One IN transfer on endpoint 0x81, ended by a short packet as on the bus; nothing: the device has nothing to say
  /// yet (NAK). Each packet of 64 bytes starts with two of modem status.
  std::optional<In> bulk_in(std::int64_t now_ns, std::span<std::byte> into);
  /// When bulk_in has something, at the earliest.
  [[nodiscard]] std::int64_t next_in_ns() const;
  void advance(std::int64_t now_ns);  ///< mechanics, watchdog

  /// From now on, for each reply by chance.
  void set_fault(FalconFault fault, double chance = 1) { fault_ = fault, chance_ = chance; }
  [[nodiscard]] bool is_unplugged() const { return fault_ == FalconFault::kUnplugged; }
  /// As after the plug was out: it forgets firmware and home.
  void lose_power();
  void set_hand(const FalconHand& hand) { mechanism_.set_hand(hand); }
  void press(std::uint8_t buttons) { buttons_ = buttons; }

  [[nodiscard]] const FalconMechanism& mechanism() const { return mechanism_; }
  [[nodiscard]] const std::array<std::int16_t, 3>& motors() const { return motors_; }
  [[nodiscard]] std::uint8_t lights() const { return lights_; }
  [[nodiscard]] bool is_running() const { return phase_ == Phase::kRunning; }
  [[nodiscard]] bool is_homed() const { return homed_ == 7; }
  [[nodiscard]] std::uint64_t packets() const { return packets_; }                ///< run packets that were understood
  [[nodiscard]] std::uint64_t bad_packets() const { return bad_packets_; }        ///< that were not
  [[nodiscard]] std::uint64_t moving_packets() const { return moving_packets_; }  ///< whose motor values were not all 0
  [[nodiscard]] std::uint64_t loadings() const { return loadings_; }              ///< of firmware that began
  /// How long the last force outlasted the last packet, where the watchdog took it off; 0: it never had to.
  [[nodiscard]] std::int64_t watchdog_took_ns() const { return watchdog_took_ns_; }

 private:
  enum class Phase : std::uint8_t { kAsleep, kHello, kSecond, kLoading, kStuck, kRunning };
  void hear(std::int64_t now_ns, std::uint8_t byte);
  void load(std::int64_t now_ns, std::uint8_t byte);
  void run(std::int64_t now_ns, std::uint8_t byte);
  void obey(std::int64_t now_ns);
  void reply(std::int64_t now_ns);
  void say(std::int64_t at_ns, std::span<const std::uint8_t> bytes);
  void home();
  [[nodiscard]] bool happens() { return std::uniform_real_distribution<>(0, 1)(random_) < chance_; }

  struct Said {
    std::int64_t at_ns;
    std::uint8_t byte;
  };

  FalconEmulatorSettings settings_;
  FalconMechanism mechanism_;
  std::mt19937 random_;
  Phase phase_ = Phase::kAsleep;
  std::uint16_t baud_ = 0;
  bool is_ready_to_receive_ = false;  // DTR
  std::int64_t latency_ns_ = 16'000'000, last_in_ns_ = 0;
  std::deque<Said> said_;                 // waits in the FTDI's buffer
  std::vector<std::uint8_t> heard_;       // greeting, loading, or a run packet that is not whole yet
  std::vector<std::uint8_t> held_reply_;  // kReordered
  std::array<std::int16_t, 3> motors_{};
  std::array<double, 3> power_on_rad_{}, last_rad_{};
  std::uint8_t lights_ = 0, buttons_ = 0, homed_ = 0;
  FalconFault fault_ = FalconFault::kNone;
  double chance_ = 1;
  std::int64_t last_packet_ns_ = 0, watchdog_took_ns_ = 0;
  std::uint64_t packets_ = 0, bad_packets_ = 0, moving_packets_ = 0, loadings_ = 0;
};

}  // namespace farfeel::test_support
