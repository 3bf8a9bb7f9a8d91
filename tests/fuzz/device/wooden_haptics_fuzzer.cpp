// The driver against a device that answers anything at any time. A step is a byte: its two low bits say what comes, the
// others how many milliseconds it takes.
//   0: an answer, of the 14 bytes that follow    1: a report of so many bytes as the next says
//   2: nothing                                   3: reads and writes end as the next byte says, in this step

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include "haptic_core/spatial/spatial.h"
#include "master_station/devices/driver/wooden_haptics_driver.h"

using namespace farfeel;
using namespace farfeel::devices;

namespace {

std::int64_t time_ns = 0;
std::int64_t now() noexcept {
  return time_ns;
}

void demand(bool is_so) {
  if (!is_so) std::abort();
}

struct Script {
  std::span<const std::byte> bytes;
  std::uint8_t next() {
    if (bytes.empty()) return 0;
    const auto value = std::to_integer<std::uint8_t>(bytes[0]);
    bytes = bytes.subspan(1);
    return value;
  }
};

struct AnyDevice final : HidChannel {
  explicit AnyDevice(bool& may_have_force) : may_have_force_(may_have_force) {}

  Transferred read(std::span<std::byte> to, std::int64_t) noexcept override {
    if (state == ChannelState::kGone || state == ChannelState::kStalled) return {state, 0};
    if (!is_waiting) return {};
    is_waiting = false;
    const std::size_t size = std::min(to.size(), report.size());
    std::copy_n(report.begin(), size, to.begin());
    if (const auto answer = codecs::read_wooden_haptics(report)) told = answer;
    return {ChannelState::kDone, size};
  }
  Transferred write(std::span<const std::byte> packet) noexcept override {
    if (state != ChannelState::kDone) return {state, 0};
    demand(packet.size() == codecs::kWoodenHapticsReportBytes && packet[0] == std::byte{0});
    const auto int16 = [&](std::size_t i) {
      return static_cast<std::int16_t>(std::to_integer<unsigned>(packet[1 + 2 * i]) |
                                       std::to_integer<unsigned>(packet[2 + 2 * i]) << 8);
    };
    if (int16(3) == 0) {
      for (std::size_t i = 0; i < 3; ++i) demand(std::abs(int16(i)) <= (may_have_force_ ? 2000 : 0));
    } else {
      // Counts take the force off. A device in use is sent only those that it told itself, with its button pressed.
      demand(int16(3) == 1);
      demand(!may_have_force_ || (told_before && told_before->asks_to_home &&
                                  std::ranges::equal(packet, codecs::wooden_haptics_counts(told_before->counts))));
    }
    return {ChannelState::kDone, packet.size()};
  }
  Transferred get_feature(std::span<std::byte>) noexcept override { return {}; }
  Transferred set_feature(std::span<const std::byte>) noexcept override { return {}; }
  std::span<const std::byte> report_descriptor() const noexcept override { return {}; }
  int descriptor() const noexcept override { return -1; }

  bool is_waiting = false;
  std::vector<std::byte> report;
  std::optional<codecs::WoodenHapticsAnswer> told, told_before;  // the latest, and the one that stood before this step
  ChannelState state = ChannelState::kDone;
  bool& may_have_force_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  constexpr glm::dvec3 kForces[] = {{1, 2, 3}, {kInf, 0, 0}, {0, -kInf, 1}, {1e300, 1e300, 1e300}, {0, 0, -500}};
  time_ns = 1;
  Script script{{reinterpret_cast<const std::byte*>(data), size}};
  bool may_have_force = false;
  auto owned = std::make_unique<AnyDevice>(may_have_force);
  AnyDevice& device = *owned;
  WoodenHapticsDriver driver(std::move(owned), {}, {}, now);
  Sample sample;
  Command command;
  command.is_force_on = true;
  for (std::size_t step = 0; !script.bytes.empty(); ++step) {
    const std::uint8_t what = script.next();
    time_ns += std::int64_t{what / 4} * 1'000'000;
    device.state = ChannelState::kDone;
    device.is_waiting = what % 4 < 2;
    if (device.is_waiting) {
      device.report.assign(what % 4 == 0 ? codecs::kWoodenHapticsReportBytes : script.next(), std::byte{0});
      for (std::size_t i = what % 4 == 0 ? 1 : 0; i < device.report.size(); ++i) {
        device.report[i] = static_cast<std::byte>(script.next());
      }
    } else if (what % 4 == 3) {
      device.state = static_cast<ChannelState>(script.next() % 4);
    }
    command.F_hand_B.force_N = kForces[step % std::size(kForces)];
    may_have_force = sample.stage == Stage::kReady;
    device.told_before = device.told;
    const Stage stage = driver.step(time_ns, command, sample);
    demand(stage == sample.stage && spatial::is_valid(sample.X_BD) && spatial::is_finite(sample.V_BD_B));
    demand(driver.advice().empty() == (stage == Stage::kReady));
  }
  may_have_force = false;  // the packet that ends it
  return 0;
}
