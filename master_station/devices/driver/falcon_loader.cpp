#include "master_station/devices/driver/falcon_loader.h"

#include <algorithm>

#include "codecs/device/ftdi.h"

namespace farfeel::devices {

namespace {

using codecs::FtdiRequest;

constexpr std::uint16_t kGreetingBaud = 0x4138, kLoadingBaud = 0x15;
constexpr std::uint8_t kLatency_ms = 16;  // at 1 ms, its echoes are known to come in pieces that loaders trip over

constexpr std::array kWaking{codecs::kFtdiPurgeReceived,
                             codecs::kFtdiPurgeToSend,
                             codecs::ftdi_latency_ms(kLatency_ms),
                             codecs::ftdi_baud(kGreetingBaud),
                             codecs::kFtdiEightBitsNoParity,
                             codecs::kFtdiNoFlowControl,
                             codecs::kFtdiRtsLow,
                             codecs::kFtdiDtrLow,
                             codecs::kFtdiDtrHigh};
constexpr std::array kFaster{codecs::kFtdiDtrLow, codecs::ftdi_baud(kLoadingBaud)};

constexpr std::array kGreeting{std::byte{0x0a}, std::byte{0x43}, std::byte{0x0d}};
constexpr std::array kGreetingBack{std::byte{0x0a}, std::byte{0x44}, std::byte{0x2c}, std::byte{0x0d}};
constexpr std::array kSecond{std::byte{'A'}};

constexpr int kMostGreetings = 25;  // a second: who is not powered never answers, and is to be told soon
constexpr std::int64_t kGreetAgain_ns = 40'000'000;  // two of the chip's latencies, and some
constexpr std::int64_t kAnswerWithin_ns = 200'000'000;
constexpr std::size_t kBlock = codecs::kFtdiPacketBytes - codecs::kFtdiStatusBytes;  // its echo fills one packet

}  // namespace

void FalconLoader::begin() noexcept {
  loading_ = 0;
  enter(Phase::kWake, 0);
}

void FalconLoader::enter(Phase phase, std::int64_t now_ns) noexcept {
  phase_ = phase;
  request_ = 0;
  greetings_ = 0;
  at_ = block_ = echoed_ = 0;
  is_said_ = is_wrong_ = is_answered_ = false;
  heard_ = {};
  since_ns_ = now_ns;
}

FalconLoader::Progress FalconLoader::fail(std::string_view trouble, std::int64_t now_ns) noexcept {
  trouble_ = trouble;
  enter(Phase::kWake, now_ns);
  return ++loading_ < kMostLoadings ? Progress::kGoesOn : Progress::kFailed;
}

FalconLoader::Progress FalconLoader::request(UsbChannel& channel, std::int64_t now_ns) noexcept {
  const std::span<const FtdiRequest> all =
      phase_ == Phase::kWake ? std::span<const FtdiRequest>(kWaking) : std::span<const FtdiRequest>(kFaster);
  const FtdiRequest& one = all[request_];
  const Transferred done = channel.control(codecs::kFtdiRequestType, one.request, one.value, 0);
  if (done.state == ChannelState::kGone) return Progress::kGone;
  if (done.state != ChannelState::kDone) return fail("it refuses to be set up", now_ns);
  if (++request_ == all.size()) enter(phase_ == Phase::kWake ? Phase::kGreet : Phase::kSecond, now_ns);
  return Progress::kGoesOn;
}

void FalconLoader::hear(std::span<const std::byte> bytes, std::int64_t now_ns) noexcept {
  for (const std::byte byte : bytes) {
    std::shift_left(heard_.begin(), heard_.end(), 1);
    heard_.back() = byte;
    switch (phase_) {
      case Phase::kGreet:
        is_answered_ = is_answered_ || heard_ == kGreetingBack;
        break;
      case Phase::kSecond:
        is_answered_ = is_answered_ || byte == kSecond[0];
        break;
      case Phase::kBlocks:
        if (echoed_ >= block_ || firmware_[at_ + echoed_] != byte) is_wrong_ = true;
        if (!is_wrong_) ++echoed_;
        since_ns_ = now_ns;
        break;
      default:
        break;
    }
  }
}

void FalconLoader::say(UsbChannel& channel, std::span<const std::byte> bytes, std::int64_t now_ns) noexcept {
  is_said_ = channel.send(bytes).state == ChannelState::kDone;
  if (is_said_) since_ns_ = now_ns;
}

FalconLoader::Progress FalconLoader::converse(UsbChannel& channel, std::int64_t now_ns) noexcept {
  const std::int64_t waited_ns = now_ns - since_ns_;
  switch (phase_) {
    case Phase::kGreet:
      if (is_answered_) {
        enter(Phase::kFaster, now_ns);
      } else if (!is_said_ || waited_ns > kGreetAgain_ns) {
        if (greetings_ == kMostGreetings) return fail("its boot loader does not answer", now_ns);
        say(channel, kGreeting, now_ns);
        greetings_ += is_said_ ? 1 : 0;
      }
      break;
    case Phase::kSecond:
      if (is_answered_) {
        enter(Phase::kBlocks, now_ns);
      } else if (!is_said_) {
        say(channel, kSecond, now_ns);
      }
      if (waited_ns > kAnswerWithin_ns) return fail("its boot loader does not answer at the loading speed", now_ns);
      break;
    case Phase::kBlocks:
      if (is_wrong_) return fail("it echoed another byte than was sent", now_ns);
      if (is_said_ && echoed_ == block_) {
        at_ += block_;
        block_ = echoed_ = 0;
        is_said_ = false;
        if (at_ == firmware_.size()) return Progress::kLoaded;
      }
      if (!is_said_) {
        block_ = std::min(kBlock, firmware_.size() - at_);
        say(channel, std::span(firmware_).subspan(at_, block_), now_ns);
      }
      if (waited_ns > kAnswerWithin_ns) return fail("it did not echo all that was sent", now_ns);
      break;
    default:
      break;
  }
  return Progress::kGoesOn;
}

FalconLoader::Progress FalconLoader::step(UsbChannel& channel, std::int64_t now_ns, std::int64_t deadline_ns) noexcept {
  if (phase_ == Phase::kWake || phase_ == Phase::kFaster) return request(channel, now_ns);
  // What came is heard before time is judged; what comes until the deadline is judged in the next step.
  std::array<std::byte, 512> transfer, payload;
  constexpr int kMostWaiting = 64;  // transfers: more than any channel keeps
  ChannelState state = ChannelState::kDone;
  const auto listen = [&](std::int64_t until_ns) {
    const Transferred came = channel.receive(transfer, until_ns);
    state = came.state;
    if (state != ChannelState::kDone) return;
    hear(std::span(payload).first(codecs::ftdi_payload(std::span(transfer).first(came.bytes), payload)), now_ns);
  };
  for (int i = 0; i < kMostWaiting && state == ChannelState::kDone; ++i) listen(now_ns);
  if (state == ChannelState::kGone) return Progress::kGone;
  if (state == ChannelState::kStalled) return fail("an endpoint of it stalls", now_ns);
  const Phase before = phase_;
  const Progress progress = converse(channel, now_ns);
  if (progress == Progress::kGoesOn && phase_ == before) listen(deadline_ns);
  return state == ChannelState::kGone ? Progress::kGone : progress;
}

}  // namespace farfeel::devices
