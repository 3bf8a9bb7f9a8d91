#include "transport/status/link_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "transport/bulk/bulk_messages.h"

namespace farfeel::transport {
namespace {

constexpr double kWindow_s = 3;         // between the two looks that are compared: a burst is no link
constexpr std::uint64_t kEnough = 100;  // datagrams with a known end in it
// Of the median round trip above the least: by itself more than jitter, and with loss what a full queue makes.
constexpr double kGrown_ms = 100, kGrownWithLoss_ms = 25, kGrownTimes = 1.5;
constexpr double kLossy = 0.05;           // the loop then lives on what is older than it need be
constexpr std::size_t kHeaderBytes = 28;  // of IPv4 and UDP
constexpr int kMtuOfAll = 1280;           // every path of IPv6 has it

/// What became of a direction's datagrams since.
struct Since {
  double lost = 0;  // share of those whose end is known
  bool is_known = false;
};
Since since(const DirectionStatus& then, const DirectionStatus& now) {
  const std::uint64_t lost = now.lost - std::min(now.lost, then.lost);
  const std::uint64_t told = lost + now.arrived - std::min(now.arrived, then.arrived);
  return {told == 0 ? 0 : static_cast<double>(lost) / static_cast<double>(told), told >= kEnough};
}

double mbit_per_s(std::uint64_t then_bytes, std::uint64_t now_bytes, double seconds) {
  return 8e-6 * static_cast<double>(now_bytes - std::min(then_bytes, now_bytes)) / seconds;
}

std::string loss_words(const Since& up, const Since& down) {
  return fmt::format("{:.0f} % of the poses and {:.0f} % of the contacts are lost", 100 * up.lost, 100 * down.lost);
}

}  // namespace

std::optional<std::string> LinkWords::look(const LinkStatus& now, double now_s) {
  if (!now.haptic.is_used || now.haptic.round_trip.samples == 0) return std::nullopt;
  if (!before_) before_ = Look{now_s, now};
  const DelayStatus& trip = now.haptic.round_trip;
  if (trip.samples >= kEnough && trip.least_ms > felt_round_trip_ms_ && !std::exchange(is_far_said_, true))
    return fmt::format(
        "the round trip to the slave takes {:.2f} s, and what is older than {:.2f} s is not felt: the force stays off. "
        "No setting mends that: take a slave that is nearer, or a way that is shorter (a satellite, or a relay "
        "far off, may lie between)",
        1e-3 * trip.least_ms, 1e-3 * felt_round_trip_ms_);

  const double seconds = now_s - before_->at_s;
  if (seconds < kWindow_s) return std::nullopt;
  const Look then = *std::exchange(before_, Look{now_s, now});
  const Since up = since(then.status.haptic.up, now.haptic.up), down = since(then.status.haptic.down, now.haptic.down);
  if (!up.is_known && !down.is_known) return std::nullopt;
  const bool is_lossy = std::max(up.lost, down.lost) > kLossy;
  const bool has_grown = trip.samples >= kEnough && trip.p50_ms > kGrownTimes * trip.least_ms &&
                         trip.p50_ms > trip.least_ms + (is_lossy ? kGrownWithLoss_ms : kGrown_ms);
  if (has_grown && !std::exchange(is_narrow_said_, true)) {
    const double sent =
        mbit_per_s(then.status.haptic.up.sent_bytes, now.haptic.up.sent_bytes, seconds) +
        8e-6 * kHeaderBytes * static_cast<double>(now.haptic.up.sent - then.status.haptic.up.sent) / seconds;
    const double came = mbit_per_s(then.status.haptic.down.arrived_bytes + then.status.bulk.down.arrived_bytes,
                                   now.haptic.down.arrived_bytes + now.bulk.down.arrived_bytes, seconds);
    return fmt::format(
        "the link is too narrow, or others fill it: datagrams wait in a queue, so the round trip has grown from {:.0f} "
        "to {:.0f} ms (median; p99 {:.0f} ms), and {}. This session sends {:.2f} Mbit/s and gets {:.2f}; it wants some "
        "2 "
        "each way, and 3 where surfaces have texture. Take a faster link, close what else uses it, or ask for less: "
        "farfeel-master --rate 250 --rung linear",
        trip.least_ms, trip.p50_ms, trip.p99_ms, loss_words(up, down), sent, came);
  }
  if (is_lossy && !is_narrow_said_ && !std::exchange(is_lossy_said_, true))
    return fmt::format(
        "the link loses datagrams: {}, and the round trip stays at {:.1f} ms, so it is not full. Take a cable in place "
        "of "
        "radio, or another way; 'farfeel link-status --watch' shows when it is better",
        loss_words(up, down), trip.p50_ms);
  return std::nullopt;
}

std::string why_no_scene(const SceneWait& wait) {
  if (wait.datagrams > 0 && wait.longest_bytes < kSmallDatagram && wait.trouble.empty())
    return fmt::format(
        "{} datagrams came, none longer than {} bytes, and the scene comes in datagrams of {}: something on the way "
        "carries only short packets (MTU), a tunnel or a VPN perhaps. Give it an MTU of {} or more at both ends, for "
        "example  ip link set dev wg0 mtu {}",
        wait.datagrams, wait.longest_bytes, kSmallDatagram, kMtuOfAll, kMtuOfAll);
  if (!wait.trouble.empty())
    return fmt::format(
        "{}; the greeting's round trip took {:.2f} s, and a link that takes longer than 2 s, or is silent "
        "so long, carries no session",
        wait.trouble, 1e-3 * wait.greeting_ms);
  return fmt::format("{:.0f} % of it came, and nothing more for {:.0f} s: the link is too slow, or broke",
                     100 * wait.share, wait.seconds);
}

}  // namespace farfeel::transport
