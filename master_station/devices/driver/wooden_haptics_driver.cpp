#include "master_station/devices/driver/wooden_haptics_driver.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "codecs/device/hid_report_descriptor.h"
#include "master_station/devices/channel/hidapi_channel.h"

namespace farfeel::devices {
namespace {

// Numbers that mbed's and Teensy's examples use for anything: the reports' sizes must be right, too.
struct Board {
  std::uint16_t vendor, product;
};
constexpr Board kBoards[] = {{0x1234, 0x0006}, {0x16c0, 0x0486}};

constexpr int kReportsAtOnce = 64;                // what hidraw keeps for a reader
constexpr std::int64_t kLost_ns = 10'000'000;     // an answer is not waited for any longer; it takes 1 to 3 ms
constexpr std::int64_t kSilent_ns = 20'000'000;   // the age at which no sample counts any more
constexpr std::int64_t kMute_ns = 1'000'000'000;  // since it was opened: then a person is told
constexpr std::int64_t kHoldStill_ns = 2'000'000'000;
constexpr std::int64_t kHoldStillAtButton_ns = 200'000'000;
constexpr int kMoved_counts = 200;               // 3 degrees of the upper arm: a hand, not a table that shakes
constexpr int kStill_counts = 8;                 // 0.1 degrees, 0.5 mm at the handle
constexpr std::int64_t kBounce_ns = 50'000'000;  // a button that was let go and is on again sooner was never let go
constexpr int kSetTries = 3;
constexpr double kMaxSpeed_rad_s = 25;  // of a body: 5 m/s at the handle, more than an arm throws it
constexpr double kSlack_counts = 20;    // times of answers are known to a fraction of a millisecond
constexpr int kImplausibleAtMost = 3;   // in a row; a spoilt packet is one

bool has_the_reports(const std::string& path) {
  const auto reports = codecs::read_report_descriptor(report_descriptor_of(path));
  if (!reports || reports->is_numbered) return false;
  const auto* const in = reports->report(codecs::ReportKind::kInput, 0);
  const auto* const out = reports->report(codecs::ReportKind::kOutput, 0);
  return in != nullptr && out != nullptr && in->bytes() == codecs::kWoodenHapticsReportBytes - 1 &&
         out->bytes() == codecs::kWoodenHapticsReportBytes - 1;
}

std::vector<FoundDevice> find(const DriverOptions&) {
  std::vector<FoundDevice> found;
  for (FoundHid& hid : find_hid_devices()) {
    const bool is_board = std::any_of(std::begin(kBoards), std::end(kBoards), [&](const Board& board) {
      return board.vendor == hid.vendor && board.product == hid.product;
    });
    if (!is_board || !has_the_reports(hid.path)) continue;
    std::string trouble = hid.trouble.empty() ? std::string{} : "WoodenHaptics: " + hid.trouble;
    found.push_back({"wooden-haptics", std::move(hid.serial), std::move(hid.path), std::move(trouble)});
  }
  return found;
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open(const FoundDevice& device, const DriverOptions&) {
  auto channel = HidapiChannel::open(device.path);
  if (!channel) return tl::unexpected(DeviceError{channel.error()});
  return std::make_unique<WoodenHapticsDriver>(std::move(*channel), device);
}

// How far two readings are apart, whichever body moved most. Encoders of a wrist do not count.
int distance(const std::array<std::int16_t, 6>& a, const std::array<std::int16_t, 6>& b) {
  int most = 0;
  for (std::size_t i = 0; i < 3; ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

const codecs::WoodenHapticsPacket kNoCurrent = codecs::wooden_haptics_currents({});

}  // namespace

const DriverFamily kWoodenHapticsFamily{"wooden-haptics", find, open};

WoodenHapticsDriver::WoodenHapticsDriver(std::unique_ptr<HidChannel> channel, FoundDevice identity,
                                         const codecs::WoodenHapticsArm& arm, Clock now_ns)
    : channel_(std::move(channel)), identity_(std::move(identity)), arm_(arm), now_ns_(now_ns), opened_ns_(now_ns()) {}

WoodenHapticsDriver::~WoodenHapticsDriver() {
  if (phase_ != Phase::kGone) channel_->write(kNoCurrent);
}

std::optional<codecs::WoodenHapticsAnswer> WoodenHapticsDriver::read_newest(std::int64_t deadline_ns) {
  std::array<std::byte, 64> report;  // a longer one is not an answer, and is not to look like one
  std::optional<codecs::WoodenHapticsAnswer> newest;
  for (int i = 0; i < kReportsAtOnce; ++i) {
    const Transferred came = channel_->read(report, newest ? 0 : deadline_ns);
    if (came.state == ChannelState::kGone) phase_ = Phase::kGone;
    if (came.state != ChannelState::kDone) break;
    if (const auto answer = codecs::read_wooden_haptics(std::span(report).first(came.bytes))) newest = answer;
  }
  return newest;
}

std::optional<codecs::WoodenHapticsAnswer> WoodenHapticsDriver::exchange(const codecs::WoodenHapticsPacket& packet,
                                                                         std::int64_t deadline_ns) {
  // What waits was sent before this packet: the answer to one that was taken for lost, or a double.
  std::optional<codecs::WoodenHapticsAnswer> answer = read_newest(0);
  if (answer) is_asked_ = false;
  if (phase_ == Phase::kGone) return std::nullopt;
  const std::int64_t now_ns = now_ns_();
  const bool is_lost = is_asked_ && now_ns - asked_ns_ >= kLost_ns;
  if (!is_asked_ || is_lost) {
    // After a loss force is not taken up where it was: the device may have gone on with it for a while.
    const Transferred went = channel_->write(is_lost ? kNoCurrent : packet);
    if (went.state == ChannelState::kGone) phase_ = Phase::kGone;
    is_asked_ = went.state == ChannelState::kDone;
    asked_ns_ = now_ns;
  }
  if (is_asked_) {
    if (const auto fresh = read_newest(deadline_ns)) {
      answer = fresh;
      is_asked_ = false;
    }
  }
  return answer;
}

Stage WoodenHapticsDriver::step(std::int64_t deadline_ns, const Command& command, Sample& newest) {
  if (phase_ != Phase::kGone) {
    if (const auto answer = exchange(packet_for(command), deadline_ns)) {
      answered_ns_ = now_ns_();
      ++answers_;
      take(*answer);
    } else if (phase_ == Phase::kReady && now_ns_() - answered_ns_ >= kSilent_ns) {
      phase_ = Phase::kSilent;
    }
  }

  const std::uint32_t opening = newest.opening;  // the owner's
  newest = Sample{};
  newest.opening = opening;
  newest.reports = answers_;
  newest.polled_ns = answered_ns_;
  newest.time_ns = answered_ns_;
  if (phase_ == Phase::kReady || phase_ == Phase::kSilent) {
    newest.X_BD.p = codecs::handle_B_m(arm_, codecs::body_angles_rad(arm_, counts_));
    newest.V_BD_B = velocity_.twist();
    newest.time_ns = counts_ns_;
  }
  switch (phase_) {
    case Phase::kOpening:
      return newest.stage = Stage::kOpening;
    case Phase::kHoming:
    case Phase::kSettingCounts:
      return newest.stage = Stage::kHoming;
    case Phase::kReady:
      return newest.stage = Stage::kReady;
    case Phase::kSilent:
    case Phase::kLost:
      return newest.stage = Stage::kFault;
    case Phase::kGone:
      break;
  }
  return newest.stage = Stage::kAbsent;
}

codecs::WoodenHapticsPacket WoodenHapticsDriver::packet_for(const Command& command) const {
  if (phase_ == Phase::kSettingCounts) return codecs::wooden_haptics_counts(arm_.neutral_counts);
  if (phase_ == Phase::kReady && is_pressed_at_home_) return codecs::wooden_haptics_counts(counts_);
  if (phase_ != Phase::kReady || implausible_ > 0 || !command.is_force_on) return kNoCurrent;
  const glm::dvec3 angles_rad = codecs::body_angles_rad(arm_, counts_);
  return codecs::wooden_haptics_currents(codecs::motor_currents_mA(arm_, angles_rad, command.F_hand_B.force_N));
}

void WoodenHapticsDriver::take(const codecs::WoodenHapticsAnswer& answer) {
  switch (phase_) {
    case Phase::kOpening:
      start_homing();
      homing_from_ = still_at_ = answer.counts;
      return home(answer);
    case Phase::kHoming:
      return home(answer);
    case Phase::kSettingCounts:
      return check_counts_were_set(answer);
    case Phase::kReady:
    case Phase::kSilent:
      return follow(answer);
    case Phase::kLost:
    case Phase::kGone:
      return;
  }
}

void WoodenHapticsDriver::start_homing() {
  phase_ = Phase::kHoming;
  has_moved_ = is_button_pressed_ = false;
  still_since_ns_ = now_ns_();
  set_tries_ = 0;
  velocity_ = {};
}

void WoodenHapticsDriver::home(const codecs::WoodenHapticsAnswer& answer) {
  has_moved_ = has_moved_ || distance(answer.counts, homing_from_) >= kMoved_counts;
  is_button_pressed_ = is_button_pressed_ || answer.asks_to_home;
  if (distance(answer.counts, still_at_) > kStill_counts) {
    still_at_ = answer.counts;
    still_since_ns_ = answered_ns_;
  }
  const std::int64_t still_ns = answered_ns_ - still_since_ns_;
  if ((has_moved_ && still_ns >= kHoldStill_ns) || (is_button_pressed_ && still_ns >= kHoldStillAtButton_ns)) {
    phase_ = Phase::kSettingCounts;
  }
}

void WoodenHapticsDriver::check_counts_were_set(const codecs::WoodenHapticsAnswer& answer) {
  if (distance(answer.counts, arm_.neutral_counts) > kStill_counts) {
    // The first answer may be to the packet before.
    if (++set_tries_ > kSetTries) phase_ = Phase::kLost;
    return;
  }
  phase_ = Phase::kReady;
  implausible_ = 0;
  asked_to_home_ns_ = answered_ns_;
  remember(answer.counts);
}

void WoodenHapticsDriver::follow(const codecs::WoodenHapticsAnswer& answer) {
  is_pressed_at_home_ = false;
  if (!is_plausible(answer.counts)) {
    if (++implausible_ >= kImplausibleAtMost) phase_ = Phase::kLost;
    return;
  }
  implausible_ = 0;
  phase_ = Phase::kReady;
  remember(answer.counts);
  // A button that bounces, or is held on, after the arm was homed: it is home. Homed anew it would be so only once it
  // is still again, wherever the hand has brought it by then. The board forgets a press when its counts are set: to
  // those that it told, for the neutral ones each time would hide a slow hand.
  const bool is_new_press = answer.asks_to_home && answered_ns_ - asked_to_home_ns_ > kBounce_ns;
  if (answer.asks_to_home) asked_to_home_ns_ = answered_ns_;
  is_pressed_at_home_ = answer.asks_to_home && distance(answer.counts, arm_.neutral_counts) <= kStill_counts;
  if (is_new_press && !is_pressed_at_home_) {
    start_homing();
    homing_from_ = still_at_ = answer.counts;
    is_button_pressed_ = true;
  }
}

// Whether the arm can have come there since the last reading.
bool WoodenHapticsDriver::is_plausible(const std::array<std::int16_t, 6>& counts) const {
  if (!codecs::can_reach(arm_, codecs::body_angles_rad(arm_, counts))) return false;
  const glm::dvec3 counts_per_rad =
      arm_.counts_per_turn * arm_.body_diameter_m / arm_.capstan_diameter_m / (2 * std::numbers::pi);
  const double elapsed_s = static_cast<double>(answered_ns_ - counts_ns_) * 1e-9;
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double most = kSlack_counts + kMaxSpeed_rad_s * elapsed_s * std::abs(counts_per_rad[i]);
    if (std::abs(counts[at] - counts_[at]) > most) return false;
  }
  return true;
}

void WoodenHapticsDriver::remember(const std::array<std::int16_t, 6>& counts) {
  counts_ = counts;
  counts_ns_ = answered_ns_;
  velocity_.update({.p = codecs::handle_B_m(arm_, codecs::body_angles_rad(arm_, counts))}, answered_ns_);
}

std::string WoodenHapticsDriver::advice() const {
  switch (phase_) {
    case Phase::kOpening:
      if (now_ns_() - opened_ns_ < kMute_ns) return "waiting for the WoodenHaptics to answer";
      return "the WoodenHaptics does not answer: see whether its motor supply is on, and press its board's reset";
    case Phase::kHoming:
      if (has_moved_) return "hold the arm still in its neutral pose: upper arm upright, forearm level, straight ahead";
      return "put the arm into its neutral pose: upper arm upright, forearm level, straight ahead; hold it there for 2 "
             "s";
    case Phase::kSettingCounts:
      return "hold the arm still: its encoders are being set";
    case Phase::kSilent:
      return "the WoodenHaptics fell silent: force is off until it answers; see its cable and its supply";
    case Phase::kLost:
      return "the WoodenHaptics lost count of where it is: unplug it, plug it in again and home it";
    case Phase::kGone:
      return "the WoodenHaptics was unplugged: plug it in again";
    case Phase::kReady:
      break;
  }
  return {};
}

std::optional<ZeroForce> WoodenHapticsDriver::zero_force() const {
  if (channel_->descriptor() < 0) return std::nullopt;
  ZeroForce zero;
  zero.fd = channel_->descriptor();
  zero.how = ZeroForce::How::kWrite;
  zero.size = kNoCurrent.size();
  std::copy(kNoCurrent.begin(), kNoCurrent.end(), zero.bytes.begin());
  return zero;
}

}  // namespace farfeel::devices
