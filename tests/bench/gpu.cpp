// Penetration depths on a graphics device: frames against their number of contacts, the grid's size, the sessions that
// share the device and the size of its work-groups, each beside the simd back end on the same poses. Raw grids, the
// source's kind of frame, simd leaves to the reference, so that there the reference is what stands beside.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <barrier>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "haptic_core/penetration/simd/simd.h"
#include "tests/bench/bench.h"
#include "tests/bench/named_back_end.h"
#include "tests/bench/penetration_pairs.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using nlohmann::json;
using penetration::Penetration;
using penetration::Query;
using Clock = std::chrono::steady_clock;

constexpr penetration::Limits kLimits{.coarse_triangles = 16};
constexpr double kSlideStep_m = 10e-6;
constexpr std::size_t kUsualContacts = 7;
constexpr std::uint32_t kUsualSamples = 50, kMostSessions = 16;

struct Options {
  std::vector<std::size_t> contacts = {1, 7, 16, 64, 256};
  std::vector<std::uint32_t> samples = {25, 50, 100, 200, 400};
  std::vector<std::size_t> sessions = {1, 2, 4, 8, 16};
  std::vector<std::uint32_t> groups = {64, 128, 256, 512, 1024};
  std::string vendor;
  std::size_t frames = 500;
  double row_s = 1;
  bool as_json = false;
};

/// Frames of contacts that slide, each its own way.
class Frames {
 public:
  Frames(const PlatePair& pair, std::size_t contacts, std::uint32_t samples, bool is_raw, unsigned seed)
      : queries_(contacts), answers_(contacts) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    const auto simd = penetration::make_simd(kLimits);
    for (std::size_t i = 0; i < contacts; ++i) {
      const double turn = 3 * unit(random);
      const glm::dvec2 tilt{4e-3 * unit(random), 4e-3 * unit(random)};
      glm::dvec3 p{2e-3 * unit(random), 2e-3 * unit(random), 0};
      Query query = pair.query(PlatePair::tool_pose(turn, tilt, p), penetration::kDefaultSoftWidth_m, samples);
      Penetration at;
      simd->evaluate({&query, 1}, {&at, 1});
      query.t.X_CO.p.z = at.depth_m - 0.2e-3;
      if (is_raw) query.soft_width_m = 0, query.refines = false;
      queries_[i] = query;
      starts_.push_back(query.t.X_CO.p);
    }
  }
  double run_us(penetration::BackEnd& back_end, std::size_t frame) {
    for (std::size_t i = 0; i < queries_.size(); ++i) {
      const auto way = static_cast<double>(i);
      const double along_m = kSlideStep_m * static_cast<double>(frame % 200);
      queries_[i].t.X_CO.p = starts_[i] + along_m * glm::dvec3{std::cos(way), std::sin(way), 0};
    }
    const auto start = Clock::now();
    back_end.evaluate(queries_, answers_);
    return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
  }
  [[nodiscard]] const std::vector<Penetration>& answers() const { return answers_; }

 private:
  std::vector<Query> queries_;
  std::vector<Penetration> answers_;
  std::vector<glm::dvec3> starts_;
};

/// At most `frames`, and no more than `row_s` seconds beyond the first five.
std::vector<double> times_us(Frames& frames, penetration::BackEnd& back_end, const Options& options,
                             const NamedBackEnd* named, DeviceTimes& device) {
  frames.run_us(back_end, 0);
  std::vector<double> us;
  const auto start = Clock::now();
  for (std::size_t f = 1; f <= options.frames; ++f) {
    us.push_back(frames.run_us(back_end, f));
    if (named && named->last_egl()) device.add(named->last_egl()->tally());
    if (f >= 5 && std::chrono::duration<double>(Clock::now() - start).count() > options.row_s) break;
  }
  return us;
}

json row_of(const PlatePair& pair, const NamedBackEnd& egl, std::size_t contacts, std::uint32_t n, bool is_raw,
            const Options& options) {
  Frames ours(pair, contacts, n, is_raw, 1), theirs(pair, contacts, n, is_raw, 1);
  const auto on_device = egl.maker()(kLimits);
  pair.prepare(*on_device);
  DeviceTimes device, none;
  const std::vector<double> us = times_us(ours, *on_device, options, &egl, device);
  const auto by_simd_count = egl.last_egl()->tally().by_simd;
  const auto simd = penetration::make_simd(kLimits);
  const std::vector<double> simd_us = times_us(theirs, *simd, options, nullptr, none);
  ours.run_us(*on_device, 7), theirs.run_us(*simd, 7);
  double worst_m = 0;
  for (std::size_t i = 0; i < contacts; ++i)
    worst_m = std::max(worst_m, std::abs(ours.answers()[i].depth_m - theirs.answers()[i].depth_m));
  json row{{"method", is_raw ? "raw grid" : "soft 10 um"},
           {"contacts", contacts},
           {"n", n},
           {"frames", us.size()},
           {"p50_us", quantile(us, 0.5)},
           {"p99_us", quantile(us, 0.99)},
           {"simd_p50_us", quantile(simd_us, 0.5)},
           {"simd_p99_us", quantile(simd_us, 0.99)},
           {"worst_depth_um", 1e6 * worst_m},
           {"answered_by_simd", by_simd_count}};
  device.write(row);
  return row;
}

void print(const json& row) {
  fmt::print(
      "{:10} {:4} contacts N {:4}: egl p50 {:9.1f} p99 {:9.1f} us (prepare {:.1f} upload {:.1f} dispatch {:.1f} "
      "readback "
      "{:.1f}); simd p50 {:9.1f} p99 {:9.1f} us; depths differ by at most {:.3f} um\n",
      row["method"].get<std::string>(), row["contacts"].get<int>(), row["n"].get<int>(), row["p50_us"].get<double>(),
      row["p99_us"].get<double>(), row["prepare_us"].get<double>(), row["upload_us"].get<double>(),
      row["dispatch_us"].get<double>(), row["readback_us"].get<double>(), row["simd_p50_us"].get<double>(),
      row["simd_p99_us"].get<double>(), row["worst_depth_um"].get<double>());
  std::fflush(stdout);
}

/// Sessions on threads of their own, frame after frame without a pause: seven contacts each.
json sessions_row(const PlatePair& pair, const NamedBackEnd& egl, std::size_t sessions, const Options& options) {
  std::vector<std::vector<double>> us(sessions);
  const penetration::egl::Device::Counters before = egl.device()->counters();
  std::barrier ready(static_cast<std::ptrdiff_t>(sessions));
  {
    std::vector<std::unique_ptr<penetration::egl::EglBackEnd>> back_ends;
    for (std::size_t s = 0; s < sessions; ++s) {
      back_ends.push_back(penetration::egl::make_egl(egl.device(), kLimits));
      pair.prepare(*back_ends.back());
    }
    std::vector<std::jthread> threads;
    for (std::size_t s = 0; s < sessions; ++s) {
      threads.emplace_back([&, s] {
        Frames frames(pair, kUsualContacts, kUsualSamples, false, static_cast<unsigned>(s));
        DeviceTimes none;
        ready.arrive_and_wait();
        us[s] = times_us(frames, *back_ends[s], options, nullptr, none);
      });
    }
    threads.clear();
  }
  const penetration::egl::Device::Counters after = egl.device()->counters();
  std::vector<double> all;
  for (const auto& own : us) all.insert(all.end(), own.begin(), own.end());
  json row{{"sessions", sessions},
           {"p50_us", quantile(all, 0.5)},
           {"p99_us", quantile(all, 0.99)},
           {"frames_a_dispatch", static_cast<double>(after.frames - before.frames) /
                                     static_cast<double>(after.dispatches - before.dispatches)}};
  fmt::print("{:2} sessions of seven contacts: p50 {:.1f} p99 {:.1f} us, {:.1f} frames a dispatch\n", sessions,
             row["p50_us"].get<double>(), row["p99_us"].get<double>(), row["frames_a_dispatch"].get<double>());
  std::fflush(stdout);
  return row;
}

json groups_row(const PlatePair& pair, std::uint32_t group, const Options& options) {
  const NamedBackEnd egl("egl",
                         {.vendor = options.vendor, .group = group, .clients = 1, .is_timed = true, .patience_s = 60});
  const json row = row_of(pair, egl, kUsualContacts, kUsualSamples, false, options);
  fmt::print("{:4} invocations a contact: p50 {:.1f} p99 {:.1f} us, dispatch {:.1f} us, warm after {:.0f} ms\n", group,
             row["p50_us"].get<double>(), row["p99_us"].get<double>(), row["dispatch_us"].get<double>(),
             egl.device()->info().warmup_ms);
  std::fflush(stdout);
  return {{"group", group},
          {"p50_us", row["p50_us"]},
          {"p99_us", row["p99_us"]},
          {"dispatch_us", row["dispatch_us"]},
          {"warmup_ms", egl.device()->info().warmup_ms}};
}

/// The fewest contacts, of those measured, from which on the device is faster; 0: never.
std::size_t crossing(const json& rows, const std::string& method, std::uint32_t n) {
  std::size_t from = 0;
  for (const json& row : rows) {
    if (row["method"] != method || row["n"] != n) continue;
    const bool is_faster = row["p50_us"].get<double>() < row["simd_p50_us"].get<double>();
    if (!is_faster) from = 0;
    if (is_faster && from == 0) from = row["contacts"].get<std::size_t>();
  }
  return from;
}

json run(const Options& options) {
  const auto pair = plate_pair("ridged");
  json groups = json::array();
  for (const std::uint32_t group : options.groups) groups.push_back(groups_row(*pair, group, options));
  const NamedBackEnd egl("egl",
                         {.vendor = options.vendor, .clients = kMostSessions, .is_timed = true, .patience_s = 60});
  const auto& info = egl.device()->info();
  fmt::print("{}, {}, {}{}; {} invocations a contact; warm after {:.0f} ms; simd with {} kernels\n", info.renderer,
             info.version, info.platform, info.is_software ? " (software)" : "", info.group, info.warmup_ms,
             penetration::instruction_set_name());
  json rows = json::array(), sessions = json::array(), crossings = json::array();
  for (const bool is_raw : {false, true}) {
    for (const std::uint32_t n : options.samples) {
      for (const std::size_t contacts : options.contacts) {
        if (is_raw && contacts * n * n > 7u * 100 * 100 && info.is_software) continue;  // minutes, and nothing learnt
        rows.push_back(row_of(*pair, egl, contacts, n, is_raw, options));
        print(rows.back());
      }
    }
  }
  for (const std::size_t count : options.sessions) sessions.push_back(sessions_row(*pair, egl, count, options));
  for (const char* method : {"soft 10 um", "raw grid"}) {
    for (const std::uint32_t n : options.samples) {
      const std::size_t from = crossing(rows, method, n);
      crossings.push_back({{"method", method}, {"n", n}, {"contacts", from}});
      fmt::print("{}, N {}: the device is faster {}\n", method, n,
                 from == 0 ? std::string("nowhere") : fmt::format("from {} contacts on", from));
    }
  }
  json result = egl.about();
  result["simd"] = penetration::instruction_set_name();
  result["rows"] = rows, result["sessions"] = sessions, result["groups"] = groups, result["crossings"] = crossings;
  return result;
}

}  // namespace

void add_gpu(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("gpu", "Penetration depths on a graphics device, beside simd");
  app->add_option("--contacts", options->contacts, "a frame")->check(CLI::Range(1, 4096));
  app->add_option("--n", options->samples, "samples a side")->check(CLI::Range(1, 400));
  app->add_option("--sessions", options->sessions, "that share the device")->check(CLI::Range(1u, kMostSessions));
  app->add_option("--groups", options->groups, "invocations a contact")->check(CLI::Range(64, 1024));
  app->add_option("--vendor", options->vendor, "only a device whose vendor's or renderer's name holds this");
  app->add_option("--frames", options->frames, "a row, at most")->check(CLI::Range(5, 1'000'000));
  app->add_option("--row-s", options->row_s, "seconds a row takes, roughly");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] {
    const json result = run(*options);
    if (options->as_json) fmt::print("{}\n", result.dump());
  });
}

}  // namespace farfeel::bench
