// What a bulk transfer adds to the haptic lane's round trips, and what it gets, through a bottleneck that both share:
// ours beside the kernel's TCP.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/bottleneck.h"
#include "tests/bench/bulk_method.h"
#include "tests/bench/haptic_stream.h"
#include "tests/bench/link_statistics.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

constexpr double kLeastAllowed_ms = 1, kAllowedShare = 0.1;  // added p99, or of the round trip; and one datagram
constexpr double kDatagramBytes = 1'260;                     // bulk's, on the wire
constexpr double kLeastOfTcp = 0.9, kLeastOfRest = 0.5;      // goodput, without loss and with it
constexpr double kBurst = 4;                                 // packets lost in a row, on average
constexpr std::int64_t kQueue_ns = 100'000'000;              // as home routers have it
constexpr double kSettle_s = 0.3;                            // the haptic lane alone, before anything is counted
constexpr double kBeginShare = 1.0 / 3;                      // of a run, before goodput is counted
constexpr int kTries = 4;                                    // of a run on a machine that is busy otherwise, but
constexpr double kRepeats_s = 1'000;                         // nothing is repeated after so long

struct Options {
  std::vector<double> mbit{5, 20, 100}, rtt_ms{0, 20, 100}, loss{0, 0.01};
  std::vector<std::string> methods{"ours", "tcp_cubic", "tcp_bbr"};
  double seconds = 9;
  std::uint64_t seed = 1;
  bool is_quick = false, as_json = false;
};

struct Cell {
  double mbit, rtt_ms, loss;
  [[nodiscard]] double allowed_ms() const {
    return std::max(kLeastAllowed_ms, kAllowedShare * rtt_ms) + kDatagramBytes * 8e-3 / mbit;
  }
  /// What the haptic lane leaves of the link.
  [[nodiscard]] double rest_mbit() const {
    return mbit - 8e-6 * HapticStream::kRate_Hz * static_cast<double>(HapticStream::answer_wire_bytes());
  }
};

struct Run {
  std::string reason;  // why there is none
  Quantiles rtt_ms;
  double goodput_mbit = 0, haptic_loss = 0;
  double late_p99_9_us = 0;
  int tries = 0;
};

void sleep(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

Run run_once(Bottleneck& bottleneck, const TwoEnds& ends, const Cell& cell, const std::string& method,
             const Options& options) {
  Run run;
  transport::LinkSpec spec;
  spec.rate_bit_per_s = 1e6 * cell.mbit;
  spec.round_trip_ns = std::llround(1e6 * cell.rtt_ms);
  spec.loss = cell.loss;
  spec.burst = cell.loss > 0 ? kBurst : 1;
  spec.queue_ns = kQueue_ns;
  bottleneck.begin(spec, options.seed);
  auto haptic = HapticStream::begin(ends);
  if (!haptic) {
    run.reason = haptic.error();
  } else {
    sleep(kSettle_s + 2e-3 * cell.rtt_ms);
    MadeTransfer bulk;
    if (method == "ours") bulk = begin_bulk_lane(ends, (*haptic)->answer_bytes());
    if (method.starts_with("tcp_")) bulk = begin_tcp(ends, method.substr(4));
    if (!bulk) run.reason = bulk.error();
    (*haptic)->note_from_now();
    if (run.reason.empty()) {
      sleep(kBeginShare * options.seconds);
      const std::uint64_t before = *bulk ? (*bulk)->arrived_bytes() : 0;
      const auto begin = std::chrono::steady_clock::now();
      sleep((1 - kBeginShare) * options.seconds);
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
      const std::uint64_t after = *bulk ? (*bulk)->arrived_bytes() : 0;
      run.goodput_mbit = 8e-6 * static_cast<double>(after - before) / passed.count();
    }
    const HapticStream::Summary summary = (*haptic)->end();
    run.rtt_ms = quantiles(summary.rtt_ms);
    const double expected = HapticStream::kRate_Hz * options.seconds;
    run.haptic_loss = std::max(0.0, 1 - static_cast<double>(summary.rtt_ms.size()) / expected);
  }
  const Bottleneck::Summary link = bottleneck.end();
  run.late_p99_9_us = link.lateness.p99_9_us;
  if (run.reason.empty() && !link.lateness.is_valid())
    run.reason = fmt::format("this machine was too busy: the link was {:.0f} us late at p99.9", run.late_p99_9_us);
  if (run.reason.empty() && link.up.overflow + link.down.overflow > 0)
    run.reason = "more packets were under way than the link has room for";
  return run;
}

/// Again where the link was too late.
Run run(Bottleneck& bottleneck, const TwoEnds& ends, const Cell& cell, const std::string& method,
        const Options& options, std::chrono::steady_clock::time_point no_repeats) {
  Run run;
  for (int tries = 1; tries <= kTries; ++tries) {
    run = run_once(bottleneck, ends, cell, method, options);
    run.tries = tries;
    const bool is_late = run.late_p99_9_us > transport::Relay::ReleaseError::kMostRelease_us;
    if (!is_late || options.is_quick || std::chrono::steady_clock::now() > no_repeats) break;
  }
  return run;
}

json number(std::optional<double> value) {
  return value && std::isfinite(*value) ? json(*value) : json();
}

json row(const Cell& cell, const std::string& method, const Run& alone, const Run& run, double best_tcp_mbit) {
  json told{{"method", method},
            {"mbit", cell.mbit},
            {"rtt_ms", cell.rtt_ms},
            {"loss", cell.loss},
            {"haptic_added_p99_ms", nullptr},
            {"goodput_of_tcp", nullptr},
            {"goodput_of_rest", nullptr},
            {"allowed_p99_ms", cell.allowed_ms()},
            {"link_late_p99_9_us", run.late_p99_9_us},
            {"tries", run.tries}};
  const std::string reason = !run.reason.empty() ? run.reason : alone.reason;
  if (!reason.empty()) {
    told["reason"] = reason;
    return told;
  }
  const double added_ms = run.rtt_ms.p99 - alone.rtt_ms.p99;
  told["haptic_added_p99_ms"] = number(added_ms);
  told["haptic_p99_ms"] = number(run.rtt_ms.p99);
  told["haptic_alone_p99_ms"] = number(alone.rtt_ms.p99);
  told["haptic_lost"] = number(run.haptic_loss);
  told["goodput_mbit"] = number(run.goodput_mbit);
  told["goodput_of_rest"] = number(run.goodput_mbit / cell.rest_mbit());
  if (best_tcp_mbit > 0) told["goodput_of_tcp"] = number(run.goodput_mbit / best_tcp_mbit);
  if (method == "ours") {
    told["is_delay_met"] = added_ms <= cell.allowed_ms();
    if (cell.loss > 0)
      told["is_goodput_met"] = told["goodput_of_rest"] >= kLeastOfRest;
    else if (best_tcp_mbit > 0)
      told["is_goodput_met"] = told["goodput_of_tcp"] >= kLeastOfTcp;
  }
  return told;
}

void print(const json& row) {
  fmt::print("{:5g} {:5g} {:5g} {:10}", row["mbit"].get<double>(), row["rtt_ms"].get<double>(),
             100 * row["loss"].get<double>(), row["method"].get<std::string>());
  if (row.contains("reason")) {
    fmt::print("  {}\n", row["reason"].get<std::string>());
    return;
  }
  const auto value = [&](const char* key) { return row[key].is_null() ? NAN : row[key].get<double>(); };
  fmt::print(" {:10.2f} {:9.2f} {:8.2f} {:8.2f} {:8.2f} {:8.2f} {:8.0f} {:5}", value("haptic_alone_p99_ms"),
             value("haptic_added_p99_ms"), value("allowed_p99_ms"), value("goodput_mbit"), value("goodput_of_tcp"),
             value("goodput_of_rest"), value("link_late_p99_9_us"), row["tries"].get<int>());
  if (row.contains("is_delay_met") && !row["is_delay_met"].get<bool>()) fmt::print("  DELAY NOT MET");
  if (row.contains("is_goodput_met") && !row["is_goodput_met"].get<bool>()) fmt::print("  GOODPUT NOT MET");
  fmt::print("\n");
  std::fflush(stdout);
}

void measure(Bottleneck& bottleneck, const TwoEnds& ends, const Cell& cell, const Options& options,
             std::chrono::steady_clock::time_point no_repeats, json& rows) {
  const Run alone = run(bottleneck, ends, cell, "none", options, no_repeats);
  std::vector<Run> runs;
  double best_tcp_mbit = 0;
  for (const std::string& method : options.methods) {
    runs.push_back(run(bottleneck, ends, cell, method, options, no_repeats));
    if (method.starts_with("tcp_") && runs.back().reason.empty())
      best_tcp_mbit = std::max(best_tcp_mbit, runs.back().goodput_mbit);
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    rows.push_back(row(cell, options.methods[i], alone, runs[i], best_tcp_mbit));
    print(rows.back());
  }
}

void judge(const json& rows, const char* key, const char* what) {
  int known = 0, met = 0, all = 0;
  for (const json& told : rows) {
    if (told["method"] != "ours") continue;
    ++all;
    known += told.contains(key) ? 1 : 0;
    met += told.value(key, false) ? 1 : 0;
  }
  fmt::print("{} {}: {} of {} links, {} unknown\n",
             met < known ? "NOT MET"
             : met < all ? "UNKNOWN"
                         : "met    ",
             what, met, all, all - known);
}

void run(Options options) {
  if (options.is_quick) {
    options.mbit = {20};
    options.rtt_ms = {0, 20};
    options.seconds = 3;
  }
  TwoEnds ends;
  const auto bottleneck = Bottleneck::open(ends);
  if (!bottleneck) fmt::print("no link of our own here: {}\n", bottleneck.error());
  fmt::print("{:>5} {:>5} {:>5} {:10} {:>10} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>5}\n", "Mbit", "rtt", "loss%",
             "bulk", "alone p99", "added p99", "allowed", "goodput", "of TCP", "of rest", "late us", "tries");
  const auto no_repeats =
      std::chrono::steady_clock::now() +
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(kRepeats_s));
  json rows = json::array();
  for (const double mbit : options.mbit)
    for (const double rtt_ms : options.rtt_ms)
      for (const double loss : options.loss) {
        const Cell cell{mbit, rtt_ms, loss};
        if (bottleneck) {
          measure(**bottleneck, ends, cell, options, no_repeats, rows);
          continue;
        }
        for (const std::string& method : options.methods) {
          Run none;
          none.reason = bottleneck.error();
          rows.push_back(row(cell, method, none, none, 0));
        }
      }
  judge(rows, "is_delay_met", "added p99 within max(1 ms, RTT / 10) and a datagram");
  judge(rows, "is_goodput_met",
        "goodput of 90 % of the better TCP's, or with loss half of what the haptic lane leaves");
  if (options.as_json)
    fmt::print("{}\n", json{{"rows", rows}, {"seconds", options.seconds}, {"seed", options.seed}}.dump());
}

}  // namespace

void add_bulk(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand(
      "bulk", "What a bulk transfer adds to the haptic lane through a shared bottleneck, beside TCP cubic and BBR");
  app->add_option("--mbit", options->mbit, "of the bottleneck")->delimiter(',')->check(CLI::Range(1, 1000));
  app->add_option("--rtt", options->rtt_ms, "round trips [ms]")->delimiter(',')->check(CLI::Range(0, 1000));
  app->add_option("--loss", options->loss, "share lost, in bursts")->delimiter(',')->check(CLI::Range(0.0, 0.5));
  app->add_option("--methods", options->methods, "ours, tcp_cubic, tcp_bbr or another of this kernel's")
      ->delimiter(',');
  app->add_option("--seconds", options->seconds, "of each run")->check(CLI::Range(1, 1000));
  app->add_option("--seed", options->seed, "of what is lost");
  app->add_flag("--quick", options->is_quick, "a minute at most: says that it works, not how well");
  app->add_flag("--json", options->as_json, "one JSON object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
