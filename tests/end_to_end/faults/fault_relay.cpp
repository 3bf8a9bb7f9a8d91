#include "tests/end_to_end/faults/fault_relay.h"

#include <algorithm>
#include <limits>

namespace farfeel::end_to_end {
namespace {

using transport::LaneKind;

constexpr std::int64_t kLongestWait_ns = 100'000'000;

/// As transport/PROTOCOL.md has it: an initiation names its lane, and the lowest bit of an index is its lane.
std::optional<LaneKind> lane_of(std::span<const std::byte> datagram) {
  if (datagram.size() < 8) return std::nullopt;
  const auto type = static_cast<transport::DatagramType>(datagram[0]);
  const bool is_bulk = type == transport::DatagramType::kInitiation ? datagram[3] == std::byte{1}
                                                                    : (datagram[4] & std::byte{1}) != std::byte{0};
  return is_bulk ? LaneKind::kBulk : LaneKind::kHaptic;
}

transport::UdpSocket socket_towards(const transport::Address& slave) {
  auto socket = transport::UdpSocket::open_towards(slave, {});
  if (!socket) throw std::runtime_error(socket.error().message);
  return *std::move(socket);
}

}  // namespace

FaultRelay::FaultRelay(const transport::Address& slave, std::uint64_t seed)
    : slave_(slave),
      front_(transport::UdpSocket::open(transport::loopback()).value()),
      local_(front_.local()),
      wake_(transport::WakeEvent::open().value()),
      seed_(seed),
      lanes_{Lane{{}, {}, {transport::Impairment({}, seed), transport::Impairment({}, seed)}, {}, {}, {}},
             Lane{{}, {}, {transport::Impairment({}, seed), transport::Impairment({}, seed)}, {}, {}, {}}} {
  for (Lane& lane : lanes_) lane.to_slave.emplace(socket_towards(slave_));
  thread_ = std::thread([this] { run(); });
}

FaultRelay::~FaultRelay() {
  is_over_ = true;
  wake_.signal();
  thread_.join();
}

template <typename Change>
std::int64_t FaultRelay::change(const Change& how) {
  std::int64_t now_ns = 0;
  {
    const std::lock_guard lock(mutex_);
    take_arrivals();  // what came before the change is treated as before it
    release_due();
    how();
    now_ns = transport::monotonic_ns();
  }
  wake_.signal();
  return now_ns;
}

std::int64_t FaultRelay::set_link(const transport::LinkSpec& spec) {
  return change([&] {
    for (Lane& lane : lanes_) {
      for (transport::Impairment& impairment : lane.impairments) impairment = transport::Impairment(spec, ++seed_);
    }
  });
}

std::int64_t FaultRelay::cut(LaneKind lane, Way way, bool is_cut) {
  return change([&] {
    Lane& here = lanes_[static_cast<std::size_t>(lane)];
    here.is_cut[way] = is_cut;
    std::erase_if(here.under_way, [&](const auto& one) { return one.second.first == way; });
  });
}

std::int64_t FaultRelay::cut_all(bool is_cut) {
  return change([&] {
    for (Lane& lane : lanes_) {
      lane.is_cut = {is_cut, is_cut};
      lane.under_way.clear();
    }
  });
}

std::int64_t FaultRelay::set_most_bytes(std::size_t bytes) {
  return change([&] { most_bytes_ = bytes; });
}

std::int64_t FaultRelay::rebind(LaneKind lane) {
  return change([&] {
    Lane& here = lanes_[static_cast<std::size_t>(lane)];
    here.to_slave.emplace(socket_towards(slave_));
    std::erase_if(here.under_way, [](const auto& one) { return one.second.first == kDown; });
  });
}

std::int64_t FaultRelay::next_release_ns() const {
  std::int64_t next_ns = std::numeric_limits<std::int64_t>::max();
  for (const Lane& lane : lanes_) {
    if (!lane.under_way.empty()) next_ns = std::min(next_ns, lane.under_way.begin()->first);
  }
  return next_ns;
}

void FaultRelay::run() {
  while (!is_over_) {
    transport::WaitSet wait;
    std::int64_t until_ns = transport::monotonic_ns() + kLongestWait_ns;
    wait.add(front_.descriptor());
    wait.add(wake_);
    {
      const std::lock_guard lock(mutex_);
      for (const Lane& lane : lanes_) wait.add(lane.to_slave->descriptor());
      until_ns = std::min(until_ns, next_release_ns());
    }
    wait.wait_until(until_ns);
    const std::lock_guard lock(mutex_);
    take_arrivals();
    release_due();
  }
}

void FaultRelay::take_arrivals() {
  std::array<std::byte, 2048> buffer;
  while (const auto received = front_.receive(buffer)) {
    const auto lane = lane_of(received->bytes);
    if (!lane) continue;
    Lane& here = lanes_[static_cast<std::size_t>(*lane)];
    here.master = received->from;
    take(here, kUp, *received);
  }
  for (Lane& lane : lanes_) {
    while (const auto received = lane.to_slave->receive(buffer)) take(lane, kDown, *received);
  }
}

void FaultRelay::take(Lane& lane, Way way, const transport::Received& received) {
  if (lane.is_cut[way] || received.bytes.size() > most_bytes_) return;
  std::int64_t& newest_ns = lane.newest_ns[way];
  newest_ns = std::max(newest_ns, received.time_ns);
  for (const std::int64_t release_ns : lane.impairments[way].releases(newest_ns, received.bytes.size()))
    lane.under_way.emplace(release_ns, std::pair(way, std::vector(received.bytes.begin(), received.bytes.end())));
}

void FaultRelay::release_due() {
  for (Lane& lane : lanes_) {
    while (!lane.under_way.empty()) {
      const std::int64_t now_ns = transport::monotonic_ns(), due_ns = lane.under_way.begin()->first;
      if (due_ns > now_ns) break;
      lateness_.note(now_ns, now_ns - due_ns);
      const auto& [way, bytes] = lane.under_way.begin()->second;
      if (way == kUp) {
        lane.to_slave->send(bytes);
      } else if (lane.master) {
        front_.send_to(*lane.master, bytes);
      }
      lane.under_way.erase(lane.under_way.begin());
    }
  }
}

}  // namespace farfeel::end_to_end
