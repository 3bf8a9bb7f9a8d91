// The source's Figures 75 to 77 again: a tool pulled over ridges, ridged blocks that interlock, and time a frame.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "slave_sim/bake/asset_cache.h"
#include "tests/bench/bench.h"
#include "tests/bench/figure_runs.h"
#include "tests/bench/recorded_motion.h"
#include "tests/bench/svg.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

struct Options {
  std::string out = "out/figures";
  std::size_t stroke_frames = 1500, twist_frames = 6000, timed_frames = 500;
  bool as_json = false;
};

codecs::Asset asset_named(const char* name) {
  auto asset = slave_sim::cached_model_asset(name);
  if (!asset) throw CLI::RuntimeError(asset.error().message, 1);
  return std::move(*asset);
}

struct Curve {
  std::string name;
  std::vector<double> y;
};

/// Curves over one abscissa as comma-separated values and as a picture, each curve in a band of its own.
void write(const std::filesystem::path& stem, const std::string& title, const std::string& x_name,
           const std::vector<double>& x, const std::vector<Curve>& curves) {
  std::ofstream csv(stem.string() + ".csv");
  csv << x_name;
  for (const Curve& curve : curves) csv << ',' << curve.name;
  csv << '\n';
  for (std::size_t i = 0; i < x.size(); ++i) {
    csv << fmt::format("{:.9g}", x[i]);
    for (const Curve& curve : curves) csv << fmt::format(",{:.9g}", curve.y[i]);
    csv << '\n';
  }

  constexpr int kWidth = 820, kBand = 150, kLeft = 90, kTop = 34;
  const int height = kTop + kBand * static_cast<int>(curves.size()) + 30;
  Svg svg(stem.string() + ".svg", {kWidth, height});
  svg.words({kLeft, 20}, title, {.size_px = 15});
  const auto [x_low, x_high] = std::minmax_element(x.begin(), x.end());
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const Curve& curve = curves[c];
    const auto [low, high] = std::minmax_element(curve.y.begin(), curve.y.end());
    const double span = std::max(*high - *low, 1e-12), top = kTop + kBand * static_cast<double>(c);
    svg.box({kLeft, top}, {kWidth - kLeft - 20, kBand - 20}, {.colour = "#ccc"});
    svg.words({kLeft + 6, top + 14}, curve.name);
    svg.words({kLeft - 6, top + 10}, fmt::format("{:.3g}", *high), {.anchor = "end"});
    svg.words({kLeft - 6, top + kBand - 22}, fmt::format("{:.3g}", *low), {.anchor = "end"});
    std::vector<glm::dvec2> points;
    const std::size_t stride = std::max<std::size_t>(1, x.size() / 1500);
    for (std::size_t i = 0; i < x.size(); i += stride) {
      points.emplace_back(kLeft + (kWidth - kLeft - 20) * (x[i] - *x_low) / std::max(*x_high - *x_low, 1e-12),
                          top + (kBand - 20) * (1 - (curve.y[i] - *low) / span));
    }
    svg.curve(points, {.colour = "#1f5fa8", .width_px = 1.2});
  }
  svg.words({kWidth - 20, height - 12}, fmt::format("{} {:.3g} to {:.3g}", x_name, *x_low, *x_high), {.anchor = "end"});
}

template <typename Item, typename Value>
std::vector<double> column(const std::vector<Item>& items, Value value) {
  std::vector<double> out;
  for (const Item& item : items) out.push_back(value(item));
  return out;
}

json over_ridges(const Options& options) {
  const codecs::Asset block = asset_named("block"), gear = asset_named("gear");
  const Laid laid{.s = &block.felt,
                  .t = &gear.felt,
                  .R_WT = spatial::rotation_from_vector({std::numbers::pi / 2, 0, 0}),  // its axis along the ridges
                  .above_W = {-0.012, 0, 0.0805}};
  const auto strokes = stroke_over_ridges(laid, 0.0135, 3, options.stroke_frames);
  const StrokeFacts facts = facts_of(strokes);
  write(std::filesystem::path(options.out) / "figure-75-block-gear", "Gear pulled across the block's ridges", "hand_mm",
        column(strokes, [](const Stroke& s) { return 1e3 * s.hand_m; }),
        {{"tool_mm", column(strokes, [](const Stroke& s) { return 1e3 * s.tool_m; })},
         {"height_mm", column(strokes, [](const Stroke& s) { return 1e3 * s.height_m; })},
         {"force_across_N", column(strokes, [](const Stroke& s) { return s.across_N; })},
         {"force_along_N", column(strokes, [](const Stroke& s) { return s.along_N; })}});
  fmt::print(
      "block-gear, {} frames: force along the ridges {:.2f} % of that across, {} stairs, force and lag correlated "
      "{:.3f}\n",
      strokes.size(), 100 * facts.along_share, facts.stairs, facts.correlation);
  return {{"frames", strokes.size()},
          {"along_share", facts.along_share},
          {"stairs", facts.stairs},
          {"correlation", facts.correlation},
          {"passes", facts.along_share < 0.02 && facts.stairs >= 2 && facts.correlation >= 0.9}};
}

json interlocked(const Options& options) {
  const codecs::Asset block = asset_named("block");
  // Ridges of 6 mm: half a period aside, crests lie in valleys.
  const Laid laid{.s = &block.felt, .t = &block.felt, .R_WT = {1, 0, 0, 0}, .above_W = {3e-3, 0, 0.0390}};
  constexpr int kTwists = 12;
  const auto made = twist_interlocked(laid, 0.03, kTwists, 3, options.twist_frames);
  const TwistFacts facts = facts_of(made, kTwists);
  std::vector<double> frame(made.size());
  for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = static_cast<double>(i);
  write(std::filesystem::path(options.out) / "figure-76-block-block", "Interlocked blocks, the upper one twisted",
        "frame", frame,
        {{"angle_mrad", column(made, [](const Twist& t) { return 1e3 * t.angle_rad; })},
         {"rise_mm", column(made, [](const Twist& t) { return 1e3 * t.height_m; })},
         {"torque_mNm", column(made, [](const Twist& t) { return 1e3 * t.torque_Nm; })}});
  fmt::print("block-block, {} frames: {:.0f} % of {} twists lift the block, by {:.3f} mm; torque opposes {:.1f} %\n",
             made.size(), 100 * facts.rises, 2 * kTwists, 1e3 * facts.rise_m, 100 * facts.opposes);
  return {{"frames", made.size()},
          {"rises", facts.rises},
          {"opposes", facts.opposes},
          {"rise_m", facts.rise_m},
          {"passes", facts.rises > 0.99 && facts.opposes > 0.95}};
}

json timed(const Options& options) {
  const codecs::Asset cad = asset_named("cad"), file = asset_named("file");
  constexpr double kTolerance_m = 0.005;
  const geometry::Box box = geometry::bounding_box(cad.felt.coarse);
  MotionPlan plan{.region_low_m = box.centre() - 0.08 * box.size(),
                  .region_high_m = box.centre() + 0.08 * box.size(),
                  .X_ST_rest = {},
                  .turn_rad = 0.6,
                  .tilt_rad = 0.05};
  plan.region_high_m.z = box.high.z + 0.1;
  MotionBodies bodies(cad.felt, file.felt);
  const auto motion = recorded_motion(bodies, kTolerance_m, plan, 1, options.timed_frames);
  const contact_service::TouchableObject object{.felt = &cad.felt, .material = cad.material, .X_WO = {}};
  contact_service::ContactService service({&object, 1}, {.felt = &file.felt, .material = file.material, .X_WO = {}},
                                          {.tolerance_m = kTolerance_m});
  std::vector<double> frame, collision_us, texture_us, contacts;
  std::map<int, std::pair<double, int>> by_contacts;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const contact_service::Answer& set = service.answer({.sequence = static_cast<std::uint32_t>(i),
                                                         .time_ns = static_cast<std::int64_t>(i) * 1'000'000,
                                                         .X_WT = motion[i],
                                                         .V_WT_W = {}});
    const contact_service::StageTimes& times = set.times;
    frame.push_back(static_cast<double>(i));
    collision_us.push_back(times.proximity_us + times.clusters_us);
    texture_us.push_back(times.penetration_us + times.assembly_us);
    contacts.push_back(set.count);
    auto& [sum_us, count] = by_contacts[static_cast<int>(set.count)];
    sum_us += times.total_us, ++count;
  }
  write(std::filesystem::path(options.out) / "figure-77-file-cad", "File on CAD part: time a frame", "frame", frame,
        {{"collision_us", collision_us}, {"texture_us", texture_us}, {"contacts", contacts}});
  const auto mean = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  };
  json table = json::array();
  fmt::print("file-cad, {} frames: collision {:.0f} us (published: 2,000), texture {:.0f} us", motion.size(),
             mean(collision_us), mean(texture_us));
  for (const auto& [count, time] : by_contacts) {
    table.push_back({{"contacts", count}, {"frames", time.second}, {"mean_us", time.first / time.second}});
    fmt::print("; {} contacts {:.0f} us", count, time.first / time.second);
  }
  fmt::print("; published: 100 to 200 Hz, 5,000 to 10,000 us a frame\n");
  return {{"frames", motion.size()},        {"collision_us", mean(collision_us)},  {"texture_us", mean(texture_us)},
          {"published_collision_us", 2000}, {"published_frame_us", {5000, 10000}}, {"by_contacts", table}};
}

}  // namespace

void add_figures(CLI::App& bench) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = bench.add_subcommand("figures", "The source's experiments without friction, as CSV and SVG");
  command->add_option("--out", options->out, "Folder for the files");
  command->add_option("--stroke-frames", options->stroke_frames)->check(CLI::Range(100, 1'000'000));
  command->add_option("--twist-frames", options->twist_frames)->check(CLI::Range(100, 1'000'000));
  command->add_option("--timed-frames", options->timed_frames)->check(CLI::Range(10, 1'000'000));
  command->add_flag("--json", options->as_json, "One JSON object as the last line");
  command->callback([options] {
    std::error_code error;
    std::filesystem::create_directories(options->out, error);
    if (error) throw CLI::RuntimeError("cannot make the folder " + options->out + ": " + error.message(), 1);
    const json stroke = over_ridges(*options), twist = interlocked(*options), times = timed(*options);
    fmt::print("files are in {}\n", options->out);
    if (options->as_json)
      fmt::print("{}\n", json{{"block-gear", stroke}, {"block-block", twist}, {"file-cad", times}}.dump());
  });
}

}  // namespace farfeel::bench
