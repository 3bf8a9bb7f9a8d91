#include "tests/bench/bottleneck.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "haptic_core/realtime/histogram.h"
#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::bench {
namespace {

using realtime::monotonic_now_ns;

constexpr std::int64_t kSpin_ns = 40'000;   // before a packet is due: a wake-up's usual lateness
constexpr std::int64_t kNap_ns = 500'000;   // the longest sleep, so that it is known how late wake-ups are
constexpr int kAtOnce = 32;                 // packets read before those that are due are looked at
constexpr std::size_t kMostPackets = 4096;  // 400 ms of 100 Mbit/s
constexpr const char* kInterface = "narrow";

/// A TUN device of this thread's namespace, up, with that address; -1 and errno if there cannot be one.
int open_device(const char* address) {
  const int device = ::open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (device < 0) return -1;
  ifreq request{};
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  std::strncpy(request.ifr_name, kInterface, IFNAMSIZ - 1);
  const std::string name = kInterface;
  // A connection is to begin as the first one did: nothing is remembered of those before.
  const std::string set_up = "ip address add " + std::string(address) + "/24 dev " + name + " && ip link set " + name +
                             " mtu 1500 txqueuelen 2000 up && echo 1 > /proc/sys/net/ipv4/tcp_no_metrics_save";
  if (ioctl(device, TUNSETIFF, &request) == 0 && run_quietly(set_up)) return device;
  const int reason = errno;
  close(device);
  errno = reason;
  return -1;
}

}  // namespace

tl::expected<std::unique_ptr<Bottleneck>, std::string> Bottleneck::open(TwoEnds& ends) {
  if (!ends.has_cable()) return tl::unexpected(ends.reason());
  std::unique_ptr<Bottleneck> made(new Bottleneck);
  int reason = 0;
  ends.in(TwoEnds::End::kMaster, [&] {
    made->master_ = open_device("10.8.0.1");
    if (made->master_ < 0) reason = errno;
  });
  ends.in(TwoEnds::End::kSlave, [&] {
    made->slave_ = open_device("10.8.0.2");
    if (made->slave_ < 0) reason = errno;
  });
  if (made->master_ < 0 || made->slave_ < 0)
    return tl::unexpected(fmt::format("cannot make a TUN device: {}", std::strerror(reason)));
  ends.go_by(*transport::parse_address("10.8.0.1", 0), *transport::parse_address("10.8.0.2", 0));
  return made;
}

Bottleneck::~Bottleneck() {
  if (thread_.joinable()) (void)end();
  for (const int device : {master_, slave_})
    if (device >= 0) close(device);
}

void Bottleneck::begin(const transport::LinkSpec& spec, std::uint64_t seed) {
  is_over_ = false;
  summary_ = {};
  thread_ = std::thread([this, spec, seed] { run(spec, seed); });
}

Bottleneck::Summary Bottleneck::end() {
  is_over_ = true;
  thread_.join();
  return summary_;
}

void Bottleneck::run(const transport::LinkSpec& spec, std::uint64_t seed) {
  struct Way {
    int from, to;
    PacketFifo fifo;
  };
  std::array<Way, 2> ways{Way{master_, slave_, PacketFifo(spec, 2 * seed, kMostPackets)},
                          Way{slave_, master_, PacketFifo(spec, 2 * seed + 1, kMostPackets)}};
  for (Way& way : ways)  // what was sent before the link was there
    while (read(way.from, way.fifo.room().data(), PacketFifo::kMostBytes) > 0) {
    }
  realtime::Histogram lateness;
  (void)realtime::use_fifo(kFifoPriority);
  while (!is_over_.load(std::memory_order_relaxed)) {
    for (Way& way : ways) {
      for (int i = 0; i < kAtOnce; ++i) {
        const ssize_t size = read(way.from, way.fifo.room().data(), PacketFifo::kMostBytes);
        if (size <= 0) break;
        way.fifo.push(static_cast<std::size_t>(size), monotonic_now_ns());
      }
      for (std::int64_t now_ns = monotonic_now_ns(); way.fifo.next_ns() <= now_ns; now_ns = monotonic_now_ns()) {
        lateness.add(now_ns - way.fifo.next_ns());
        const auto packet = way.fifo.pop();
        if (write(way.to, packet.data(), packet.size()) < 0) continue;  // the device is going down
      }
    }
    const std::int64_t now_ns = monotonic_now_ns();
    const std::int64_t wake_ns =
        std::min(std::min(ways[0].fifo.next_ns(), ways[1].fifo.next_ns()) - kSpin_ns, now_ns + kNap_ns);
    if (wake_ns <= now_ns) continue;  // spins
    std::array<pollfd, 2> polled{pollfd{master_, POLLIN, 0}, pollfd{slave_, POLLIN, 0}};
    const timespec left{0, static_cast<long>(wake_ns - now_ns)};
    if (ppoll(polled.data(), polled.size(), &left, nullptr) == 0) lateness.add(monotonic_now_ns() - wake_ns);
  }
  summary_.up = {ways[0].fifo.counters(), ways[0].fifo.overflow()};
  summary_.down = {ways[1].fifo.counters(), ways[1].fifo.overflow()};
  const auto us = [&](double q) { return 1e-3 * static_cast<double>(lateness.quantile_ns(q)); };
  summary_.lateness = {lateness.count(), us(0.5), us(0.99), us(0.999), 1e-3 * static_cast<double>(lateness.max_ns())};
}

}  // namespace farfeel::bench
