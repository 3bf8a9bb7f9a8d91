// How true to the remote's surface the hand feels it between its answers: every rung of the local model replayed along
// one hand path, through the real contact service, in simulated time, against the force at the same pose without delay.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "codecs/felt/felt_outline.h"
#include "haptic_core/local_model/local_model.h"
#include "master_station/session/tile_receiver.h"
#include "slave_sim/models/height_plate.h"
#include "slave_sim/session/tile_feed.h"
#include "tests/bench/bench.h"

namespace farfeel::bench {
namespace {

using contact_service::ToolPose;
using local_model::Rung;
using nlohmann::json;

constexpr double kTruth_hz = 5000, kAnswers_hz = 1000, kPress_m = 0.6e-3;
constexpr double kWarmUp_s = 0.7;  ///< tiles of the first contact arrive, forces settle

struct Link {
  double rtt_ms, jitter_ms, loss;
};

/// Plates whose material has no friction and no damping: the depth's force alone is compared.
struct Scene {
  std::string name;
  geometry::HapticSurface table, tool;
  contact::Material material;
  penetration::FeltSurface table_felt, tool_felt;
  contact_service::TouchableObject S, T;

  Scene(std::string named, geometry::HapticSurface table_surface)
      : name(std::move(named)),
        table(std::move(table_surface)),
        tool(slave_sim::ridged_plate(0.012, 0.3e-3, {.size_m = {0.006, 0.005, 0.004}})),
        table_felt(table),
        tool_felt(tool) {
    material.static_friction = material.dynamic_friction = material.damping_Ns_per_m = 0;
    S = {&table, material, {}, &table_felt};
    T = {&tool, material, {}, &tool_felt};
  }
  Scene(const Scene&) = delete;
  [[nodiscard]] contact_service::ContactService service() const { return {std::span(&S, 1), T, {}}; }
};

std::vector<std::unique_ptr<Scene>> scenes(bool is_quick) {
  const slave_sim::PlateSize size{.size_m = {0.060, 0.030, 0.004}};
  std::vector<std::unique_ptr<Scene>> all;
  all.push_back(std::make_unique<Scene>("ridges-1.5mm", slave_sim::ridged_plate(1.5e-3, 0.1e-3, size)));
  if (!is_quick) all.push_back(std::make_unique<Scene>("ridges-4mm", slave_sim::ridged_plate(4e-3, 0.4e-3, size)));
  const auto rough = [](double x, double y) {  // waves of 1.2 to 4 mm every way, about 40 um rms
    double z = 0;
    for (int k = 0; k < 12; ++k) {
      const double wave = 2 * M_PI / (1.2e-3 * std::pow(1.115, k)), angle = 2.4 * k;
      z += 16e-6 * std::cos(wave * (std::cos(angle) * x + std::sin(angle) * y) + 1.7 * k);
    }
    return z;
  };
  all.push_back(std::make_unique<Scene>("roughness", slave_sim::height_plate(rough, size)));
  return all;
}

/// Strokes along x with reversals, at a mean speed, a slow sway across and a little rotation.
ToolPose hand_at(double t_s, double speed_m_s, std::uint32_t sequence) {
  constexpr double kHalf_m = 0.02;
  const auto pose_at = [&](double t) {
    const double phase = M_PI * speed_m_s * t / (2 * kHalf_m);
    const double x = -kHalf_m * std::cos(phase), y = 2e-3 * std::sin(0.7 * phase + 0.3);
    const glm::dquat turned = spatial::rotation_from_vector({0, 0, 0.1 * std::sin(0.4 * phase)});
    return spatial::Pose{glm::normalize(turned * glm::dquat{0, 1, 0, 0}), {x, y, -kPress_m}};
  };
  constexpr double h = 1e-5;
  const spatial::Pose a = pose_at(t_s - h), X = pose_at(t_s), b = pose_at(t_s + h);
  const glm::dvec3 w = spatial::vector_from_rotation(glm::normalize(b.R * glm::conjugate(a.R))) / (2 * h);
  return {sequence, std::llround(1e9 * (t_s + 1)), X, {w, (b.p - a.p) / (2 * h)}};
}

spatial::Vector6 spring_wrench(const contact::ContactSet& set) {
  spatial::Vector6 F = spatial::Vector6::Zero();
  for (std::uint32_t i = 0; i < set.count; ++i)
    F -= set.contacts[i].material.stiffness_N_per_m * std::max(0.0, set.contacts[i].depth_m) * set.contacts[i].gradient;
  return F;
}

/// Delays, loses; the newest wins.
template <typename T>
class OneWay {
 public:
  OneWay(const Link& link, std::uint32_t seed) : link_(link), random_(seed) {}
  void send(double now_s, T value) {
    std::uniform_real_distribution<> share;
    if (share(random_) < link_.loss) return;
    due_.push_back({now_s + 0.5e-3 * link_.rtt_ms + 1e-3 * link_.jitter_ms * share(random_), std::move(value)});
  }
  template <typename Take>
  void deliver(double now_s, Take&& take) {
    for (auto it = due_.begin(); it != due_.end();) {
      if (it->first <= now_s + 1e-9) {
        take(it->second);
        it = due_.erase(it);
      } else {
        ++it;
      }
    }
  }

 private:
  Link link_;
  std::mt19937 random_;
  std::deque<std::pair<double, T>> due_;
};

struct Row {
  double force_share = 0, torque_share = 0, kB_s = 0, step_N = 0, tiles_share = 0;
};

Row replay(const Scene& scene, Rung rung, double tick_hz, const Link& link, double speed_m_s, double seconds) {
  contact_service::ContactService remote = scene.service(), truth = scene.service();
  auto outline = codecs::read_felt_outline(codecs::write_felt_outline(std::array{scene.T, scene.S}, {}).value());
  local_model::TileCache cache(std::move(outline.value()));
  std::optional<local_model::LocalContacts> local;
  std::optional<slave_sim::TileFeed> feed;
  std::optional<master_station::TileReceiver> receiver;
  if (rung == Rung::kTiles) {
    local.emplace(cache);
    feed.emplace(std::span(&scene.S, 1), scene.T, contact_service::ContactOptions{});
    receiver.emplace(cache);
  }
  local_model::LocalModelSettings settings;
  settings.rung = rung;
  local_model::LocalModel model(settings);
  OneWay<ToolPose> up(link, 1);
  OneWay<contact::ContactSet> down(link, 2);
  OneWay<std::vector<std::byte>> tiles_down(link, 3), tiles_up(link, 4);

  const auto per_tick = static_cast<int>(std::lround(kTruth_hz / tick_hz));
  const auto per_answer = static_cast<int>(std::lround(kTruth_hz / kAnswers_hz));
  const auto first = static_cast<int>((kWarmUp_s + 3e-3 * link.rtt_ms) * kTruth_hz);
  const int last = first + static_cast<int>(seconds * kTruth_hz);
  Row row;
  spatial::Vector6 felt = spatial::Vector6::Zero(), felt_before = felt, mean = felt, square = felt, error = felt;
  std::uint32_t newest_there = 0, newest_here = 0, ticks = 0, from_tiles = 0;
  std::uint64_t tile_bytes = 0;
  ToolPose pose_there;
  for (int i = 0; i < last; ++i) {
    const double t_s = i / kTruth_hz;
    const std::int64_t now_ns = std::llround(1e9 * (t_s + 1));
    const ToolPose hand = hand_at(t_s, speed_m_s, static_cast<std::uint32_t>(i + 1));
    if (i % per_tick == 0) {
      const double dt_s = 1 / tick_hz;
      model.advance(dt_s, hand.X_WT);
      down.deliver(t_s, [&](const contact::ContactSet& set) {
        if (set.pose_sequence <= newest_here) return;
        newest_here = set.pose_sequence;
        if (local) {
          local->hear(set);
          model.hear(set);
        } else {
          model.update(set, hand.X_WT);
        }
      });
      if (local) {
        tiles_down.deliver(t_s, [&](const std::vector<std::byte>& payload) { receiver->on_tile(payload); });
        std::vector<std::byte> names(1184);
        if (receiver->owes(now_ns)) {
          names.resize(receiver->acknowledge(names, now_ns));
          tiles_up.send(t_s, names);
        }
        const local_model::TickContacts& here = local->at(hand);
        model.refresh(here, hand.X_WT);
        if (i >= first) ++ticks, from_tiles += here.from_remote == 0;
      }
      felt = model.evaluate(hand.X_WT, {}, dt_s).response.F_To_W;
      const spatial::Vector6 V = spatial::to_vector6(hand.V_WT_W);
      model.settle(felt, V, dt_s, hand_at(t_s + dt_s, speed_m_s, 0).X_WT);
      up.send(t_s, hand);
      if (i >= first) row.step_N = std::max(row.step_N, (felt - felt_before).tail<3>().norm());
      felt_before = felt;
    }
    up.deliver(t_s, [&](const ToolPose& pose) {
      if (pose.sequence > newest_there) newest_there = pose.sequence, pose_there = pose;
    });
    if (newest_there != 0 && i % per_answer == 0) {
      contact::ContactSet set = remote.answer(pose_there);
      set.F_To_W = spatial::wrench_from(spring_wrench(set));
      down.send(t_s, set);
      if (feed) {
        tiles_up.deliver(t_s, [&](const std::vector<std::byte>& names) { feed->on_acknowledge(names, now_ns); });
        feed->aim(pose_there, now_ns);
        while (const auto payload = feed->next(now_ns)) {
          if (i >= first) tile_bytes += payload->size();
          tiles_down.send(t_s, {payload->begin(), payload->end()});
        }
      }
    }
    if (i < first) continue;
    const spatial::Vector6 F = spring_wrench(truth.answer(hand));
    mean += F;
    square += F.cwiseProduct(F);
    error += (felt - F).cwiseProduct(felt - F);
  }
  const double n = last - first;
  const spatial::Vector6 variance = square / n - (mean / n).cwiseProduct(mean / n);
  row.force_share = std::sqrt(error.tail<3>().sum() / n / variance.tail<3>().sum());
  row.torque_share = std::sqrt(error.head<3>().sum() / n / variance.head<3>().sum());
  row.kB_s = 1e-3 * static_cast<double>(tile_bytes) / seconds;
  row.tiles_share = ticks > 0 ? static_cast<double>(from_tiles) / ticks : 0;
  return row;
}

/// Seven plates side by side under one tool of seven feet: how long a tick's contacts take.
json time_seven_contacts(bool is_quick) {
  const geometry::HapticSurface table =
      slave_sim::ridged_plate(1.5e-3, 0.1e-3, {.size_m = {0.040, 0.030, 0.004}, .texel_m = 1e-4});
  const geometry::HapticSurface tool = slave_sim::ridged_plate(0.012, 0.3e-3, {.size_m = {0.0064, 0.0064, 0.004}});
  const penetration::FeltSurface table_felt(table), tool_felt(tool);
  std::vector<contact_service::TouchableObject> bodies{{&tool, {}, {}, &tool_felt}};
  for (int k = 0; k < 7; ++k) bodies.push_back({&table, {}, {{1, 0, 0, 0}, {0, 0, 1e-5 * k}}, &table_felt});
  local_model::TileCache cache(codecs::read_felt_outline(codecs::write_felt_outline(bodies, {}).value()).value());
  for (std::uint32_t s = 0; s < bodies.size(); ++s) {
    const auto& tiles = bodies[s].felt->tiles;
    for (std::uint32_t tile = 0; tile < tiles.size(); ++tile) {
      (void)cache.put({s, tile}, tiles[tile]);
      cache.take_arrived(1);
    }
  }
  local_model::LocalContacts local(cache);
  std::vector<double> us;
  std::uint32_t contacts = 0;
  const int frames = is_quick ? 1000 : 8000;
  for (int i = 0; i < frames; ++i) {
    const ToolPose hand = hand_at(i * 1e-3, 0.1, static_cast<std::uint32_t>(i));
    const auto began = std::chrono::steady_clock::now();
    const local_model::TickContacts& here = local.at(hand);
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - began).count());
    contacts = here.from_tiles;
  }
  std::sort(us.begin(), us.end());
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  fmt::print("a tick's {} contacts from tiles of 6.4 x 6.4 mm: p50 {:.0f}, p99 {:.0f}, p99.9 {:.0f} us\n", contacts,
             at(0.5), at(0.99), at(0.999));
  return {{"contacts", contacts}, {"p50", at(0.5)}, {"p99", at(0.99)}, {"p99_9", at(0.999)}};
}

const char* name_of(Rung rung) {
  return rung == Rung::kHeldWrench ? "held" : rung == Rung::kLinear ? "linear" : "tiles";
}

/// Error against delay, one line a rung, averaged over scenes at the fastest tick.
void plot(const json& rows, const std::string& path, double tick_hz) {
  std::ofstream out(path);
  const auto x = [](double rtt_ms) { return 70 + 2.4 * rtt_ms; };
  const auto y = [](double share) { return 330 - 95 * std::clamp(std::log10(share / 0.01), 0.0, 3.0); };
  out << R"(<svg xmlns="http://www.w3.org/2000/svg" width="640" height="400" font-family="sans-serif" font-size="12">)"
      << "\n<rect width='640' height='400' fill='white'/>\n";
  for (double share : {0.01, 0.1, 1.0, 10.0})
    out << fmt::format(
        "<path d='M70 {0:.0f} H570' stroke='#ddd'/><text x='62' y='{1:.0f}' text-anchor='end'>{2:g}</text>\n", y(share),
        y(share) + 4, share);
  for (double rtt : {0.0, 50.0, 100.0, 200.0})
    out << fmt::format("<text x='{:.0f}' y='350' text-anchor='middle'>{:g}</text>\n", x(rtt), rtt);
  out << "<text x='320' y='375' text-anchor='middle'>round trip [ms]</text>\n"
      << fmt::format("<text x='70' y='24'>force error (rms) over the truth's own variation, {:g} kHz ticks</text>\n",
                     1e-3 * tick_hz);
  const std::array<std::pair<const char*, const char*>, 3> lines{
      {{"held", "#b0413e"}, {"linear", "#3b6ea5"}, {"tiles", "#3a7d44"}}};
  for (const auto& [rung, colour] : lines) {
    std::map<double, std::pair<double, int>> mean;
    for (const json& row : rows) {
      if (row["rung"] != rung || row["tick_hz"] != tick_hz || row["loss"] != 0) continue;
      auto& [sum, count] = mean[row["rtt_ms"]];
      sum += row["force_rmse_share"].get<double>(), ++count;
    }
    std::string path_d;
    double at_x = 0, at_y = 0;
    for (const auto& [rtt, sum] : mean) {
      at_x = x(rtt), at_y = y(sum.first / sum.second);
      path_d += fmt::format("{}{:.1f} {:.1f} ", path_d.empty() ? "M" : "L", at_x, at_y);
    }
    out << fmt::format(
        "<path d='{0}' fill='none' stroke='{1}' stroke-width='2'/><text x='{2:.0f}' y='{3:.0f}' "
        "fill='{1}'>{4}</text>\n",
        path_d, colour, at_x + 8, at_y + 4, rung);
  }
  out << "</svg>\n";
}

struct Options {
  bool as_json = false, is_quick = false;
  std::string plot_path;
};

void run(const Options& options) {
  const std::vector<double> rates = options.is_quick ? std::vector{1000.0} : std::vector{1000.0, 2000.0, 5000.0};
  std::vector<Link> links{{0, 0, 0}, {100, 0, 0}, {200, 0, 0}};
  if (!options.is_quick) links = {{0, 0, 0}, {10, 0, 0}, {50, 0, 0}, {100, 0, 0}, {200, 0, 0}};
  links.push_back({100, 10, 0.02});
  const double seconds = options.is_quick ? 0.4 : 1.5;
  json rows = json::array();
  fmt::print("{:8} {:>7} {:>6} {:>6} {:>5} {:14} {:>8} {:>8} {:>7} {:>7} {:>7}\n", "rung", "tick Hz", "rtt ms",
             "jitter", "loss", "scene", "force", "torque", "kB/s", "step N", "tiles");
  for (const auto& scene : scenes(options.is_quick)) {
    for (const Rung rung : {Rung::kHeldWrench, Rung::kLinear, Rung::kTiles}) {
      for (const double tick_hz : rates) {
        for (const Link& link : links) {
          const Row r = replay(*scene, rung, tick_hz, link, 0.1, seconds);
          fmt::print("{:8} {:7.0f} {:6.0f} {:6.0f} {:5.2f} {:14} {:8.3f} {:8.3f} {:7.1f} {:7.3f} {:7.2f}\n",
                     name_of(rung), tick_hz, link.rtt_ms, link.jitter_ms, link.loss, scene->name, r.force_share,
                     r.torque_share, r.kB_s, r.step_N, r.tiles_share);
          rows.push_back({{"rung", name_of(rung)},
                          {"tick_hz", tick_hz},
                          {"rtt_ms", link.rtt_ms},
                          {"jitter_ms", link.jitter_ms},
                          {"loss", link.loss},
                          {"scene", scene->name},
                          {"force_rmse_share", r.force_share},
                          {"torque_rmse_share", r.torque_share},
                          {"step_N", r.step_N},
                          {"kB_s", r.kB_s},
                          {"tiles_share", r.tiles_share}});
        }
      }
    }
  }
  const json seven = time_seven_contacts(options.is_quick);
  if (!options.plot_path.empty()) plot(rows, options.plot_path, rates.back());
  if (options.as_json) fmt::print("{}\n", json{{"rows", rows}, {"tick_us", {{"seven_contacts", seven}}}}.dump());
}

}  // namespace

void add_loop(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app =
      bench.add_subcommand("loop", "How true each rung of the local model is, over rates, delays, jitter and loss");
  app->add_flag("--quick", options->is_quick, "Fewer rates, delays and scenes, shorter strokes");
  app->add_option("--plot", options->plot_path, "Write an SVG of error against delay there");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
