#include "master_station/session/haptic_lane.h"

#include <algorithm>
#include <array>
#include <limits>

#include "transport/packet.h"

namespace farfeel::master_station {
namespace {

constexpr int kMostDatagramsAtOnce = 64;           // of one poll: bounds a tick while somebody floods the port
constexpr std::int64_t kPublish_ns = 100'000'000;  // the histogram is some kilobytes: not every tick
constexpr std::int64_t kMostRoundTrip_ns = 10'000'000'000;

}  // namespace

HapticLane::HapticLane(transport::UdpSocket socket)
    : socket_(std::move(socket)), round_trip_ms_(std::numeric_limits<double>::quiet_NaN()) {}

void HapticLane::adopt_session() noexcept {
  const std::uint32_t id = session_.load(std::memory_order_acquire);
  if (id == live_) return;
  live_ = id;
  sequence_ = 0;
  before_ = counters_.contact_sets;
  window_ = {};
  newest_.times = {};  // an echo of the last session means nothing to this one
  heard_ns_.store(0, std::memory_order_relaxed);
}

void HapticLane::send(const ToolState& state) noexcept {
  adopt_session();
  if (live_ == 0) return;
  codecs::PoseSample sample;
  sample.sequence = state.sequence;
  sample.time_ns = state.time_ns;
  sample.X_WT = state.X_WT;
  sample.V_WT_W = state.V_WT_W;
  sample.controller = state.controller;
  sample.line = state.line;
  sample.wants_curvature = wants_curvature_;
  sample.ahead_us = wants_curvature_ ? ahead_us_ : 0;
  const std::int64_t now_ns = transport::monotonic_ns();
  sample.times.t_send_ns = now_ns;
  sample.times.t_echo_ns = newest_.times.t_send_ns;
  if (sample.times.t_echo_ns != 0) {
    const std::int64_t hold_us = (now_ns - newest_arrival_ns_ + 500) / 1000;
    sample.times.hold_us = static_cast<std::uint32_t>(std::clamp<std::int64_t>(hold_us, 0, 0xFFFF'FFFF));
  }
  std::array<std::byte, transport::kHeaderBytes + codecs::kPoseSampleBytes + codecs::kLineBytes> datagram;
  const auto room = std::span(datagram).subspan(transport::kHeaderBytes);
  const std::size_t size = codecs::write(sample, room);
  const std::size_t total =
      transport::write_packet({transport::PacketType::kPoseSample, live_, ++sequence_}, room.first(size), datagram);
  ++(socket_.send(std::span(datagram).first(total)) ? counters_.poses_sent : counters_.poses_unsent);
  publish(now_ns);
}

bool HapticLane::poll(contact::ContactSet& newest) noexcept {
  adopt_session();
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  bool has_new = false;
  for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
    const auto received = socket_.receive(buffer);
    if (!received) break;
    has_new = accept(*received) || has_new;
  }
  if (has_new) newest = newest_.set;
  return has_new;
}

// A datagram changes something only if all of it is right: session, payload, and then its place in the order. The
// socket is connected, so the sender is right already.
bool HapticLane::accept(const transport::Received& received) noexcept {
  const transport::Packet packet = transport::read_packet(received.bytes);
  if (!packet.ok() || packet.header.type != transport::PacketType::kContactSet) return false;
  if (live_ == 0 || packet.header.session != live_) return false;
  codecs::ContactAnswer answer;
  if (codecs::read(packet.payload, answer) != codecs::Fault::kNone) {
    ++counters_.malformed;
    return false;
  }
  const auto verdict = window_.accept(packet.header.sequence);
  if (verdict == transport::SequenceWindow::Verdict::kAbsurd) {
    ++counters_.malformed;
    return false;
  }
  counters_.contact_sets = before_ + window_.counters();
  heard_ns_.store(received.time_ns, std::memory_order_relaxed);
  if (verdict != transport::SequenceWindow::Verdict::kNewest) return false;
  newest_ = answer;
  newest_arrival_ns_ = received.time_ns;
  counters_.contacts_left_out += answer.left_out;
  ahead_us_ = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>((transport::monotonic_ns() - answer.times.t_echo_ns) / 1000, 0, codecs::kMostAhead_us));
  counters_.doubts.add(answer.set);
  const std::int64_t trip_ns = received.time_ns - answer.times.t_echo_ns - std::int64_t{answer.times.hold_us} * 1000;
  if (answer.times.t_echo_ns != 0 && trip_ns < kMostRoundTrip_ns) {
    // Holds are rounded to microseconds and arrivals come from another clock: a hair below zero is zero.
    round_trips_.add(std::max<std::int64_t>(trip_ns, 0));
    round_trip_ms_ = static_cast<double>(std::max<std::int64_t>(trip_ns, 0)) * 1e-6;
  }
  return true;
}

void HapticLane::publish(std::int64_t now_ns) noexcept {
  published_counters_.store(counters_);
  if (now_ns - published_ns_ < kPublish_ns) return;
  published_ns_ = now_ns;
  published_round_trips_.store(round_trips_);
}

const HapticLane::Counters& HapticLane::counters() noexcept {
  published_counters_.refresh();
  return published_counters_.latest();
}

const realtime::Histogram& HapticLane::round_trips() noexcept {
  published_round_trips_.refresh();
  return published_round_trips_.latest();
}

}  // namespace farfeel::master_station
