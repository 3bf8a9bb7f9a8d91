#include "master_station/devices/driver/space_mouse_driver.h"

#include <algorithm>
#include <array>
#include <utility>

#include "master_station/devices/channel/hidapi_channel.h"

namespace farfeel::devices {
namespace {

constexpr std::size_t kReportBytes = 64;  // a full-speed interrupt transfer
constexpr int kReportsAtOnce = 64;        // what hidraw keeps for a reader
constexpr int kLightTries = 3;            // a device without a ring refuses each time
// A cap that is deflected tells so every 8 ms, so one that is silent for longer may be gone. The kernel tells a reader
// only once it has put the input device away, some 30 ms after the plug was pulled (three grace periods of its RCU); a
// writer it refuses at once.
constexpr std::int64_t kAsksAfter_ns = 10'000'000;

std::vector<FoundDevice> find(const DriverOptions&) {
  std::vector<FoundDevice> found;
  for (FoundHid& hid : find_hid_devices()) {
    const auto title = codecs::space_mouse_title(hid.vendor, hid.product, hid.usage_page, hid.usage);
    if (!title) continue;
    std::string trouble = hid.trouble.empty() ? std::string{} : std::string(*title) + ": " + hid.trouble;
    found.push_back({"spacemouse", std::move(hid.serial), std::move(hid.path), std::move(trouble)});
  }
  return found;
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open(const FoundDevice& device, const DriverOptions&) {
  auto channel = HidapiChannel::open(device.path);
  if (!channel) return tl::unexpected(DeviceError{channel.error()});
  return std::make_unique<SpaceMouseDriver>(std::move(*channel), device);
}

}  // namespace

const DriverFamily kSpaceMouseFamily{"spacemouse", find, open};

SpaceMouseDriver::SpaceMouseDriver(std::unique_ptr<HidChannel> channel, FoundDevice identity, Clock now_ns)
    : channel_(std::move(channel)),
      identity_(std::move(identity)),
      now_ns_(now_ns),
      decoder_(channel_->report_descriptor()),
      light_tries_left_(kLightTries) {}

Stage SpaceMouseDriver::step(std::int64_t deadline_ns, const Command& command, Sample& newest) {
  if (!is_gone_) set_light(command.is_light_on);
  if (!is_gone_) ask_whether_it_is_there();
  std::array<std::byte, kReportBytes> report;
  // Waits for the first report only; those that wait behind it are taken in order, since each may hold other axes.
  for (int i = 0; !is_gone_ && i < kReportsAtOnce; ++i) {
    const Transferred came = channel_->read(report, i == 0 ? deadline_ns : 0);
    is_gone_ = came.state == ChannelState::kGone;
    if (came.state == ChannelState::kDone || came.state == ChannelState::kNothing) polled_ns_ = now_ns_();
    if (came.state != ChannelState::kDone) break;
    const std::uint32_t buttons = decoder_.reading().buttons;
    if (!decoder_.take(std::span(report).first(came.bytes))) continue;
    time_ns_ = polled_ns_;
    ++reports_;
    // A press and its release are two samples, so that nobody misses the edge; what waits behind it, waits for a step.
    if (decoder_.reading().buttons != buttons) break;
  }

  const std::uint32_t opening = newest.opening;  // the owner's
  newest = Sample{};
  newest.opening = opening;
  newest.stage = is_gone_ ? Stage::kAbsent : Stage::kReady;
  newest.time_ns = time_ns_;
  newest.polled_ns = polled_ns_;
  newest.reports = reports_;
  if (!is_gone_) {
    const codecs::SpaceMouseReading& reading = decoder_.reading();
    newest.deflection = {reading.turn, reading.push};
    newest.buttons = reading.buttons;
  }
  return newest.stage;
}

std::string SpaceMouseDriver::advice() const {
  return is_gone_ ? "the SpaceMouse was unplugged: plug it in again" : std::string{};
}

// Written only when it changes: the kernel waits for the device to take it.
void SpaceMouseDriver::set_light(bool is_on) noexcept {
  if (is_on != is_lit_) light_tries_left_ = kLightTries;
  is_lit_ = is_on;
  if (light_tries_left_ == 0) return;
  const Transferred went = channel_->write(codecs::space_mouse_light(is_on));
  light_tries_left_ = went.state == ChannelState::kDone ? 0 : light_tries_left_ - 1;
  is_gone_ = went.state == ChannelState::kGone;
}

// The light as it is: nothing changes, but an unplugged device does not take it.
void SpaceMouseDriver::ask_whether_it_is_there() noexcept {
  const codecs::SpaceMouseReading& reading = decoder_.reading();
  const bool is_at_rest = reading.turn == glm::dvec3(0) && reading.push == glm::dvec3(0);
  const std::int64_t now_ns = now_ns_();
  if (is_at_rest || now_ns - std::max(time_ns_, asked_ns_) < kAsksAfter_ns) return;
  asked_ns_ = now_ns;
  is_gone_ = channel_->write(codecs::space_mouse_light(is_lit_)).state == ChannelState::kGone;
}

}  // namespace farfeel::devices
