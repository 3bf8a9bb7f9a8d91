// farfeel-relay: forward sealed datagrams between two ends that cannot reach each other.

#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>

#include "codecs/settings/command_line.h"
#include "transport/net/udp_socket.h"
#include "transport/relay/key_file.h"
#include "transport/relay/relay_server.h"

namespace {

using namespace farfeel::transport;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::uint64_t kDay_s = 86'400;

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void stop_on(int signal_number) {
  struct sigaction action {};
  action.sa_handler = [](int) { stop.store(true, std::memory_order_relaxed); };
  sigaction(signal_number, &action, nullptr);  // without SA_RESTART: the wait ends
}

constexpr const char* kAbout = R"(A blind forwarder for a master and a slave that are both behind NATs or firewalls.

It runs on any host that both can reach: one UDP port, no privileges, no state on disk but its own key. It sees
datagrams that are sealed between the two ends, and cannot read, change or forge them. Only holders of a token
may use it, each within the token's rate.

On the relay's host:
  farfeel-relay serve --listen '[::]:47200'
  farfeel-relay token --days 30 > token         one line, to give to the people at both ends, over a safe way

At both ends, beside what else they are told:
  farfeel-slave --relay relay.example.org:47200 --relay-token token
  farfeel-master --relay relay.example.org:47200 --relay-token token

The ends try to reach each other directly while the relay forwards; where their NATs let that happen, the relay
carries nothing more. To withdraw all tokens, delete the key's file and start the relay anew; one token cannot be
withdrawn, so give short ones.)";

std::uint64_t wall_s() {
  return static_cast<std::uint64_t>(std::time(nullptr));
}

int fail(const Error& error) {
  fmt::print(stderr, "farfeel-relay: {}\n", error.message);
  return 2;
}

int serve(const Key32& key, const std::string& listen, int ready_fd, double seconds) {
  const auto address = parse_address(listen);
  if (!address) return fail(address.error());
  auto socket = UdpSocket::open(*address, {.also_ipv4 = address->is_ipv6 && address->is_any()});
  if (!socket) return fail(socket.error());
  RelayServer server(key, random_key());
  stop_on(SIGINT);
  stop_on(SIGTERM);
  fmt::print(stderr, "farfeel-relay: forwarding on {}\n", to_string(socket->local()));
  if (ready_fd >= 0) {
    const std::string ready = fmt::format("ready {}\n", socket->local().port);
    if (::write(ready_fd, ready.data(), ready.size()) < 0)
      return fail({ErrorKind::kSocket, "cannot write to --ready-fd: give a descriptor that is open for writing."});
    ::close(ready_fd);
  }

  const std::int64_t start = monotonic_ns();
  const std::int64_t end =
      seconds > 0 ? start + static_cast<std::int64_t>(seconds * 1e9) : std::numeric_limits<std::int64_t>::max();
  std::int64_t forget_at = start + kSecond_ns;
  std::array<std::byte, 2048> buffer;  // longer than any datagram of the link, so that such ones are seen and dropped
  while (!stop.load(std::memory_order_relaxed)) {
    const std::int64_t now = monotonic_ns();
    if (now >= end) break;
    if (now >= forget_at) {
      server.forget(now, wall_s());
      forget_at = now + kSecond_ns;
    }
    const auto received = socket->receive(buffer);
    if (!received) {
      socket->wait_until(std::min(end, forget_at));
    } else if (received->bytes.size() <= kMostDatagramBytes) {
      for (const auto& out : server.receive(*received, now, wall_s()))
        (void)socket->send_from(out.local, out.to, out.bytes,
                                out.marking);  // what the kernel refuses is lost, as on any way
    }
  }
  const auto& c = server.counters();
  fmt::print(R"({{"seconds":{:.1f},"forwarded":{},"forwarded_bytes":{},"over_rate":{},"unpaired":{},"strangers":{},)"
             R"("challenged":{},"refused":{},"registered":{},"ends":{},"unsent":{}}})"
             "\n",
             static_cast<double>(monotonic_ns() - start) * 1e-9, c.forwarded, c.forwarded_bytes, c.over_rate,
             c.unpaired, c.strangers, c.challenged, c.refused, c.registered, server.ends(),
             socket->counters().unsent_full + socket->counters().unsent_refused + socket->counters().unsent_too_long);
  return 0;
}

int print_token(const Key32& key, double days, double mbit, unsigned sessions) {
  RelayGrant grant;
  const Key32 random = random_key();
  std::memcpy(&grant.id, random.data(), sizeof grant.id);
  grant.expiry_s = wall_s() + static_cast<std::uint64_t>(days * static_cast<double>(kDay_s));
  grant.rate_kbit = static_cast<std::uint32_t>(mbit * 1000);
  grant.most_ends = static_cast<std::uint16_t>(sessions * 4);  // two lanes of two ends
  fmt::print("{}\n", to_string(make_token(key, grant)));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string listen = "[::]:47200", key_path = default_relay_key_path();
  double seconds = 0, days = 30, mbit = 20;
  unsigned sessions = 1;
  int ready_fd = -1;
  CLI::App app(kAbout, "farfeel-relay");
  app.require_subcommand(1);
  app.add_option("--key", key_path, "the relay's own key; made where there is none. Tokens end when it changes")
      ->default_str("~/.config/farfeel/relay.key");
  app.fallthrough();
  auto* const serving =
      app.add_subcommand("serve", "forward, until Ctrl-C or SIGTERM; then print counts as one line of JSON");
  serving->add_option("--listen", listen, "address and port; [::] is all addresses of both families")
      ->capture_default_str();
  serving->add_option("--seconds", seconds, "end after this long [s]; 0: never")->check(CLI::NonNegativeNumber);
  serving->add_option("--ready-fd", ready_fd, "write 'ready PORT' to this file descriptor once forwarding")
      ->configurable(false);
  auto* const token = app.add_subcommand("token", "print a new token, for both ends of a session");
  token->add_option("--days", days, "how long it is good for [days]")
      ->check(CLI::Range(0.0, 36500.0))
      ->capture_default_str();
  token->add_option("--mbit", mbit, "most that all its sessions together may send [Mbit/s]")
      ->check(CLI::Range(0.1, 4e6))
      ->capture_default_str();
  token->add_option("--sessions", sessions, "how many at once")->check(CLI::Range(1u, 1000u))->capture_default_str();
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;

  const auto key = read_or_make_relay_key(key_path);
  if (!key) return fail(key.error());
  return *serving ? serve(*key, listen, ready_fd, seconds) : print_token(*key, days, mbit, sessions);
}
