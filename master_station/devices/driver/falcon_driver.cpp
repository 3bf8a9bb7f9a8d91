#include "master_station/devices/driver/falcon_driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "codecs/device/ftdi.h"

namespace farfeel::devices {

namespace {

using codecs::FalconCommand, codecs::FalconReading, codecs::FtdiRequest;

constexpr std::uint16_t kRunningBaud = 0x2;
constexpr std::array kRunning{codecs::ftdi_latency_ms(1),     codecs::ftdi_baud(kRunningBaud),
                              codecs::kFtdiEightBitsNoParity, codecs::kFtdiNoFlowControl,
                              codecs::kFtdiPurgeReceived,     codecs::kFtdiPurgeToSend};

constexpr std::int64_t kSilent_ns = 20'000'000;        // a packet unanswered so long is a fault
constexpr std::int64_t kSayAgain_ns = 5'000'000;       // five of its millisecond: the packet or its answer was lost
constexpr std::int64_t kProbe_ns = 300'000'000;        // does its firmware run?
constexpr std::int64_t kStart_ns = 2'000'000'000;      // the same, just after loading
constexpr std::int64_t kHealthy_ns = 100'000'000;      // good replies so long end a fault
constexpr std::int64_t kGiveUp_ns = 3'000'000'000;     // a fault so long: it may have lost its power, and begins anew
constexpr std::int64_t kLoadAgain_ns = 5'000'000'000;  // after kMostLoadings failed
constexpr int kMostDoubted = 5;                        // in a row, then it is the device that moved, or forgot its home

constexpr int kEnoughPlaced = 10;  // homed readings in a row: a broken one alone makes nobody ready

// The grip moves at 5 m/s at most, on levers from 60 mm: 83 rad/s are 131 counts in a millisecond. There is no
// checksum, so that is what tells a broken reading.
constexpr double kMostCountsPerMs = 131;
constexpr double kLongestGap_ms = 20;  // over which that is granted; after that it is a fault anyway

/// F to B: x to the right stays, y away from the person is -z, z up is y.
glm::dvec3 turned_to_B(const glm::dvec3& v_F) noexcept {
  return {v_F.x, -v_F.z, v_F.y};
}
glm::dvec3 turned_to_F(const glm::dvec3& v_B) noexcept {
  return {v_B.x, v_B.z, -v_B.y};
}

constexpr FalconCommand kNoForce{.motors = {}, .lights = codecs::kFalconRed, .is_homing = true};

}  // namespace

FalconDriver::FalconDriver(FoundDevice found, std::unique_ptr<UsbChannel> channel, std::vector<std::byte> firmware,
                           Clock clock)
    : found_(std::move(found)),
      channel_(std::move(channel)),
      loader_(firmware),
      has_firmware_(!firmware.empty()),
      clock_(std::move(clock)) {
  since_ns_ = clock_();
}

FalconDriver::~FalconDriver() {
  const bool may_push = phase_ == Phase::kHoming || phase_ == Phase::kReady || phase_ == Phase::kFault;
  if (!may_push) return;
  // The packet before may still be under way; after that, this one has to get out before the channel goes.
  constexpr std::int64_t kTry_ns = 20'000'000, kSettle_ns = 3'000'000;
  const auto packet = codecs::encoded(kNoForce);
  std::array<std::byte, 512> transfer;
  const std::int64_t end_ns = clock_() + kTry_ns;
  Transferred sent = channel_->send(packet);
  while (sent.state == ChannelState::kNothing && clock_() < end_ns) {
    if (channel_->receive(transfer, clock_() + 1'000'000).state == ChannelState::kGone) return;
    sent = channel_->send(packet);
  }
  for (const std::int64_t until_ns = clock_() + kSettle_ns; sent.state == ChannelState::kDone && clock_() < until_ns;)
    if (channel_->receive(transfer, until_ns).state != ChannelState::kDone) break;
}

Stage FalconDriver::stage() const noexcept {
  switch (phase_) {
    case Phase::kSetUp:
    case Phase::kProbe:
      return is_loaded_ ? Stage::kFirmware : Stage::kOpening;
    case Phase::kLoad:
    case Phase::kNeedsFile:
      return Stage::kFirmware;
    case Phase::kHoming:
      return Stage::kHoming;
    case Phase::kReady:
      return Stage::kReady;
    case Phase::kFault:
      return Stage::kFault;
    case Phase::kGone:
      break;
  }
  return Stage::kAbsent;
}

std::string FalconDriver::advice() const {
  switch (phase_) {
    case Phase::kSetUp:
    case Phase::kProbe:
      return "the Falcon is being asked whether its firmware runs";
    case Phase::kLoad:
      return "firmware is being loaded into the Falcon; this takes some seconds, and needs its power supply";
    case Phase::kNeedsFile:
      return "the Falcon does not answer: connect its power supply; it needs its firmware after that, which Novint's "
             "licence keeps out of this program. Novint's driver for Windows installs it as a .bin file, and so does "
             "libnifalcon: name it with --firmware FILE";
    case Phase::kHoming:
      return "hold the Falcon's grip, pull it all the way out towards you, then push it all the way in, until its red "
             "light turns blue";
    case Phase::kFault:
      if (loader_.has_failed())
        return fmt::format(
            "{} tries to load firmware into the Falcon failed: {}. Connect its power supply; it is tried "
            "again",
            FalconLoader::kMostLoadings, loader_.trouble());
      return fmt::format("the Falcon has no force: {}", trouble_);
    case Phase::kGone:
      return "the Falcon was unplugged: plug it in again";
    case Phase::kReady:
      break;
  }
  return {};
}

std::optional<ZeroForce> FalconDriver::zero_force() const {
  const bool runs = phase_ == Phase::kHoming || phase_ == Phase::kReady || phase_ == Phase::kFault;
  if (!runs || channel_->descriptor() < 0) return std::nullopt;
  ZeroForce zero{.fd = channel_->descriptor(),
                 .how = ZeroForce::How::kUsbBulk,
                 .endpoint = channel_->out_endpoint(),
                 .size = codecs::kFalconPacketBytes,
                 .bytes = {}};
  std::ranges::copy(codecs::encoded(kNoForce), zero.bytes.begin());
  return zero;
}

FalconCounts FalconDriver::counts() const noexcept {
  FalconCounts counts = counts_;
  counts.readings = stream_.readings();
  counts.discarded_bytes = stream_.discarded_bytes();
  return counts;
}

void FalconDriver::enter(Phase phase, std::int64_t now_ns) noexcept {
  phase_ = phase;
  since_ns_ = now_ns;
  request_ = 0;
  if (phase == Phase::kSetUp || phase == Phase::kLoad) {
    stream_.forget();
    has_reading_ = false;
    said_ns_ = unanswered_since_ns_ = good_since_ns_ = 0;
  }
}

void FalconDriver::fault(std::string_view trouble, std::int64_t now_ns) noexcept {
  trouble_ = trouble;
  if (phase_ != Phase::kFault) ++counts_.faults;
  enter(Phase::kFault, now_ns);
  good_since_ns_ = 0;
  doubted_ = placed_ = 0;
  has_reading_ = false;  // the next one is a new beginning
  said_ns_ = 0;          // zero force goes out with the next step, whatever is still unanswered
}

void FalconDriver::set_up(std::int64_t now_ns) noexcept {
  const FtdiRequest& one = kRunning[request_];
  const Transferred done = channel_->control(codecs::kFtdiRequestType, one.request, one.value, 0);
  if (done.state == ChannelState::kGone) return enter(Phase::kGone, now_ns);
  if (done.state != ChannelState::kDone)
    return fault("its USB chip refuses to be set up; unplug it, plug it in again", now_ns);
  if (++request_ == kRunning.size()) enter(Phase::kProbe, now_ns);
}

void FalconDriver::load(std::int64_t now_ns, std::int64_t deadline_ns) noexcept {
  switch (loader_.step(*channel_, now_ns, deadline_ns)) {
    case FalconLoader::Progress::kGoesOn:
      return;
    case FalconLoader::Progress::kGone:
      return enter(Phase::kGone, now_ns);
    case FalconLoader::Progress::kLoaded:
      is_loaded_ = true;
      return enter(Phase::kSetUp, now_ns);
    case FalconLoader::Progress::kFailed:
      return fault(loader_.trouble(), now_ns);
  }
}

Stage FalconDriver::step(std::int64_t deadline_ns, const Command& command, Sample& newest) {
  const std::int64_t now_ns = clock_();
  switch (phase_) {
    case Phase::kSetUp:
      set_up(now_ns);
      break;
    case Phase::kLoad:
      load(now_ns, deadline_ns);
      break;
    case Phase::kGone:
      break;
    default:
      exchange(now_ns, deadline_ns, command, newest);
      break;
  }
  newest.polled_ns = now_ns;
  newest.stage = stage();
  return newest.stage;
}

void FalconDriver::exchange(std::int64_t now_ns, std::int64_t deadline_ns, const Command& command,
                            Sample& newest) noexcept {
  constexpr int kMostWaiting = 64;  // transfers: more than any channel keeps
  const std::uint64_t readings = stream_.readings();
  for (int i = 0; i < kMostWaiting && listen(now_ns, newest); ++i) {
  }
  judge(now_ns);
  if (phase_ == Phase::kGone || phase_ == Phase::kSetUp || phase_ == Phase::kLoad) return;
  if (said_ns_ == 0 || unanswered_since_ns_ == 0 || now_ns - said_ns_ >= kSayAgain_ns) say(now_ns, command);
  // A new reading is not kept back: the step ends with it, and with the next packet on its way, so that the exchange
  // runs as fast as the device answers.
  if (stream_.readings() != readings) return;
  while (unanswered_since_ns_ != 0 && listen(deadline_ns, newest)) {
  }
  if (phase_ != Phase::kGone && unanswered_since_ns_ == 0) say(clock_(), command);
}

/// One transfer, if there is one until then.
bool FalconDriver::listen(std::int64_t until_ns, Sample& newest) noexcept {
  std::array<std::byte, 512> transfer, payload;
  const Transferred came = channel_->receive(transfer, until_ns);
  const std::int64_t now_ns = clock_();
  if (came.state == ChannelState::kGone) enter(Phase::kGone, now_ns);
  if (came.state == ChannelState::kStalled) ++counts_.stalls;
  if (came.state != ChannelState::kDone) return false;
  const std::size_t n = codecs::ftdi_payload(std::span(transfer).first(came.bytes), payload);
  if (const auto reading = stream_.take(std::span(payload).first(n))) take(*reading, now_ns, newest);
  return true;
}

bool FalconDriver::is_plausible(const FalconReading& reading, std::int64_t now_ns) const noexcept {
  if (!has_reading_) return true;
  if (!reading.is_homed()) return false;
  const double most = kMostCountsPerMs * std::clamp(static_cast<double>(now_ns - read_ns_) * 1e-6, 1.0, kLongestGap_ms);
  for (std::size_t i = 0; i < 3; ++i)
    if (std::abs(reading.counts[i] - reading_.counts[i]) > most) return false;
  return true;
}

void FalconDriver::take(const FalconReading& reading, std::int64_t now_ns, Sample& newest) noexcept {
  unanswered_since_ns_ = 0;
  if (good_since_ns_ == 0) good_since_ns_ = now_ns;
  const auto angles = codecs::falcon_angles_of_counts(reading.counts);
  std::optional<glm::dvec3> p_F;
  if (reading.is_homed()) p_F = codecs::falcon_position(angles);
  const bool is_placed = p_F.has_value();
  if (!is_plausible(reading, now_ns) || (reading.is_homed() && !is_placed)) {
    ++counts_.implausible;
    if (phase_ != Phase::kReady) {  // what it believes begins anew
      good_since_ns_ = 0;
      placed_ = 0;
      has_reading_ = false;
    } else if (++doubted_ == kMostDoubted) {
      fault(reading.is_homed() ? "its arms' angles jump, or fit no place of its grip; move the grip to its middle"
                               : "it forgot where its grip is",
            now_ns);
    }
    return;
  }
  doubted_ = 0;
  reading_ = reading;
  newest.buttons = reading.buttons;
  placed_ = is_placed ? std::min(placed_ + 1, kEnoughPlaced) : 0;
  if (!has_reading_) velocity_ = {};
  has_reading_ = is_placed;
  if (!is_placed) return;
  const glm::dvec3 p_B = turned_to_B(*p_F - codecs::kFalconMiddle_F_m);
  newest.X_BD.p = p_B;
  velocity_.update(newest.X_BD, now_ns);
  newest.V_BD_B = velocity_.twist();
  jacobian_ = codecs::falcon_jacobian(*p_F, angles);
  newest.time_ns = now_ns;
  ++newest.reports;
  read_ns_ = now_ns;
}

/// What time has done to the phase.
void FalconDriver::judge(std::int64_t now_ns) noexcept {
  const std::int64_t in_phase_ns = now_ns - since_ns_;
  const bool answers = good_since_ns_ != 0;
  const bool is_silent = unanswered_since_ns_ != 0 && now_ns - unanswered_since_ns_ > kSilent_ns;
  if (is_silent) good_since_ns_ = 0;
  const Phase known = placed_ == kEnoughPlaced ? Phase::kReady : Phase::kHoming;
  switch (phase_) {
    case Phase::kProbe:
      if (answers) {
        enter(Phase::kHoming, now_ns);
      } else if (in_phase_ns > (is_loaded_ ? kStart_ns : kProbe_ns)) {
        if (is_loaded_) return fault("its firmware was loaded, but does not run", now_ns);
        if (!has_firmware_) return enter(Phase::kNeedsFile, now_ns);
        loader_.begin();
        enter(Phase::kLoad, now_ns);
      }
      break;
    case Phase::kNeedsFile:  // somebody may connect its power, with firmware from before
      if (answers) enter(Phase::kHoming, now_ns);
      break;
    case Phase::kHoming:
      if (is_silent) return fault("it does not answer", now_ns);
      if (known == Phase::kReady) enter(Phase::kReady, now_ns);
      break;
    case Phase::kReady:
      if (is_silent) return fault("it does not answer", now_ns);
      break;
    case Phase::kFault:
      if (answers && !is_silent && now_ns - good_since_ns_ > kHealthy_ns) return enter(known, now_ns);
      if (!answers && in_phase_ns > (loader_.has_failed() ? kLoadAgain_ns : kGiveUp_ns)) {
        is_loaded_ = false;
        enter(Phase::kSetUp, now_ns);
      }
      break;
    default:
      break;
  }
}

FalconCommand FalconDriver::obeyed(const Command& command) noexcept {
  FalconCommand out = kNoForce;
  if (phase_ != Phase::kReady) return out;
  out.lights = command.is_light_on ? codecs::kFalconBlue | codecs::kFalconGreen : codecs::kFalconBlue;
  if (!command.is_force_on) return out;
  out.lights = codecs::kFalconGreen;
  const codecs::FalconMotors motors =
      jacobian_ ? codecs::falcon_motors(*jacobian_, turned_to_F(command.F_hand_B.force_N)) : codecs::FalconMotors{};
  if (motors.share == 0) ++counts_.refused_forces;
  if (motors.share > 0 && motors.share < 1) ++counts_.weaker_forces;
  out.motors = motors.values;
  return out;
}

void FalconDriver::say(std::int64_t now_ns, const Command& command) noexcept {
  const Transferred sent = channel_->send(codecs::encoded(obeyed(command)));
  if (sent.state == ChannelState::kGone) return enter(Phase::kGone, now_ns);
  if (sent.state == ChannelState::kStalled) ++counts_.stalls;
  // What was not taken counts as unanswered, too: a device that takes nothing is silent.
  if (unanswered_since_ns_ == 0) unanswered_since_ns_ = now_ns;
  if (sent.state == ChannelState::kDone) said_ns_ = now_ns;
}

}  // namespace farfeel::devices
