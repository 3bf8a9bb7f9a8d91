#include "master_station/session/haptic_lane.h"

#include <algorithm>
#include <array>
#include <limits>

#include "transport/message.h"

namespace farfeel::master_station {
namespace {

constexpr int kMostDatagramsAtOnce = 64;           // of one poll: bounds a tick while somebody floods the port
constexpr std::int64_t kPublish_ns = 100'000'000;  // the histogram is some kilobytes: not every tick
// Poses go up at 2 kHz at most, whatever the loop's rate; a tick's share early, so that a rate of just that loses none.
constexpr std::int64_t kPosePeriod_ns = 500'000, kPoseEarly_ns = 100'000;

}  // namespace

HapticLane::HapticLane(transport::UdpSocket socket, const transport::WakeEvent& for_io)
    : socket_(std::move(socket)), for_io_(for_io), round_trip_ms_(std::numeric_limits<double>::quiet_NaN()) {}

// Keys first: the io thread tells of a session before it gives keys for it, so each one's session is seen below.
void HapticLane::adopt_session() noexcept {
  transport::LaneKeys keys;
  const bool has_keys = keys_.pop(keys);
  path_.refresh();
  if (session_.refresh() && session_.latest().id != live_) {
    live_ = session_.latest().id;
    lane_.forget();
    poses_.reset(session_.latest().grid);
    answers_.reset();
    has_newest_ = false;  // an echo of the last session means nothing to this one
    heard_ns_.store(0, std::memory_order_relaxed);
  }
  if (!has_keys || keys.session != live_) return;
  lane_.adopt(keys);
  ++meters_.handshakes;
}

void HapticLane::send(const ToolState& state) noexcept {
  adopt_session();
  const std::int64_t now_ns = transport::monotonic_ns();
  used_ns_.store(now_ns, std::memory_order_relaxed);
  if (live_ == 0 || !lane_.can_send(now_ns)) return;
  const bool counts_every_one = state.line.moves_remote_tool();
  if (!counts_every_one && now_ns < next_pose_ns_ - kPoseEarly_ns) return;
  next_pose_ns_ = std::max(next_pose_ns_ + kPosePeriod_ns, now_ns);
  codecs::PoseMessage pose;
  pose.sequence = state.sequence;
  pose.time_us = state.time_ns / 1000;
  pose.X_WT = state.X_WT;
  pose.V_WT_W = state.V_WT_W;
  pose.line = state.line;
  pose.wants_curvature = wants_curvature_;
  pose.ahead_us = wants_curvature_ ? ahead_us_ : 0;
  pose.heard = answers_.heard(poses_);
  pose.times = has_newest_ ? codecs::times_now(newest_.times.t_send_us, newest_arrival_ns_, now_ns)
                           : codecs::LaneTimes{static_cast<std::uint32_t>(now_ns / 1000), 0, codecs::kLongHold};
  std::array<std::byte, transport::kMaxDatagramBytes> datagram;
  const auto room = std::span(datagram).subspan(transport::kDataHeaderBytes + 1, transport::kMaxMessageBytes);
  const std::size_t size = poses_.write(pose, room);
  if (size == 0) return;  // not a pose: nothing is told
  const std::size_t total =
      lane_.seal(static_cast<std::uint8_t>(transport::MessageType::kPoseSample), room.first(size), datagram, now_ns);
  const bool is_sent = send_sealed(std::span(datagram).first(total));
  ++(is_sent ? counters_.poses_sent : counters_.poses_unsent);
  meters_.sent_bytes += is_sent ? total : 0;
  publish(now_ns);
}

bool HapticLane::poll(contact::ContactSet& newest) noexcept {
  adopt_session();
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  bool has_new = false;
  for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
    const auto received = socket_.receive(buffer);
    if (!received) break;
    has_new = accept(*received, std::span(buffer).first(received->bytes.size())) || has_new;
  }
  if (has_new) newest = newest_.set;
  return has_new;
}

bool HapticLane::accept(const transport::Received& received, std::span<std::byte> bytes) noexcept {
  if (transport::receiver_index(bytes) == 0) {
    if (handshakes_.push(transport::RawDatagram(received))) for_io_.signal();
    return false;
  }
  const auto opened = lane_.open(bytes, received.time_ns);
  counters_.contact_sets = lane_.counters();
  if (!opened) return false;
  heard_ns_.store(received.time_ns, std::memory_order_relaxed);
  meters_.down.on_datagram(received);
  switch (static_cast<transport::MessageType>(opened->type)) {
    case transport::MessageType::kContactSet:
      return opened->is_newest && take_contacts(opened->message, received.time_ns);
    case transport::MessageType::kChallenge:
      answer_challenge(opened->message);
      return false;
    default:
      return false;
  }
}

void HapticLane::answer_challenge(std::span<const std::byte> challenge) noexcept {
  std::array<std::byte, transport::kMaxDatagramBytes> datagram;
  const std::size_t size = lane_.seal(static_cast<std::uint8_t>(transport::MessageType::kChallengeAnswer), challenge,
                                      datagram, transport::monotonic_ns());
  send_sealed(std::span(datagram).first(size));
}

bool HapticLane::send_sealed(std::span<const std::byte> datagram) noexcept {
  const transport::Address& to = path_.latest();
  return to.port == 0 ? socket_.send(datagram) : socket_.send_to(to, datagram);
}

bool HapticLane::take_contacts(std::span<const std::byte> payload, std::int64_t arrival_ns) noexcept {
  const codecs::Fault fault = answers_.read(payload, poses_, newest_);
  if (fault != codecs::Fault::kNone) {
    // One that is about a pose from before the session, or refers to what was lost, is no fault of anybody's.
    if (fault != codecs::Fault::kNoBase && fault != codecs::Fault::kOld) ++counters_.malformed;
    return false;
  }
  has_newest_ = true;
  newest_arrival_ns_ = arrival_ns;
  counters_.contacts_left_out += newest_.left_out;
  const auto since_asked_us =
      static_cast<std::int32_t>(static_cast<std::uint32_t>(transport::monotonic_ns() / 1000) - newest_.times.t_echo_us);
  ahead_us_ = static_cast<std::uint32_t>(std::clamp<std::int64_t>(since_asked_us, 0, codecs::kMostAhead_us));
  counters_.doubts.add(newest_.set);
  meters_.down.on_transit(newest_.times.t_send_us, static_cast<std::uint32_t>(arrival_ns / 1000));
  if (const auto trip_ns = codecs::round_trip_ns(newest_.times, arrival_ns)) {
    meters_.up.on_transit(newest_.times.t_echo_us, newest_.times.t_send_us - newest_.times.hold_us);
    meters_.round_trips.add(*trip_ns);
    round_trip_ms_ = static_cast<double>(*trip_ns) * 1e-6;
  }
  return true;
}

void HapticLane::publish(std::int64_t now_ns) noexcept {
  published_counters_.store(counters_);
  if (now_ns - published_ns_ < kPublish_ns) return;
  published_ns_ = now_ns;
  meters_.rejects = lane_.rejects();
  published_meters_.store(meters_);
}

const HapticLane::Counters& HapticLane::counters() noexcept {
  published_counters_.refresh();
  return published_counters_.latest();
}

const HapticLane::Meters& HapticLane::meters() noexcept {
  published_meters_.refresh();
  return published_meters_.latest();
}

}  // namespace farfeel::master_station
