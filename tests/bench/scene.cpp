// How soon a change of a living scene is felt and could be seen behind a link, whatever else the scene has; what a
// first touch waits for; and what objects that are far away cost an answer.
//
// An edit takes effect when the node is asked for it. It is felt in the first tick whose depth is another one, and is
// there to be seen once all its tiles are at the operator's end.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/tile_messages.h"
#include "tests/bench/bench.h"
#include "tests/bench/living_pair.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;
using support::quantile;
using transport::monotonic_ns;

constexpr double kTop_m = 0.020, kBall_m = 0.003, kPress_m = 0.2e-3;  // of the block's crest; the tool's; held so deep
constexpr double kPeriod_m = 0.006;                                   // of its crests
constexpr std::uint32_t kBlock = 1;                                   // its surface
constexpr std::size_t kMostObjects = codecs::kMaxSceneObjects;
constexpr double kDent_m = 0.1e-3;
constexpr double kOther_m = 1e-6;    // of depth: felt
constexpr double kGoalOver_ms = 10;  // beyond half a round trip, of edits of kGoalTexels at most
constexpr std::size_t kGoalTexels = 1000;
constexpr double kFirstTouchTrips = 3, kFirstTouchOver_ms = 200;
constexpr std::int64_t kPatience_ns = 10'000'000'000, kStill_ns = 150'000'000;
constexpr std::int64_t kResync_ns = 4'000'000'000;
constexpr int kResyncTrip_ms = 20;
constexpr std::size_t kAnswers = 400;

struct Options {
  int repeats = 5;
  bool is_quick = false, as_json = false;
};

struct Place {
  double x_m, y_m;
};

glm::dvec3 held_at(const Place& place) {
  return {place.x_m, place.y_m, kTop_m + kBall_m - kPress_m};
}

/// A dent of so many texels under the tool.
slave_sim::TimedEdit dent(const geometry::HapticSurface& surface, const Place& place, std::size_t texels) {
  const double across_m = surface.charts[0].texel_m * std::sqrt(static_cast<double>(texels) / std::numbers::pi);
  slave_sim::TimedEdit edit;
  edit.place_M = {place.x_m, place.y_m, kTop_m};
  edit.depth_m = kDent_m;
  edit.radius_m = (across_m * across_m + kDent_m * kDent_m) / (2 * kDent_m);
  return edit;
}

struct Felt {
  double felt_ms = 0, seen_ms = 0;
  std::vector<double> ages_ms, took_ms;  // of the ticks until both
};

/// Ticks until all heights are here and nothing changes any more.
double settled_depth_m(LivingPair& pair, const Place& place) {
  double depth_m = 0;
  std::int64_t since_ns = monotonic_ns();
  for (const std::int64_t until_ns = since_ns + kPatience_ns;;) {
    const LivingPair::Tick tick = pair.tick(held_at(place));
    if (!tick.is_whole || std::abs(tick.depth_m - depth_m) > 0.1 * kOther_m) since_ns = tick.at_ns;
    depth_m = tick.depth_m;
    if (tick.at_ns - since_ns > kStill_ns) return depth_m;
    if (tick.at_ns > until_ns) throw std::runtime_error("the heights under the tool did not come within 10 s");
  }
}

/// An edit of the block is asked for, and ticks go on until it is felt, and every tile that was here before and that it
/// changes is here anew.
Felt felt_edit(LivingPair& pair, const slave_sim::World& world, const Place& place, const slave_sim::TimedEdit& edit) {
  const double before_m = settled_depth_m(pair, place);
  const std::vector<geometry::HeightTile>& tiles = world.objects[0].asset.felt.tiles;
  std::vector<std::optional<std::uint32_t>> had;
  for (std::uint32_t i = 0; i < tiles.size(); ++i) had.push_back(pair.tiles().given({kBlock, i}));
  std::atomic<bool> is_made{false};
  std::string refusal;
  const std::int64_t asked_ns = monotonic_ns();
  const std::jthread node([&] {  // the living scene's thread: no tick waits for it
    if (const auto done = pair.living().edit(edit, &pair.slave()); !done) refusal = done.error();
    is_made = true;
  });
  const auto all_are_here = [&] {
    for (std::uint32_t i = 0; i < tiles.size(); ++i) {
      if (had[i] && *pair.tiles().given({kBlock, i}) < tiles[i].version) return false;
    }
    return true;
  };
  Felt felt;
  while (felt.felt_ms == 0 || felt.seen_ms == 0) {
    const LivingPair::Tick tick = pair.tick(held_at(place));
    const double since_ms = 1e-6 * static_cast<double>(tick.at_ns - asked_ns);
    if (since_ms > 1e-6 * static_cast<double>(kPatience_ns) || (is_made && !refusal.empty()))
      throw std::runtime_error(refusal.empty() ? "an edit was not felt within 10 s" : refusal);
    felt.ages_ms.push_back(tick.answer_age_ms), felt.took_ms.push_back(tick.took_ms);
    if (felt.felt_ms == 0 && std::abs(tick.depth_m - before_m) > kOther_m) felt.felt_ms = since_ms;
    if (felt.seen_ms == 0 && is_made && all_are_here()) felt.seen_ms = since_ms;
  }
  return felt;
}

struct Row {
  std::size_t texels;
  LivingSize size;
  int round_trip_ms;
};

json row_of(LivingPair& pair, slave_sim::World& world, const Row& row, const Options& options) {
  std::vector<double> felt_ms, seen_ms, ages_ms, took_ms;
  for (int n = 0; n < options.repeats; ++n) {
    // On crests; in the middle, where a dent is nearly as wide as the block.
    const Place place = row.texels > kGoalTexels
                            ? Place{0, 0}
                            : Place{kPeriod_m * static_cast<double>(n % 3 - 1), 0.004 * static_cast<double>(n / 3)};
    const Felt felt = felt_edit(pair, world, place, dent(world.objects[0].asset.felt, place, row.texels));
    felt_ms.push_back(felt.felt_ms), seen_ms.push_back(felt.seen_ms);
    ages_ms.insert(ages_ms.end(), felt.ages_ms.begin(), felt.ages_ms.end());
    took_ms.insert(took_ms.end(), felt.took_ms.begin(), felt.took_ms.end());
    (void)felt_edit(pair, world, place, {.kind = slave_sim::TimedEdit::Kind::kRevert});
  }
  const double goal_ms = 0.5 * row.round_trip_ms + kGoalOver_ms;
  const double felt_p50_ms = quantile(felt_ms, 0.5);
  const bool has_goal = row.texels <= kGoalTexels;
  fmt::print("{:7} {:9} {:7} {:5} {:8.1f} {:8.1f} {:8.1f} {:9.1f} {:9.3f}   {}\n", row.texels,
             row.size.visible_triangles, row.size.objects, row.round_trip_ms, felt_p50_ms, quantile(felt_ms, 1),
             quantile(seen_ms, 0.5), quantile(ages_ms, 0.99), quantile(took_ms, 0.99),
             !has_goal                ? "none"
             : felt_p50_ms <= goal_ms ? fmt::format("{:.0f} met", goal_ms)
                                      : fmt::format("{:.0f} MISSED", goal_ms));
  std::fflush(stdout);
  return {{"edit_vertices", row.texels},
          {"scene_triangles", row.size.visible_triangles},
          {"objects", row.size.objects},
          {"rtt_ms", row.round_trip_ms},
          {"felt_ms", felt_p50_ms},
          {"felt_most_ms", quantile(felt_ms, 1)},
          {"seen_ms", quantile(seen_ms, 0.5)},
          {"haptic_p99_ms", quantile(ages_ms, 0.99)},
          {"tick_p99_ms", quantile(took_ms, 0.99)},
          {"goal_ms", has_goal ? json(goal_ms) : json()}};
}

std::size_t bytes_of(const geometry::HapticSurface& surface, std::uint32_t tile) {
  std::size_t bytes = 0;
  for (const auto& part : codecs::encoded_tile(tile, surface.tiles[tile], codecs::nearness(surface)))
    bytes += codecs::kTileHeadBytes + part.size();
  return bytes;
}

/// The node is started anew, after an edit or without one, and the master goes on with what it holds.
json resync(LivingPair& pair, const slave_sim::World& world, const slave_sim::World& beginning, std::size_t texels) {
  const Place place{0, 0.008};
  const auto stay = [&] {  // until what lies around has come, too
    for (const std::int64_t end_ns = monotonic_ns() + kResync_ns; monotonic_ns() < end_ns;)
      (void)pair.tick(held_at(place));
  };
  stay();
  const double before_m = settled_depth_m(pair, place);
  const geometry::HapticSurface& surface = world.objects[0].asset.felt;
  const std::vector<geometry::HeightTile> had = surface.tiles;
  std::size_t held_bytes = 0, differing_bytes = 0;
  for (std::uint32_t i = 0; i < had.size(); ++i)
    held_bytes += pair.tiles().given({kBlock, i}) ? bytes_of(surface, i) : 0;
  for (std::uint32_t i = 0; i < world.tool.felt.tiles.size(); ++i)
    held_bytes += pair.tiles().given({contact_service::kToolSurface, i}) ? bytes_of(world.tool.felt, i) : 0;
  if (texels > 0)
    if (const auto done = pair.living().edit(dent(surface, place, texels), nullptr); !done)
      throw std::runtime_error(done.error());
  for (std::uint32_t i = 0; i < had.size(); ++i) {
    if (pair.tiles().given({kBlock, i}) && surface.tiles[i].version != had[i].version)
      differing_bytes += bytes_of(surface, i);
  }
  const std::uint64_t bytes_before = pair.report().tile_bytes;
  pair.start_slave_anew(beginning);
  stay();
  const double now_m = settled_depth_m(pair, place);
  const std::uint64_t bytes = pair.report().tile_bytes - bytes_before;
  if ((std::abs(now_m - before_m) > kOther_m) != (texels > 0))
    throw std::runtime_error("after the node was started anew another surface is felt than it has");
  const double most = 1.2 * static_cast<double>(differing_bytes) + 4096;
  fmt::print(
      "node started anew, {:5} texels changed meanwhile: {:7} bytes of tiles came, {:7} differ, {:7} were held: {}\n",
      texels, bytes, differing_bytes, held_bytes,
      static_cast<double>(bytes) <= most ? "met" : fmt::format("MISSED (goal {:.0f})", most));
  return {
      {"edit_vertices", texels}, {"bytes", bytes}, {"differing_bytes", differing_bytes}, {"held_bytes", held_bytes}};
}

transport::LinkSpec link_of(int round_trip_ms) {
  transport::LinkSpec link;
  link.round_trip_ns = std::int64_t{1'000'000} * round_trip_ms;
  link.rate_bit_per_s = 20e6;
  return link;
}

/// Microseconds of this thread that an answer takes, with the tool on the block.
double answer_us(contact_service::ContactService& service) {
  std::vector<double> us;
  contact_service::ToolPose pose;
  for (std::size_t n = 0; n < kAnswers; ++n) {
    pose.sequence = static_cast<std::uint32_t>(n), pose.time_ns = 1'000'000 * static_cast<std::int64_t>(n);
    pose.X_WT.p = held_at({1e-5 * static_cast<double>(n % 100), 0});
    timespec before{}, after{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before);
    (void)service.answer(pose);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after);
    us.push_back(1e6 * static_cast<double>(after.tv_sec - before.tv_sec) +
                 1e-3 * static_cast<double>(after.tv_nsec - before.tv_nsec));
  }
  return quantile(us, 0.5);
}

/// Answers with many far objects beside answers with one, interleaved.
json far_objects(std::size_t objects) {
  const slave_sim::World one = living_world({}), many = living_world({.objects = objects});
  const slave_sim::Touch touch_one(one), touch_many(many);
  contact_service::ContactService service_one(touch_one.objects(), touch_one.tool(), {}),
      service_many(touch_many.objects(), touch_many.tool(), {});
  std::vector<double> of_one, of_many;
  for (int n = 0; n < 5; ++n) of_one.push_back(answer_us(service_one)), of_many.push_back(answer_us(service_many));
  const double ratio = quantile(of_many, 0.5) / quantile(of_one, 0.5);
  fmt::print("an answer with {} far objects: {:.1f} us, with none {:.1f} us: {:.3f} of it (goal 1.1)\n", objects - 1,
             quantile(of_many, 0.5), quantile(of_one, 0.5), ratio);
  return {{"objects", objects}, {"answer_us", quantile(of_many, 0.5)}, {"answer_us_of_one", quantile(of_one, 0.5)}};
}

void run(const Options& options) {
  const std::vector<std::size_t> edits =
      options.is_quick ? std::vector<std::size_t>{1000} : std::vector<std::size_t>{10, 100, 1000, 10000};
  std::vector<LivingSize> sizes{{1, 1000}, {1, 65'000}, {1, 1'000'000}, {100, 65'000}, {kMostObjects, 65'000}};
  if (options.is_quick) sizes = {{1, 1000}};
  json rows = json::array(), touches = json::array(), resyncs = json::array();
  fmt::print(
      "felt: an edit that is asked for at the node, to the first tick that feels it; seen: until its tiles are here.\n"
      "20 Mbit/s; medians of {}; the age of what the node told of contacts, and what a tick took, until then\n"
      "{:>7} {:>9} {:>7} {:>5} {:>8} {:>8} {:>8} {:>9} {:>9}   {}\n",
      options.repeats, "texels", "triangles", "objects", "rtt", "felt ms", "most", "seen ms", "age p99", "tick p99",
      "goal");
  for (const LivingSize& asked : sizes) {
    for (const int round_trip_ms : {20, 100}) {
      slave_sim::World world = living_world(asked);
      LivingSize size = asked;
      size.visible_triangles = world.objects[0].asset.visible.triangles.size();
      const bool is_for_resync = &asked == &sizes.front() && round_trip_ms == kResyncTrip_ms;
      const slave_sim::World beginning = is_for_resync ? world : slave_sim::World{};
      LivingPair pair(world, link_of(round_trip_ms));
      const double goal_ms = kFirstTouchTrips * round_trip_ms + kFirstTouchOver_ms;
      touches.push_back({{"objects", size.objects},
                         {"scene_triangles", size.visible_triangles},
                         {"rtt_ms", round_trip_ms},
                         {"scene_bytes", pair.scene_bytes()},
                         {"first_touch_ms", pair.first_touch_ms()},
                         {"goal_ms", size.objects == 100 ? json(goal_ms) : json()}});
      for (const std::size_t texels : edits) {
        try {
          rows.push_back(row_of(pair, world, {texels, size, round_trip_ms}, options));
        } catch (const std::runtime_error& why) {
          fmt::print("{:7} {:9} {:7} {:5}  none: {}\n", texels, size.visible_triangles, size.objects, round_trip_ms,
                     why.what());
          rows.push_back({{"edit_vertices", texels}, {"objects", size.objects}, {"refused", why.what()}});
        }
      }
      if (!is_for_resync) continue;
      for (const std::size_t texels : {std::size_t{0}, std::size_t{1000}, std::size_t{10000}})
        resyncs.push_back(resync(pair, world, beginning, texels));
    }
  }
  fmt::print("      -         -    1000     -  refused: a scene has at most {} objects\n", codecs::kMaxSceneObjects);
  fmt::print("\nfirst touch: from the first datagram until the whole scene can be felt by its outline\n");
  for (const json& touch : touches) {
    fmt::print("{:4} objects, {:8} triangles, rtt {:3} ms: {:6.0f} ms, {:8.1f} kB{}\n", touch["objects"].get<int>(),
               touch["scene_triangles"].get<int>(), touch["rtt_ms"].get<int>(), touch["first_touch_ms"].get<double>(),
               1e-3 * touch["scene_bytes"].get<double>(),
               touch["goal_ms"].is_null() ? "" : fmt::format(" (goal {:.0f} ms)", touch["goal_ms"].get<double>()));
  }
  const json far = far_objects(options.is_quick ? 20 : kMostObjects);
  if (options.as_json)
    fmt::print("{}\n",
               json{{"scene", {{"rows", rows}, {"first_touch", touches}, {"resync", resyncs}, {"far", far}}}}.dump());
}

}  // namespace

void add_scene(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand(
      "scene", "How soon an edit of a living scene is felt behind a link, and what far objects cost");
  app->add_option("--repeats", options->repeats, "Edits a row")->check(CLI::Range(1, 6))->capture_default_str();
  app->add_flag("--quick", options->is_quick, "One row for each round trip");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
