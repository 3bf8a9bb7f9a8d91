// What a sealed lane's round trip takes, beside the system calls alone and beside other libraries.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "tests/bench/bench.h"
#include "tests/bench/link_method.h"
#include "tests/bench/link_statistics.h"
#include "tests/bench/link_turn.h"
#include "transport/lane/sealed_lane.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;
using transport::Suite;

constexpr double kMostP50 = 1.35, kMostP50Chacha = 1.8, kMostP99 = 1.6;  // of raw UDP's
constexpr int kTurnRoundTrips = 250;                                     // a quarter of a second, then the next method
constexpr std::uint32_t kContacts = 7;

struct Sizes {
  std::size_t up, down;
};
/// What poses and answers once took, and what they take now, with seven contacts.
constexpr std::array kSizes{
    Sizes{116, 791}, Sizes{codecs::kPoseMessageBytes, codecs::kAnswerBlockBytes + kContacts* codecs::kContactBytes}};

struct Options {
  int rounds = 5, round_trips = 5000;
  bool is_quick = false, as_json = false;
};

struct Method {
  std::string name, cipher;
  std::optional<Suite> suite;
  std::string reason;  // why it is not here
  std::unique_ptr<LinkMethod> made;
};

struct Row {
  const Method* method;
  Sizes sizes;
  std::vector<Quantiles> rounds;
  std::vector<double> samples_us;  // of the round that runs
  int lost = 0;
  bool is_fifo = true;
  [[nodiscard]] Quantiles rtt_us() const { return medians(rounds); }
};

const char* name(Suite suite) {
  return suite == Suite::kAesGcm ? "AES-256-GCM" : "ChaCha20-Poly1305";
}

Method method(std::string name, std::string cipher, std::optional<Suite> suite, MadeMethod made) {
  Method m{std::move(name), std::move(cipher), suite, {}, {}};
  if (made)
    m.made = std::move(*made);
  else
    m.reason = made.error();
  return m;
}

std::vector<Method> methods(const TwoEnds& ends) {
  std::vector<Method> all;
  for (const Suite suite : {Suite::kAesGcm, Suite::kChaChaPoly})
    all.push_back(method("ours", name(suite), suite, make_ours(ends, suite)));
  all.push_back(method("raw_udp", "none", {}, make_raw_udp(ends)));
  all.push_back(method("enet", "none", {}, make_enet(ends)));
  for (const Suite suite : {Suite::kAesGcm, Suite::kChaChaPoly})
    all.push_back(method("ngtcp2", name(suite), suite, make_ngtcp2(ends, suite)));
  return all;
}

struct Cost {
  double seal_ns, open_ns;
};

/// Of SealedLane, head and window included: the median of many short blocks, most of which nothing interrupts.
Cost cost(Suite suite, std::size_t bytes) {
  constexpr std::size_t kDatagrams = 64;
  constexpr int kBlocks = 501;
  transport::LaneKeys keys;
  keys.generation = 1;
  keys.suite = suite;
  keys.local_index = keys.remote_index = 2;
  transport::fill_randomly(keys.send);
  keys.receive = keys.send;
  keys.made_ns = realtime::monotonic_now_ns();
  transport::SealedLane from(transport::SealedLane::Role::kInitiator), to(transport::SealedLane::Role::kInitiator);
  from.adopt(keys);
  to.adopt(keys);
  std::vector<double> seal_ns, open_ns;
  std::vector<std::array<std::byte, transport::kMaxDatagramBytes>> datagrams(kDatagrams);
  const std::vector<std::byte> message(bytes, std::byte{42});
  for (int block = 0; block < kBlocks; ++block) {
    const std::int64_t begin_ns = realtime::monotonic_now_ns();
    for (auto& datagram : datagrams) (void)from.seal(1, message, datagram, begin_ns);
    const std::int64_t sealed_ns = realtime::monotonic_now_ns();
    for (auto& datagram : datagrams) (void)to.open(std::span(datagram).first(bytes + transport::kSealBytes), begin_ns);
    const std::int64_t opened_ns = realtime::monotonic_now_ns();
    seal_ns.push_back(static_cast<double>(sealed_ns - begin_ns) / kDatagrams);
    open_ns.push_back(static_cast<double>(opened_ns - sealed_ns) / kDatagrams);
  }
  return {quantile(seal_ns, 0.5), quantile(open_ns, 0.5)};
}

json to_json(const Row& row, const TwoEnds& ends) {
  const Quantiles rtt = row.rtt_us();
  json told{{"method", row.method->name}, {"cipher", row.method->cipher}, {"is_sealed", row.method->suite.has_value()},
            {"up_bytes", row.sizes.up},   {"down_bytes", row.sizes.down}, {"over", ends.over()}};
  if (!row.method->made) {
    told["rtt_us"] = nullptr;
    told["reason"] = row.method->reason;
    return told;
  }
  told["rtt_us"] = {{"p50", rtt.p50}, {"p99", rtt.p99}, {"p99_9", rtt.p99_9}};
  told["lost"] = row.lost;
  told["is_real_time"] = row.is_fifo;
  if (row.method->name == "ours") {
    const Cost up = cost(*row.method->suite, row.sizes.up), down = cost(*row.method->suite, row.sizes.down);
    told["seal_ns"] = {{"up", up.seal_ns}, {"down", down.seal_ns}};
    told["open_ns"] = {{"up", up.open_ns}, {"down", down.open_ns}};
  }
  return told;
}

/// One line for a goal; what it compares may be missing.
json goal(const std::string& what, std::optional<double> value, double most) {
  const bool is_met = value && *value <= most;
  const std::string verdict = !value ? "UNKNOWN" : is_met ? "met    " : "NOT MET";
  fmt::print("{} {}: {} (goal: {:g} at most)\n", verdict, what, value ? fmt::format("{:.2f}", *value) : "-", most);
  return {{"what", what}, {"value", value ? json(*value) : json()}, {"most", most}, {"is_met", is_met}};
}

json goals(const std::vector<Row>& rows) {
  json told = json::array();
  for (const Sizes sizes : kSizes) {
    const Row* raw = nullptr;
    for (const Row& row : rows)
      if (row.method->name == "raw_udp" && row.sizes.up == sizes.up && row.method->made) raw = &row;
    for (const Row& row : rows) {
      if (row.method->name != "ours" || row.sizes.up != sizes.up) continue;
      const std::string which = fmt::format("ours, {}, {}/{} B", row.method->cipher, sizes.up, sizes.down);
      const auto of = [&](const Row* other, double Quantiles::*q) -> std::optional<double> {
        if (other == nullptr || !row.method->made || !other->method->made) return std::nullopt;
        return row.rtt_us().*q / (other->rtt_us().*q);
      };
      const double most = row.method->suite == Suite::kAesGcm ? kMostP50 : kMostP50Chacha;
      told.push_back(goal(which + ", p50 in raw UDP's", of(raw, &Quantiles::p50), most));
      told.push_back(goal(which + ", p99 in raw UDP's", of(raw, &Quantiles::p99), kMostP99));
      for (const Row& peer : rows) {
        if (peer.method->name == "ours" || peer.method->suite != row.method->suite || peer.sizes.up != sizes.up)
          continue;
        told.push_back(goal(which + ", p50 in " + peer.method->name + "'s", of(&peer, &Quantiles::p50), 1));
        told.push_back(goal(which + ", p99 in " + peer.method->name + "'s", of(&peer, &Quantiles::p99), 1));
      }
    }
  }
  return told;
}

void run(Options options) {
  if (options.is_quick) options.rounds = 3, options.round_trips = 2 * kTurnRoundTrips;
  const TwoEnds ends;
  const std::vector<Method> all = methods(ends);
  std::vector<Row> rows;
  for (const Sizes sizes : kSizes)
    for (const Method& m : all) rows.push_back({&m, sizes, {}, {}});
  if (!ends.has_cable()) fmt::print("over loopback, not between two network namespaces: {}\n", ends.reason());
  const int turns = std::max(1, options.round_trips / kTurnRoundTrips);
  for (int round = 0; round < options.rounds; ++round) {
    for (Row& row : rows) row.samples_us.clear();
    for (int turn = 0; turn < turns; ++turn) {
      for (Row& row : rows) {
        if (!row.method->made) continue;
        const TurnResult result = run_turn(*row.method->made, {row.sizes.up, row.sizes.down, kTurnRoundTrips});
        row.samples_us.insert(row.samples_us.end(), result.rtt_us.begin(), result.rtt_us.end());
        row.lost += result.lost;
        row.is_fifo = row.is_fifo && result.is_fifo;
      }
    }
    for (Row& row : rows)
      if (row.method->made) row.rounds.push_back(quantiles(row.samples_us));
  }
  fmt::print(
      "round trips over {}, 1 kHz, [us]: medians of {} rounds of {}, in turns of {} from method to method\n"
      "{:8} {:18} {:>5} {:>5} {:>8} {:>8} {:>8} {:>5}  {}\n",
      ends.over(), options.rounds, turns * kTurnRoundTrips, kTurnRoundTrips, "method", "cipher", "up B", "down", "p50",
      "p99", "p99.9", "lost", "[ns] up: seal open, down: seal open");
  json told = json::array();
  for (const Row& row : rows) {
    told.push_back(to_json(row, ends));
    const json& j = told.back();
    fmt::print("{:8} {:18} {:5} {:5} ", row.method->name, row.method->cipher, row.sizes.up, row.sizes.down);
    if (!row.method->made) {
      fmt::print("{}\n", row.method->reason);
      continue;
    }
    const Quantiles rtt = row.rtt_us();
    fmt::print("{:8.2f} {:8.2f} {:8.2f} {:5}", rtt.p50, rtt.p99, rtt.p99_9, row.lost);
    if (j.contains("seal_ns"))
      fmt::print("  {:.0f} {:.0f}, {:.0f} {:.0f}", j["seal_ns"]["up"].get<double>(), j["open_ns"]["up"].get<double>(),
                 j["seal_ns"]["down"].get<double>(), j["open_ns"]["down"].get<double>());
    fmt::print("{}\n", row.is_fifo ? "" : "  (no real-time threads here)");
  }
  const json judged = goals(rows);
  if (options.as_json)
    fmt::print("{}\n",
               json{{"rows", told}, {"goals", judged}, {"over", ends.over()}, {"reason", ends.reason()}}.dump());
}

}  // namespace

void add_link(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand(
      "link", "Round trips of a sealed lane beside raw UDP, ENet and ngtcp2, between two network namespaces");
  app->add_option("--rounds", options->rounds, "medians are of so many")->check(CLI::Range(1, 99));
  app->add_option("--round-trips", options->round_trips, "of each method and size, in a round")
      ->check(CLI::Range(kTurnRoundTrips, 1000000));
  app->add_flag("--quick", options->is_quick, "a minute at most: says that it works, not how fast");
  app->add_flag("--json", options->as_json, "one JSON object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
