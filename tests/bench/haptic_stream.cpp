#include "tests/bench/haptic_stream.h"

#include <array>
#include <cstring>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "transport/lane/lane_keys.h"

namespace farfeel::bench {
namespace {

using realtime::monotonic_now_ns;

constexpr std::uint32_t kContacts = 7;
constexpr std::size_t kUpBytes = codecs::kPoseMessageBytes;
constexpr std::size_t kDownBytes = codecs::kAnswerBlockBytes + kContacts * codecs::kContactBytes;
constexpr std::size_t kIpUdpBytes = 28;
constexpr std::int64_t kPeriod_ns = static_cast<std::int64_t>(1e9 / HapticStream::kRate_Hz);
constexpr std::int64_t kNap_ns = 5'000'000;

}  // namespace

std::size_t HapticStream::answer_wire_bytes() {
  return kDownBytes + transport::kSealBytes + kIpUdpBytes;
}

tl::expected<std::unique_ptr<HapticStream>, std::string> HapticStream::begin(const TwoEnds& ends) {
  const transport::Suite suite =
      is_available(transport::Suite::kAesGcm) ? transport::Suite::kAesGcm : transport::Suite::kChaChaPoly;
  auto lane = make_ours(ends, suite);
  if (!lane) return tl::unexpected(lane.error());
  return std::unique_ptr<HapticStream>(new HapticStream(std::move(*lane)));
}

HapticStream::HapticStream(std::unique_ptr<LinkMethod> lane) : lane_(std::move(lane)) {
  lane_->begin_turn();
  slave_ = std::thread([this] { answer(); });
  master_ = std::thread([this] { ask(); });
}

HapticStream::~HapticStream() {
  if (master_.joinable()) (void)end();
}

HapticStream::Summary HapticStream::end() {
  is_over_ = true;
  master_.join();
  slave_.join();
  return std::move(summary_);
}

void HapticStream::ask() {
  (void)realtime::use_fifo(kFifoPriority);
  LinkEnd& lane = lane_->master();
  std::array<std::byte, 1'500> answer;
  std::array<std::byte, kUpBytes> pose{};
  realtime::Deadlines deadlines(monotonic_now_ns() + kPeriod_ns, kPeriod_ns);
  while (!is_over_.load(std::memory_order_relaxed)) {
    lane.wait_until(deadlines.current_ns());
    while (lane.receive(answer) == kDownBytes) {
      std::int64_t sent_ns = 0;
      std::memcpy(&sent_ns, answer.data(), sizeof sent_ns);
      const auto passed_ns = static_cast<double>(monotonic_now_ns() - sent_ns);
      if (notes_.load(std::memory_order_relaxed)) summary_.rtt_ms.push_back(1e-6 * passed_ns);
    }
    const std::int64_t now_ns = monotonic_now_ns();
    if (now_ns < deadlines.current_ns()) continue;
    std::memcpy(pose.data(), &now_ns, sizeof now_ns);
    summary_.sent += lane.send(pose) ? 1 : 0;
    deadlines.advance(now_ns);
  }
}

void HapticStream::answer() {
  (void)realtime::use_fifo(kFifoPriority);
  LinkEnd& lane = lane_->slave();
  std::array<std::byte, 1'500> pose;
  std::array<std::byte, kDownBytes> answer{};
  while (!is_over_.load(std::memory_order_relaxed)) {
    lane.wait_until(monotonic_now_ns() + kNap_ns);
    while (lane.receive(pose) == kUpBytes) {
      std::memcpy(answer.data(), pose.data(), sizeof(std::int64_t));
      if (lane.send(answer)) answer_bytes_.fetch_add(answer_wire_bytes(), std::memory_order_relaxed);
    }
  }
}

}  // namespace farfeel::bench
