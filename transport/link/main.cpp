// farfeel-link: stand a worse network between a master and a slave on this machine.

#include <fmt/core.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <limits>

#include "codecs/settings/command_line.h"
#include "transport/link/relay.h"

namespace {

using namespace farfeel::transport;

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void stop_on(int signal_number) {
  struct sigaction action {};
  action.sa_handler = [](int) { stop.store(true, std::memory_order_relaxed); };
  sigaction(signal_number, &action, nullptr);  // without SA_RESTART: the wait ends
}

/// Ahead of ordinary work, so that a busy machine does not look like a bad link; behind a haptic loop. The relay sleeps
/// between datagrams, as a real-time thread must. False where it is not allowed.
bool go_ahead_of_ordinary_work() {
  constexpr sched_param kPriority{10};
  return sched_setscheduler(0, SCHED_FIFO, &kPriority) == 0;
}

constexpr const char* kAbout =
    R"(A link that delays, jitters, loses, reorders, duplicates and limits the rate of UDP datagrams.

The master talks to the link as if it were the slave; the link forwards to the slave and back, what it cannot
read. Only addresses of this machine are accepted.

  farfeel-slave  --listen 127.0.0.1:47000 --scene file-cad
  farfeel-link   --listen 127.0.0.1:47100 --slave 127.0.0.1:47000 --link "rtt=50ms jitter=5ms loss=1%"
  farfeel-master --connect 127.0.0.1:47100

The link is a line of KEY=VALUE:
  rtt=100ms        round trip, half of it each way             (us, ms, s)
  jitter=5ms       each datagram's delay is spread over this much; order is kept
  loss=1%          mean loss,  loss=1%,burst=4  in bursts of 4 on average (Gilbert-Elliott)
  reorder=0.5%     share held back by 2 to 6 ms, so that later ones overtake it
  duplicate=0.1%   share that arrives twice, the copy 2 to 6 ms later
  rate=20Mbit      bottleneck of each direction, shared by all; (kbit, Mbit, Gbit)
  queue=50ms       longest wait before the bottleneck; what would wait longer is dropped
  mtu=1400         longest packet that passes [bytes], headers included; longer ones vanish

It ends on Ctrl-C or SIGTERM and prints one line of JSON: what became of the datagrams, and how late it
released them against its own plan. With a p99.9 over 1 ms the run is called invalid ("valid": false):
the machine was too busy to play this link.)";

}  // namespace

int main(int argc, char** argv) {
  std::string listen = "127.0.0.1:47100", slave = "127.0.0.1:47000", link;
  Relay::Options options;
  double seconds = 0;
  CLI::App app(kAbout, "farfeel-link");
  app.add_option("--listen", listen, "where the master connects: an address of this machine, port 0 for any free one")
      ->capture_default_str();
  app.add_option("--slave", slave, "where the slave listens")->capture_default_str();
  app.add_option("--link", link, "what the link does; nothing if empty");
  app.add_option("--seed", options.seed, "equal seeds give equal luck")->capture_default_str();
  app.add_option("--seconds", seconds, "end after this long [s]; 0: on Ctrl-C")->check(CLI::NonNegativeNumber);
  int ready_fd = -1;
  app.add_option("--ready-fd", ready_fd, "write 'ready PORT' to this file descriptor once forwarding")
      ->configurable(false);
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;

  const auto fail = [](const Error& error) {
    fmt::print(stderr, "farfeel-link: {}\n", error.message);
    return 2;
  };
  const auto listen_address = parse_address(listen);
  if (!listen_address) return fail(listen_address.error());
  const auto slave_address = parse_address(slave);
  if (!slave_address) return fail(slave_address.error());
  const auto spec = parse_link_spec(link);
  if (!spec) return fail(spec.error());
  options.listen = *listen_address;
  options.slave = *slave_address;
  options.spec = *spec;
  stop_on(SIGINT);
  stop_on(SIGTERM);
  auto relay = Relay::open(options);
  if (!relay) return fail(relay.error());

  const std::string shown = to_string(options.spec);
  const bool is_ahead = go_ahead_of_ordinary_work();
  fmt::print(stderr, "farfeel-link: {} -> {}, {}{}\n", to_string((*relay)->local()), to_string(options.slave),
             shown.empty() ? "doing nothing" : shown,
             is_ahead ? "" : " (without SCHED_FIFO, which this user may not ask for: less exact on a busy machine)");
  if (ready_fd >= 0) {
    const std::string ready = fmt::format("ready {}\n", (*relay)->local().port);
    if (::write(ready_fd, ready.data(), ready.size()) < 0)
      fmt::print(stderr, "farfeel-link: nobody reads --ready-fd\n");
    ::close(ready_fd);
  }
  const std::int64_t until_ns = seconds > 0 ? monotonic_ns() + static_cast<std::int64_t>(std::min(seconds, 1e8) * 1e9)
                                            : std::numeric_limits<std::int64_t>::max();
  (*relay)->run(stop, until_ns);
  const Relay::Summary summary = (*relay)->summary();
  if (!summary.release_error.is_valid())
    fmt::print(stderr, "farfeel-link: this run is invalid: 1 in 1000 datagrams left more than {:.1f} ms late\n",
               summary.release_error.p99_9_us * 1e-3);
  fmt::print("{}\n", to_json(options, summary));
  return std::fflush(stdout) == 0 ? 0 : 1;
}
