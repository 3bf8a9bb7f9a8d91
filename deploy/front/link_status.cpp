#include "deploy/front/link_status.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <thread>

#include "codecs/settings/command_line.h"
#include "transport/status/status_file.h"

namespace farfeel::front {
namespace {

using transport::DelayStatus;
using transport::DirectionStatus;
using transport::LaneStatus;
using transport::LinkStatus;

constexpr double kOld_s = 2;  // a station writes four times a second

std::string ms(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("-");
}

std::string delay(const DelayStatus& d) {
  return fmt::format("{} / {} / {} ms", ms(d.p50_ms), ms(d.p99_ms), ms(d.most_ms));
}

std::string direction(const char* name, const DirectionStatus& d) {
  const std::uint64_t told = d.arrived + d.lost;
  std::string out = fmt::format(
      "    {:4} {} sent, {} arrived ({:.1f} MB); lost {} ({:.2f} %) in {} bursts, the longest {}; {} late, {} twice\n",
      name, d.sent, d.arrived, 1e-6 * static_cast<double>(std::max(d.sent_bytes, d.arrived_bytes)), d.lost,
      told > 0 ? 100 * static_cast<double>(d.lost) / static_cast<double>(told) : 0.0, d.bursts, d.longest_burst, d.late,
      d.duplicate);
  if (d.one_way_excess.samples > 0)
    out +=
        fmt::format("         one way, above its least: {}; jitter {} ms\n", delay(d.one_way_excess), ms(d.jitter_ms));
  if (d.malformed + d.unknown_keys + d.forged + d.unusable > 0)
    out += fmt::format("         rejected: {} malformed, {} with keys not in use, {} forged, {} unusable\n",
                       d.malformed, d.unknown_keys, d.forged, d.unusable);
  if (d.dscp >= 0 || d.congestion_marks > 0)
    out += fmt::format("         arrives with DSCP {}; {} marked for congestion\n", d.dscp, d.congestion_marks);
  return out;
}

std::string lane(const char* name, const LaneStatus& s) {
  if (!s.is_used) return fmt::format("  {}: not in use\n", name);
  std::string out = fmt::format("  {}: heard {} ms ago; {} handshakes, {} changes of address\n", name, ms(s.silent_ms),
                                s.rekeys, s.migrations);
  if (s.round_trip.samples > 0) out += fmt::format("    round trip p50 / p99 / max: {}\n", delay(s.round_trip));
  if (s.peer_waiting.samples > 0)
    out += fmt::format("    of it waiting in the slave's socket and for its thread: {}\n", delay(s.peer_waiting));
  return out + direction("up", s.up) + direction("down", s.down);
}

int show(const std::string& folder, bool as_json) {
  const auto all = transport::read_link_statuses(folder);
  if (all.empty()) {
    fmt::print(stderr, "farfeel: no station runs on this machine, or not as this user\n");
    return 1;
  }
  for (const LinkStatus& status : all) fmt::print("{}", as_json ? transport::to_json(status) : told(status));
  return 0;
}

}  // namespace

std::string told(const LinkStatus& s) {
  std::string out = fmt::format("{} {}{}{}", s.role, s.pid, s.local.empty() ? "" : " at ", s.local);
  out +=
      s.peer.empty() ? std::string(", nobody at the other end") : fmt::format(", with {} at {}", s.peer_name, s.peer);
  if (!s.cipher.empty()) out += fmt::format(", {}", s.cipher);
  out += fmt::format("; running for {:.0f} s, {} sessions\n", s.uptime_s, s.sessions);
  if (s.age_s > kOld_s) out += fmt::format("  these figures are {:.1f} s old: it hangs, or is stopped\n", s.age_s);
  if (!s.trouble.empty()) out += fmt::format("  {}\n", s.trouble);
  out += lane("haptic lane", s.haptic) + lane("bulk lane", s.bulk);
  if (s.bulk.is_used)
    out +=
        fmt::format("    least round trip {} ms, its own queue {} ms, delivered {} Mbit/s, messages up to {} bytes\n",
                    ms(s.bulk_pace.least_round_trip_ms), ms(s.bulk_pace.queue_ms), ms(s.bulk_pace.delivered_mbit),
                    s.bulk_pace.message_bytes);
  if (s.handshakes.initiations > 0)
    out += fmt::format("  handshakes asked for: {}; {} answered, {} refused, {} sent a cookie, {} dropped\n",
                       s.handshakes.initiations, s.handshakes.answered, s.handshakes.refused, s.handshakes.cookies,
                       s.handshakes.dropped);
  return out;
}

int link_status_command(int argc, char** argv) {
  CLI::App app(
      "What is known of the links of the stations that run on this machine: round trips, loss, jitter, rejected "
      "datagrams, handshakes, changes of address.",
      "farfeel link-status");
  bool is_live = false, as_json = false;
  app.add_flag("--watch", is_live, "show it again every half second, until Ctrl-C");
  app.add_flag("--json", as_json, "one JSON object a station");
  app.footer(
      "Up is from the master to the slave. Times are quantiles 50 % / 99 % / the greatest.\n"
      "Exit status: 0 told, 1 no station runs here.");
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  const auto folder = transport::link_status_folder();
  if (!folder) {
    fmt::print(stderr, "farfeel: {}\n", folder.error().message);
    return 1;
  }
  if (!is_live) return show(*folder, as_json);
  for (;;) {
    if (isatty(STDOUT_FILENO) != 0) fmt::print("\033[H\033[2J");
    (void)show(*folder, as_json);
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
}

}  // namespace farfeel::front
