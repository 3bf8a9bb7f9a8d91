#include "transport/link/relay.h"

#include <poll.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace farfeel::transport {
namespace {

constexpr std::size_t kMaxFlows = 16;          // masters' sockets at one time, restarts included
constexpr std::size_t kMaxPending = 1u << 16;  // datagrams on the way: 60 s at 1 kHz, or 78 MB of full ones
constexpr std::size_t kMaxErrors = 1u << 20;   // release errors kept for the quantiles
constexpr std::size_t kBufferBytes = 2048;     // more than any datagram of the protocol
constexpr int kMostDatagramsAtOnce = 64;       // of one socket, between two looks at what is due
constexpr std::int64_t kIdleFlow_ns = 30'000'000'000;
constexpr std::int64_t kSpin_ns = 80'000;  // a sleeping thread wakes up to this late: spin for the rest
constexpr std::int64_t kLongestWait_ns = 500'000'000;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

/// One master's socket: it gets its own socket towards the slave, as behind an address translator.
struct Flow {
  Address master;
  UdpSocket to_slave;
  std::int64_t used_ns;
  std::uint64_t id;
};

struct Pending {
  std::int64_t release_ns;
  std::uint64_t order;
  std::uint64_t flow;
  bool is_up;
  std::vector<std::byte> bytes;
};
// Turned round for std::priority_queue: the earliest, and of equals the first come, is on top.
struct IsLater {
  bool operator()(const Pending& a, const Pending& b) const {
    return a.release_ns != b.release_ns ? a.release_ns > b.release_ns : a.order > b.order;
  }
};

double quantile_us(const std::vector<std::int32_t>& sorted_ns, double q) {
  if (sorted_ns.empty()) return 0;
  const auto last = static_cast<double>(sorted_ns.size() - 1);
  return sorted_ns[static_cast<std::size_t>(std::llround(q * last))] * 1e-3;
}

}  // namespace

class Relay::State {
 public:
  State(const Options& options, UdpSocket front)
      : front_(std::move(front)),
        slave_(options.slave),
        impairments_{Impairment(options.spec, options.seed * 2), Impairment(options.spec, options.seed * 2 + 1)},
        began_ns_(monotonic_ns()) {}

  void run(const std::atomic<bool>& stop, std::int64_t until_ns) {
    while (!stop.load(std::memory_order_relaxed)) {
      const std::int64_t now = monotonic_ns();
      if (now >= until_ns) break;
      forget_idle(now);
      wait(now, until_ns);
      take_arrivals();
      release_due();
    }
  }

  Summary summary() const {
    Summary summary;
    summary.seconds = static_cast<double>(monotonic_ns() - began_ns_) * 1e-9;
    summary.up = directions_[0];
    summary.down = directions_[1];
    summary.up.impairment = impairments_[0].counters();
    summary.down.impairment = impairments_[1].counters();
    summary.refused_peers = refused_peers_;
    std::vector<std::int32_t> sorted = errors_ns_;
    std::sort(sorted.begin(), sorted.end());
    summary.release_error = {error_count_, quantile_us(sorted, 0.5), quantile_us(sorted, 0.99),
                             quantile_us(sorted, 0.999), static_cast<double>(max_error_ns_) * 1e-3};
    return summary;
  }

  const Address& local() const { return front_.local(); }

 private:
  // Sleeps until something arrives or the next release is kSpin_ns away; nearer than that it does not sleep at all.
  void wait(std::int64_t now, std::int64_t until_ns) {
    std::int64_t wake = std::min(until_ns, now + kLongestWait_ns);
    if (!pending_.empty()) wake = std::min(wake, pending_.top().release_ns - kSpin_ns);
    if (wake <= now) return;
    std::array<pollfd, 1 + kMaxFlows> polls{};
    std::size_t count = 0;
    polls[count++] = {front_.descriptor(), POLLIN, 0};
    for (const Flow& flow : flows_) polls[count++] = {flow.to_slave.descriptor(), POLLIN, 0};
    const timespec timeout{(wake - now) / kNsPerSecond, (wake - now) % kNsPerSecond};
    ppoll(polls.data(), count, &timeout, nullptr);
  }

  void take_arrivals() {
    std::array<std::byte, kBufferBytes> buffer;
    for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
      const auto received = front_.receive(buffer);
      if (!received) break;
      if (Flow* flow = flow_of(received->from)) take(*flow, true, *received);
    }
    for (Flow& flow : flows_) {
      for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
        const auto received = flow.to_slave.receive(buffer);
        if (!received) break;
        take(flow, false, *received);
      }
    }
  }

  void take(Flow& flow, bool is_up, const Received& received) {
    flow.used_ns = received.time_ns;
    const std::size_t direction = is_up ? 0 : 1;
    std::int64_t& newest = newest_arrival_ns_[direction];
    newest = std::max(newest, received.time_ns);  // two sockets are read one after the other
    for (const std::int64_t release_ns : impairments_[direction].releases(newest, received.bytes.size())) {
      if (pending_.size() >= kMaxPending) {
        ++directions_[direction].overflow;
        continue;
      }
      pending_.push({release_ns, order_++, flow.id, is_up, {received.bytes.begin(), received.bytes.end()}});
    }
  }

  void release_due() {
    while (!pending_.empty()) {
      const std::int64_t now = monotonic_ns();
      const Pending& next = pending_.top();
      if (next.release_ns > now) return;
      const auto flow = std::find_if(flows_.begin(), flows_.end(), [&](const Flow& f) { return f.id == next.flow; });
      if (flow != flows_.end()) {
        const bool is_sent = next.is_up ? flow->to_slave.send(next.bytes) : front_.send_to(flow->master, next.bytes);
        Direction& direction = directions_[next.is_up ? 0 : 1];
        ++(is_sent ? direction.sent : direction.unsent);
        remember_error(monotonic_ns() - next.release_ns);
      }
      pending_.pop();
    }
  }

  // All of them up to kMaxErrors, then each one in place of an older with the odds that keep the sample fair.
  void remember_error(std::int64_t error_ns) {
    max_error_ns_ = std::max(max_error_ns_, error_ns);
    ++error_count_;
    const auto kept =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(error_ns, 0, std::numeric_limits<std::int32_t>::max()));
    if (errors_ns_.size() < kMaxErrors) {
      errors_ns_.push_back(kept);
    } else if (const std::uint64_t place = random_() % error_count_; place < kMaxErrors) {
      errors_ns_[place] = kept;
    }
  }

  Flow* flow_of(const Address& master) {
    for (Flow& flow : flows_) {
      if (flow.master == master) return &flow;
    }
    if (flows_.size() < kMaxFlows) {
      auto socket = UdpSocket::open(loopback(slave_.is_ipv6));
      if (socket && socket->connect(slave_)) {
        flows_.push_back({master, std::move(*socket), monotonic_ns(), ++flow_ids_});
        return &flows_.back();
      }
    }
    ++refused_peers_;
    return nullptr;
  }

  void forget_idle(std::int64_t now) {
    std::erase_if(flows_, [&](const Flow& flow) { return now - flow.used_ns > kIdleFlow_ns; });
  }

  UdpSocket front_;
  Address slave_;
  std::array<Impairment, 2> impairments_;  // up, down
  std::array<Direction, 2> directions_;
  std::array<std::int64_t, 2> newest_arrival_ns_{};
  std::vector<Flow> flows_;
  std::priority_queue<Pending, std::vector<Pending>, IsLater> pending_;
  std::uint64_t order_ = 0, flow_ids_ = 0, refused_peers_ = 0, error_count_ = 0;
  std::int64_t max_error_ns_ = 0;
  std::vector<std::int32_t> errors_ns_;
  std::mt19937_64 random_;
  std::int64_t began_ns_;
};

tl::expected<std::unique_ptr<Relay>, Error> Relay::open(const Options& options) {
  for (const Address& address : {options.listen, options.slave}) {
    if (!address.is_loopback())
      return tl::unexpected(Error{ErrorKind::kRefused, "a played link stays on this machine: " + to_string(address) +
                                                           " is not 127.0.0.1 or [::1]"});
  }
  if (options.slave.port == 0) return tl::unexpected(Error{ErrorKind::kAddress, "the slave's address has no port"});
  auto front = UdpSocket::open(options.listen);
  if (!front) return tl::unexpected(front.error());
  return std::unique_ptr<Relay>(new Relay(std::make_unique<State>(options, std::move(*front))));
}

Relay::Relay(std::unique_ptr<State> state) : state_(std::move(state)) {}
Relay::~Relay() = default;
void Relay::run(const std::atomic<bool>& stop, std::int64_t until_ns) {
  state_->run(stop, until_ns);
}
const Address& Relay::local() const {
  return state_->local();
}
Relay::Summary Relay::summary() const {
  return state_->summary();
}

std::string to_json(const Relay::Options& options, const Relay::Summary& summary) {
  std::ostringstream out;
  const auto direction = [&](const Relay::Direction& d) {
    out << "{\"received\": " << d.impairment.received << ", \"lost\": " << d.impairment.lost
        << ", \"queue_dropped\": " << d.impairment.queue_dropped << ", \"too_long\": " << d.impairment.too_long
        << ", \"held_back\": " << d.impairment.held_back << ", \"duplicated\": " << d.impairment.duplicated
        << ", \"sent\": " << d.sent << ", \"unsent\": " << d.unsent << ", \"overflow\": " << d.overflow << "}";
  };
  const Relay::ReleaseError& e = summary.release_error;
  out << "{\"link\": \"" << to_string(options.spec) << "\", \"seed\": " << options.seed
      << ", \"seconds\": " << summary.seconds << ", \"up\": ";
  direction(summary.up);
  out << ", \"down\": ";
  direction(summary.down);
  out << ", \"release_error_us\": {\"samples\": " << e.samples << ", \"p50\": " << e.p50_us << ", \"p99\": " << e.p99_us
      << ", \"p99_9\": " << e.p99_9_us << ", \"max\": " << e.max_us << "}, \"refused_peers\": " << summary.refused_peers
      << ", \"valid\": " << (e.is_valid() ? "true" : "false") << "}";
  return out.str();
}

}  // namespace farfeel::transport
