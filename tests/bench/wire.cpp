// What the haptic lane's messages weigh, all headers counted, how long they take to write and read, and what they cost
// in force.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "codecs/wire/answer_message.h"
#include "tests/bench/bench.h"
#include "tests/bench/wire_error.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

// Of every datagram: IPv4 20, UDP 8, the sealed datagram's head 16 and tag 16, the message's type 1. IPv6 takes 20
// more.
constexpr double kHeaderBytes = 20 + 8 + 16 + 16 + 1, kIpv6Bytes = 20;
constexpr double kPoses_Hz = 2000, kAnswers_Hz = 1000;
constexpr double kMostUp_Mbit = 2, kMostDown_Mbit = 3, kMostError = 0.005;
constexpr std::uint32_t kBudgeted = 7;  // contacts

struct Options {
  std::vector<std::string> scenes = {"file-cad", "block-gear", "hammer-torus", "ridges", "roughness"};
  std::vector<std::string> rungs = {"linear", "quadratic"};
  std::vector<int> round_trips_ms = {1, 20, 100};
  std::size_t frames = 4000;
  bool as_json = false;
};

double mbit(double bytes, double hz) {
  return 8e-6 * (bytes + kHeaderBytes) * hz;
}

json shares(const WireShares& s) {
  return {{"p50", s.p50}, {"p99", s.p99}, {"p99_9", s.p99_9}, {"max", s.most}};
}

json row(const WireScene& scene, const WireSetting& setting) {
  const WireError e = wire_error(scene, setting);
  const auto percent = [](double share) { return 100 * share; };
  fmt::print(
      "{:12} {:9} {:4} {:5.2f} {:3} {:6.0f} {:6.0f} {:5.2f} {:5.2f} | {:7.4f} {:7.4f} {:7.4f} {:7.4f} | {:7.4f} "
      "{:7.4f} | {:7.4f} {:7.4f} | {:4.0f} {:4.0f} {:4.0f} {:4.0f}\n",
      scene.name, name(setting.rung), setting.round_trip_ticks, e.contacts_mean, e.contacts_most, e.answer_bytes_mean,
      e.by_seven_bytes, e.told_bytes_mean, mbit(e.answer_bytes_mean, kAnswers_Hz), percent(e.force.p50),
      percent(e.force.p99), percent(e.force.p99_9), percent(e.force.most), percent(e.torque.p99_9),
      percent(e.torque.most), percent(e.with_poses.p50), percent(e.with_poses.p99), e.pose_write_ns, e.pose_read_ns,
      e.answer_write_ns, e.answer_read_ns);
  return {{"scene", scene.name},
          {"rung", name(setting.rung)},
          {"rtt_ms", setting.round_trip_ticks},
          {"ticks", e.ticks},
          {"touching", e.touching},
          {"contacts_mean", e.contacts_mean},
          {"contacts_max", e.contacts_most},
          {"told_bytes_mean", e.told_bytes_mean},
          {"up_bytes", e.pose_bytes},
          {"down_bytes", e.answer_bytes_mean},
          {"down_bytes_max", e.answer_bytes_most},
          {"down_bytes_by_seven", e.by_seven_bytes},
          {"up_mbit", mbit(e.pose_bytes, kPoses_Hz)},
          {"down_mbit", mbit(e.answer_bytes_mean, kAnswers_Hz)},
          {"force_error", shares(e.force)},
          {"torque_error", shares(e.torque)},
          {"force_error_with_poses", shares(e.with_poses)},
          {"ns",
           {{"pose_write", e.pose_write_ns},
            {"pose_read", e.pose_read_ns},
            {"answer_write", e.answer_write_ns},
            {"answer_read", e.answer_read_ns}}}};
}

int run(const Options& options) {
  json rows = json::array(), sizes = json::array();
  fmt::print("answers once their contacts are known, at 1 kHz:\ncontacts  bytes  Mbit/s  with IPv6\n");
  for (std::uint32_t n = 1; n <= 11; ++n) {
    const auto bytes = static_cast<double>(codecs::kAnswerBlockBytes + n * codecs::kContactBytes);
    fmt::print("{:8} {:6.0f} {:7.2f} {:10.2f}\n", n, bytes, mbit(bytes, kAnswers_Hz),
               mbit(bytes + kIpv6Bytes, kAnswers_Hz));
    sizes.push_back({{"contacts", n}, {"bytes", bytes}, {"mbit", mbit(bytes, kAnswers_Hz)}});
  }
  const double pose_bytes = codecs::kPoseMessageBytes + codecs::kWrenchBytes;
  fmt::print("poses with the felt wrench, at 2 kHz: {:.0f} bytes, {:.2f} Mbit/s, with IPv6 {:.2f}\n\n", pose_bytes,
             mbit(pose_bytes, kPoses_Hz), mbit(pose_bytes + kIpv6Bytes, kPoses_Hz));
  fmt::print(
      "errors in % of max(force, {} N); 'poses': with the grid of poses, against a service asked exactly\n"
      "{:12} {:9} {:>4} {:>9} {:>6} {:>6} {:>5} {:>5} | {:>31} | {:>15} | {:>15} | {}\n",
      kWireLeast_N, "scene", "rung", "rtt", "contacts", "bytes", "of 7", "told", "Mbit", "force p50 p99 p99.9 max",
      "torque p99.9", "poses p50 p99", "ns: pose w r, answer w r");
  double worst = 0, most_down_Mbit = 0;
  for (const std::string& scene_name : options.scenes) {
    const WireScene scene = wire_scene(scene_name, 1, options.frames);
    for (const std::string& rung : options.rungs) {
      for (const int ms : options.round_trips_ms) {
        const WireSetting setting{rung == "quadratic" ? local_model::Rung::kQuadratic : local_model::Rung::kLinear, ms,
                                  true};
        rows.push_back(row(scene, setting));
        worst = std::max(worst, rows.back()["force_error"]["p99_9"].get<double>());
        if (setting.rung == local_model::Rung::kLinear)  // curvatures are beyond the budget
          most_down_Mbit =
              std::max(most_down_Mbit, mbit(rows.back()["down_bytes_by_seven"].get<double>(), kAnswers_Hz));
      }
    }
  }
  const double known_Mbit =
      mbit(static_cast<double>(codecs::kAnswerBlockBytes + kBudgeted * codecs::kContactBytes), kAnswers_Hz);
  const bool is_met = worst < kMostError && mbit(pose_bytes, kPoses_Hz) <= kMostUp_Mbit &&
                      std::max(known_Mbit, most_down_Mbit) <= kMostDown_Mbit;
  fmt::print(
      "\nup {:.2f} Mbit/s of {}, down with seven contacts {:.2f}, as measured {:.2f}, of {}; force error p99.9 "
      "{:.3f} % of {} %: {}\n",
      mbit(pose_bytes, kPoses_Hz), kMostUp_Mbit, known_Mbit, most_down_Mbit, kMostDown_Mbit, 100 * worst,
      100 * kMostError, is_met ? "met" : "MISSED");
  if (options.as_json)
    fmt::print("{}\n", json{{"wire",
                             {{"rows", rows},
                              {"sizes", sizes},
                              {"header_bytes", kHeaderBytes},
                              {"up_bytes", pose_bytes},
                              {"up_mbit", mbit(pose_bytes, kPoses_Hz)},
                              {"down_mbit_by_seven", most_down_Mbit},
                              {"force_error_p99_9", worst},
                              {"is_met", is_met}}}}
                           .dump());
  return is_met ? 0 : 1;
}

}  // namespace

void add_wire(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("wire", "What haptic messages weigh, take and cost in force");
  app->add_option("--scenes", options->scenes, "benchmark scenes, ridges, roughness")->delimiter(',');
  app->add_option("--rungs", options->rungs, "linear, quadratic")
      ->delimiter(',')
      ->check(CLI::IsMember({"linear", "quadratic"}));
  app->add_option("--rtt", options->round_trips_ms, "round trips [ms]")->delimiter(',')->check(CLI::Range(0, 1000));
  app->add_option("--frames", options->frames, "of each scene's motion, at 1 kHz")->check(CLI::Range(100, 1000000));
  app->add_flag("--json", options->as_json, "one JSON object as the last line");
  app->callback([options] {
    if (const int status = run(*options); status != 0) throw CLI::RuntimeError(status);
  });
}

}  // namespace farfeel::bench
