#include "tests/support/simulated_internet.h"

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "transport/net/arrival_clock.h"

namespace farfeel {
namespace {

using transport::Address;

constexpr const char* kInterface = "net0";
constexpr std::size_t kIpBytes = 20, kUdpBytes = 8, kMostPacketBytes = 2048;
constexpr std::uint8_t kUdp = 17;
constexpr std::int64_t kStopAfter_ns = 20'000'000;  // longest before a stop is noticed

std::uint16_t u16_at(const std::uint8_t* p) {
  return static_cast<std::uint16_t>(p[0] << 8 | p[1]);
}
void put_u16(std::uint8_t* p, std::size_t value) {
  p[0] = static_cast<std::uint8_t>(value >> 8);
  p[1] = static_cast<std::uint8_t>(value);
}

Address ipv4_at(const std::uint8_t* ip, const std::uint8_t* port) {
  Address address;
  std::copy_n(ip, 4, address.ip.begin());
  address.port = u16_at(port);
  return address;
}

/// One IPv4 packet with a UDP datagram; without UDP's checksum, which IPv4 lets be 0.
std::vector<std::uint8_t> packet_of(const Address& from, const Address& to, std::span<const std::byte> bytes) {
  std::vector<std::uint8_t> packet(kIpBytes + kUdpBytes + bytes.size(), 0);
  std::uint8_t* const ip = packet.data();
  ip[0] = 0x45;
  put_u16(ip + 2, packet.size());
  ip[6] = 0x40;  // not to be fragmented
  ip[8] = 64;    // hops
  ip[9] = kUdp;
  std::copy_n(from.ip.begin(), 4, ip + 12);
  std::copy_n(to.ip.begin(), 4, ip + 16);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < kIpBytes; i += 2) sum += u16_at(ip + i);
  while (sum > 0xFFFF) sum = (sum & 0xFFFF) + (sum >> 16);
  put_u16(ip + 10, ~sum & 0xFFFF);
  std::uint8_t* const udp = ip + kIpBytes;
  put_u16(udp, from.port);
  put_u16(udp + 2, to.port);
  put_u16(udp + 4, kUdpBytes + bytes.size());
  std::memcpy(udp + kUdpBytes, bytes.data(), bytes.size());
  return packet;
}

tl::expected<int, std::string> make_interface(const NetworkNamespace& space) {
  int tun = -1;
  std::string trouble;
  space.in([&] {
    tun = open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    ifreq request{};
    request.ifr_flags = IFF_TUN | IFF_NO_PI;
    std::strncpy(request.ifr_name, kInterface, IFNAMSIZ - 1);
    if (tun < 0 || ioctl(tun, TUNSETIFF, &request) != 0)
      trouble = std::string("may not make an interface at /dev/net/tun: ") + std::strerror(errno);
    else if (!run_quietly("ip link set lo up && ip link set " + std::string(kInterface) + " up"))
      trouble = "the program ip (package iproute2) cannot bring interfaces up";
  });
  if (trouble.empty()) return tun;
  if (tun >= 0) close(tun);
  return tl::unexpected(trouble);
}

}  // namespace

tl::expected<std::unique_ptr<SimulatedInternet>, std::string> SimulatedInternet::make(std::size_t machines,
                                                                                      std::int64_t one_way_ns) {
  std::vector<Machine> made;
  for (std::size_t i = 0; i < machines; ++i) {
    auto space = NetworkNamespace::make();
    if (!space) return tl::unexpected(space.error());
    const auto tun = make_interface(*space);
    if (!tun) return tl::unexpected(tun.error());
    made.push_back({std::move(*space), *tun});
  }
  return std::unique_ptr<SimulatedInternet>(new SimulatedInternet(std::move(made), one_way_ns));
}

SimulatedInternet::SimulatedInternet(std::vector<Machine> machines, std::int64_t one_way_ns)
    : machines_(std::move(machines)) {
  nats_.delay_ns = one_way_ns;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

SimulatedInternet::~SimulatedInternet() {
  thread_ = {};
  for (const Machine& machine : machines_) close(machine.tun);
}

bool SimulatedInternet::place(std::size_t machine, const std::string& text, const std::optional<BehindNat>& nat) {
  const auto address = transport::parse_address(text, 0);
  if (!address) return false;
  const int tun = machines_[machine].tun;
  {
    const std::lock_guard lock(mutex_);
    nats_.add_host(*address, [tun](const Address& from, const Address& to, std::span<const std::byte> bytes) {
      const auto packet = packet_of(from, to, bytes);
      (void)!write(tun, packet.data(), packet.size());  // what the kernel does not take is lost, as on any way
    });
    if (nat) {
      const auto outer = transport::parse_address(nat->outer, 0);
      if (!outer) return false;
      nats_.add_nat(*address, *outer, nat->kind);
    }
  }
  bool is_placed = false;
  const std::string name = kInterface;
  in(machine, [&] {
    is_placed = run_quietly("ip address flush dev " + name + "; ip address add " + text + "/32 dev " + name +
                            " && ip route replace default dev " + name);
  });
  return is_placed;
}

void SimulatedInternet::block_direct_ways(bool is_blocked) {
  const std::lock_guard lock(mutex_);
  nats_.direct_is_blocked = is_blocked;
}

std::size_t SimulatedInternet::passed_two_nats() {
  const std::lock_guard lock(mutex_);
  return nats_.passed_two_nats;
}

void SimulatedInternet::take_packets(int tun) {
  std::array<std::uint8_t, kMostPacketBytes> packet;
  for (ssize_t got = 0; (got = read(tun, packet.data(), packet.size())) > 0;) {
    const auto size = static_cast<std::size_t>(got);
    const std::size_t ip_bytes = (packet[0] & 15u) * 4u;
    const bool is_fragment = (u16_at(&packet[6]) & 0x3FFF) != 0;
    if (size < kIpBytes + kUdpBytes || packet[0] >> 4 != 4 || packet[9] != kUdp || is_fragment) continue;
    const std::uint8_t* const udp = &packet[ip_bytes];
    const std::size_t udp_bytes = u16_at(udp + 4);
    if (udp_bytes < kUdpBytes || ip_bytes + udp_bytes > size) continue;
    nats_.send(ipv4_at(&packet[12], udp), ipv4_at(&packet[16], udp + 2),
               std::as_bytes(std::span(udp + kUdpBytes, udp_bytes - kUdpBytes)));
  }
}

void SimulatedInternet::run(const std::stop_token& stop) {
  std::vector<pollfd> polled;
  for (const Machine& machine : machines_) polled.push_back({machine.tun, POLLIN, 0});
  std::int64_t until_ns = 0;
  while (!stop.stop_requested()) {
    const std::int64_t wait_ns = std::clamp<std::int64_t>(until_ns - transport::monotonic_ns(), 0, kStopAfter_ns);
    const timespec wait{0, wait_ns};
    (void)ppoll(polled.data(), polled.size(), &wait, nullptr);
    const std::lock_guard lock(mutex_);
    nats_.run_until(transport::monotonic_ns());
    for (const Machine& machine : machines_) take_packets(machine.tun);
    until_ns = nats_.next_ns();
  }
}

}  // namespace farfeel
