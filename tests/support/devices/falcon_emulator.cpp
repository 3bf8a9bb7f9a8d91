#include "tests/support/devices/falcon_emulator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace farfeel::test_support {

namespace {

constexpr std::array<std::uint8_t, 18> kDevice{18,   1,    0x00, 0x02, 0,    0, 0, 8, 0x03,
                                               0x04, 0x48, 0xcb, 0x00, 0x04, 1, 2, 3, 1};
constexpr std::array<std::uint8_t, 32> kConfiguration{9,  2, 32, 0,    1,    1,    0, 0x80, 45, 9,    4,
                                                      0,  0, 2,  0xff, 0xff, 0xff, 2, 7,    5,  0x81, 2,
                                                      64, 0, 0,  7,    5,    0x02, 2, 64,   0,  0};

// FTDI: a vendor's requests, and what they set.
constexpr std::uint8_t kVendorOut = 0x40;
enum Request : std::uint8_t { kReset = 0, kModem = 1, kFlow = 2, kBaud = 3, kFormat = 4, kLatency = 9 };
constexpr std::uint16_t kHelloBaud = 0x4138, kLoadBaud = 0x15, kRunBaud = 0x2;

constexpr std::array<std::uint8_t, 3> kHello{0x0a, 0x43, 0x0d};
constexpr std::array<std::uint8_t, 4> kHelloBack{0x0a, 0x44, 0x2c, 0x0d};

constexpr double kCount_rad = 0.01425 / 0.110 * 2 * std::numbers::pi / (320 * 4);
constexpr double kZero_rad = 35 * std::numbers::pi / 180;
constexpr double kIndex_rad = 30 * std::numbers::pi / 180;  // where an arm's index mark is: this emulator's choice
constexpr std::int64_t kUsbFrame_ns = 1'000'000;

/// Where a boot stream of 16-bit words ends: 8 reserved words after the key, an entry point, blocks of a size, an
/// address and data, and a block of size 0. 0: not yet.
std::size_t end_of_boot_stream(std::span<const std::uint8_t> bytes) {
  for (std::size_t at = 22; at + 2 <= bytes.size();) {
    const std::size_t words = bytes[at] | (bytes[at + 1] << 8);
    if (words == 0) return at + 2;
    at += 2 + 4 + 2 * words;
  }
  return 0;
}

}  // namespace

FalconEmulator::FalconEmulator(const FalconEmulatorSettings& settings)
    : settings_(settings), mechanism_(settings.mechanics), random_(settings.seed) {
  power_on_rad_ = last_rad_ = mechanism_.angles_rad();
  if (settings_.has_firmware) phase_ = Phase::kRunning;
  if (settings_.is_homed) homed_ = 7;
}

std::span<const std::byte> FalconEmulator::device_descriptor() {
  return std::as_bytes(std::span(kDevice));
}
std::span<const std::byte> FalconEmulator::configuration_descriptor() {
  return std::as_bytes(std::span(kConfiguration));
}

void FalconEmulator::lose_power() {
  phase_ = Phase::kAsleep;
  homed_ = lights_ = 0;
  motors_ = {};
  mechanism_.set_motors(motors_);
  said_.clear();
  heard_.clear();
  held_reply_.clear();
  power_on_rad_ = mechanism_.angles_rad();
}

bool FalconEmulator::control(std::int64_t now_ns, std::uint8_t type, std::uint8_t request, std::uint16_t value,
                             std::uint16_t) {
  advance(now_ns);
  if (type != kVendorOut) return false;
  switch (request) {
    case kReset:
      if (value > 2) return false;
      if (value != 2) said_.clear();
      if (value != 1) heard_.clear();
      return true;
    case kModem:
      if ((value & 0x100) != 0) {
        const bool is_ready = (value & 1) != 0;
        if (is_ready && !is_ready_to_receive_) {  // DTR from low to high wakes the boot loader
          lose_power();
          phase_ = Phase::kHello;
        }
        is_ready_to_receive_ = is_ready;
      }
      return true;
    case kBaud:
      baud_ = value;
      return true;
    case kLatency:
      if (value == 0 || value > 255) return false;
      latency_ns_ = value * std::int64_t{1'000'000};
      return true;
    case kFlow:
    case kFormat:
      return true;
    default:
      return false;
  }
}

bool FalconEmulator::bulk_out(std::int64_t now_ns, std::span<const std::byte> bytes) {
  advance(now_ns);
  if (fault_ == FalconFault::kStalled && happens()) return false;
  for (const std::byte byte : bytes) hear(now_ns, std::to_integer<std::uint8_t>(byte));
  return true;
}

void FalconEmulator::hear(std::int64_t now_ns, std::uint8_t byte) {
  switch (phase_) {
    case Phase::kHello:
      if (baud_ != kHelloBaud) return;
      heard_.push_back(byte);
      if (heard_.size() > kHello.size()) heard_.erase(heard_.begin());
      if (!std::ranges::equal(heard_, kHello)) return;
      heard_.clear();
      if (settings_.deaf_hellos > 0) {
        --settings_.deaf_hellos;
        return;
      }
      say(now_ns + settings_.reply_ns, kHelloBack);
      phase_ = Phase::kSecond;
      return;
    case Phase::kSecond:
      if (baud_ == kHelloBaud) {  // greeted again
        phase_ = Phase::kHello;
        return hear(now_ns, byte);
      }
      if (baud_ != kLoadBaud || is_ready_to_receive_ || byte != 0x41) return;
      say(now_ns + settings_.reply_ns, std::array<std::uint8_t, 1>{0x41});
      phase_ = Phase::kLoading;
      heard_.clear();
      ++loadings_;
      return;
    case Phase::kLoading:
      return load(now_ns, byte);
    case Phase::kRunning:
      return run(now_ns, byte);
    case Phase::kAsleep:
    case Phase::kStuck:
      return;
  }
}

void FalconEmulator::load(std::int64_t now_ns, std::uint8_t byte) {
  if (baud_ != kLoadBaud) return;
  heard_.push_back(byte);
  if (heard_.size() == 2 && (heard_[0] != 0xaa || heard_[1] != 0x08)) {
    phase_ = Phase::kStuck;
    return;
  }
  if (heard_.size() == 100 && settings_.lost_echoes > 0) {
    --settings_.lost_echoes;
    phase_ = Phase::kStuck;
    return;
  }
  if (heard_.size() == 200 && settings_.wrong_echoes > 0) {
    --settings_.wrong_echoes;
    say(now_ns + settings_.reply_ns, std::array<std::uint8_t, 1>{static_cast<std::uint8_t>(byte ^ 0x10)});
    phase_ = Phase::kStuck;
    return;
  }
  say(now_ns + settings_.reply_ns, std::array<std::uint8_t, 1>{byte});
  if (heard_.size() % 2 == 0 && end_of_boot_stream(heard_) == heard_.size()) {
    phase_ = Phase::kRunning;
    heard_.clear();
  }
}

void FalconEmulator::run(std::int64_t now_ns, std::uint8_t byte) {
  if (baud_ != kRunBaud) return;
  if (byte == '<') heard_.clear();
  heard_.push_back(byte);
  if (heard_.size() < 16) return;
  const auto is_nibble = [](std::uint8_t b) { return b >= 'A' && b <= 'P'; };
  const bool is_good =
      heard_.front() == '<' && byte == '>' && std::all_of(heard_.begin() + 1, heard_.end() - 1, is_nibble);
  if (is_good)
    obey(now_ns);
  else
    ++bad_packets_;
  heard_.clear();
}

void FalconEmulator::obey(std::int64_t now_ns) {
  const auto nibble = [&](std::size_t i) { return heard_[i] - 'A'; };
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t at = 1 + 4 * i;
    motors_[i] =
        static_cast<std::int16_t>(nibble(at) | (nibble(at + 1) << 4) | (nibble(at + 2) << 8) | (nibble(at + 3) << 12));
  }
  lights_ = static_cast<std::uint8_t>(nibble(13) & 0x0e);
  if ((nibble(13) & 1) != 0)
    home();
  else
    homed_ = 0;  // "must be set in each packet for it to stay homed"
  mechanism_.set_motors(motors_);
  ++packets_;
  if (motors_ != std::array<std::int16_t, 3>{}) ++moving_packets_;
  last_packet_ns_ = now_ns;
  reply(now_ns);
}

void FalconEmulator::home() {
  const auto& now_rad = mechanism_.angles_rad();
  for (std::size_t i = 0; i < 3; ++i) {
    if ((last_rad_[i] - kIndex_rad) * (now_rad[i] - kIndex_rad) <= 0) homed_ |= static_cast<std::uint8_t>(1 << i);
    last_rad_[i] = now_rad[i];
  }
}

void FalconEmulator::reply(std::int64_t now_ns) {
  std::vector<std::uint8_t> bytes{'<'};
  for (std::size_t i = 0; i < 3; ++i) {
    const double zero_rad = (homed_ >> i) & 1 ? kZero_rad : power_on_rad_[i];
    const auto count = static_cast<int>(std::lround((mechanism_.angles_rad()[i] - zero_rad) / kCount_rad));
    for (int shift = 0; shift < 16; shift += 4)
      bytes.push_back(static_cast<std::uint8_t>('A' + ((count >> shift) & 0xf)));
  }
  bytes.push_back(static_cast<std::uint8_t>(0x41 + (buttons_ & 0xf) + (homed_ << 4)));
  bytes.push_back('A');
  bytes.push_back('>');

  std::vector<std::uint8_t> held;
  held.swap(held_reply_);
  const bool is_struck = fault_ != FalconFault::kNone && happens();
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random_() % n); };
  switch (is_struck ? fault_ : FalconFault::kNone) {
    case FalconFault::kSilent:
      return;
    case FalconFault::kTruncated:
      bytes.resize(1 + below(15));
      break;
    case FalconFault::kDuplicated: {
      const auto once = bytes;
      bytes.insert(bytes.end(), once.begin(), once.end());
      break;
    }
    case FalconFault::kReordered:
      if (held.empty()) {
        held_reply_ = bytes;
        return;
      }
      break;
    case FalconFault::kMutated:
      bytes[below(16)] ^= static_cast<std::uint8_t>(1 << below(8));
      break;
    case FalconFault::kGarbage: {
      std::vector<std::uint8_t> garbage(1 + below(40));
      for (auto& byte : garbage) byte = static_cast<std::uint8_t>(random_());
      bytes.insert(bytes.begin(), garbage.begin(), garbage.end());
      break;
    }
    default:
      break;
  }
  bytes.insert(bytes.end(), held.begin(), held.end());
  say(now_ns + settings_.reply_ns, bytes);
}

void FalconEmulator::say(std::int64_t at_ns, std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kBuffer = 4096;  // a real one holds less; what nobody fetches is lost
  for (const std::uint8_t byte : bytes)
    if (said_.size() < kBuffer) said_.push_back({at_ns, byte});
}

std::int64_t FalconEmulator::next_in_ns() const {
  const std::int64_t by_timer = last_in_ns_ + latency_ns_;
  if (said_.size() < kPacketBytes - 2) return by_timer;
  return std::min(by_timer, std::max(said_[kPacketBytes - 3].at_ns, last_in_ns_ + kUsbFrame_ns / 10));
}

std::optional<FalconEmulator::In> FalconEmulator::bulk_in(std::int64_t now_ns, std::span<std::byte> into) {
  advance(now_ns);
  if (now_ns < next_in_ns()) return std::nullopt;
  if (fault_ == FalconFault::kStalled && happens()) return In{.is_stalled = true};
  last_in_ns_ = now_ns;
  In in;
  while (into.size() - in.bytes >= 2) {
    const std::size_t room = std::min(kPacketBytes, into.size() - in.bytes);
    into[in.bytes] = std::byte{0x11};  // clear to send; the low bits are reserved
    into[in.bytes + 1] = std::byte{0x60};
    std::size_t n = 2;
    for (; n < room && !said_.empty() && said_.front().at_ns <= now_ns; ++n) {
      into[in.bytes + n] = std::byte{said_.front().byte};
      said_.pop_front();
    }
    in.bytes += n;
    if (n < kPacketBytes) break;  // a short packet ends the transfer
  }
  return in;
}

void FalconEmulator::advance(std::int64_t now_ns) {
  mechanism_.advance(now_ns);
  const bool is_moving = motors_ != std::array<std::int16_t, 3>{};
  if (is_moving && now_ns - last_packet_ns_ > settings_.watchdog_ns) {
    motors_ = {};
    mechanism_.set_motors(motors_);
    watchdog_took_ns_ = now_ns - last_packet_ns_;
  }
}

}  // namespace farfeel::test_support
