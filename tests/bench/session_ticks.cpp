// What the ticks of a recorded session cost: the tool goes where session.csv says it went, the remote answers at once,
// and only the operator's work is timed, in the thread's own time: the look at the tiles, or on the other rungs what
// the local model makes of an answer in every tick. So two builds are compared on the very same ticks, whatever else
// the machine does.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "codecs/felt/felt_outline.h"
#include "haptic_core/local_model/local_contacts.h"
#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/rigid_tool.h"
#include "master_station/session/tile_receiver.h"
#include "slave_sim/session/tile_feed.h"
#include "slave_sim/world/world.h"
#include "tests/bench/bench.h"
#include "transport/lane/lane_keys.h"

namespace farfeel::bench {
namespace {

using contact_service::ContactService;
using contact_service::StageTimes;
using contact_service::ToolPose;
using contact_service::TouchableObject;

struct Options {
  std::string csv, scene = "file-cad";
  local_model::Rung rung = local_model::Rung::kTiles;
  bool is_compared = false, as_json = false;
};

/// The tool's poses, as the file's columns name them; velocities from one to the next.
std::vector<ToolPose> recorded_poses(const std::string& path) {
  std::ifstream file(path);
  std::string line, name;
  if (!std::getline(file, line)) throw CLI::RuntimeError(path + " can't be read", 1);
  std::vector<std::string> names;
  for (std::istringstream row(line); std::getline(row, name, ',');) names.push_back(name);
  const auto column = [&](const char* wanted) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), wanted) - names.begin());
  };
  const std::size_t time = column("time_s"), tool = column("tool_x_m");
  if (std::max(time, tool + 6) >= names.size())
    throw CLI::RuntimeError(path + " has no columns time_s and tool_x_m, as a session.csv has", 1);
  std::vector<ToolPose> poses;
  while (std::getline(file, line)) {
    std::vector<double> cells;
    std::string cell;
    for (std::istringstream row(line); std::getline(row, cell, ',');)
      cells.push_back(std::strtod(cell.c_str(), nullptr));
    if (cells.size() <= tool + 6) continue;
    const double* x = &cells[tool];
    ToolPose pose;
    pose.sequence = static_cast<std::uint32_t>(poses.size()), pose.time_ns = std::llround(1e9 * cells[time]);
    pose.X_WT = {glm::normalize(glm::dquat{x[3], x[4], x[5], x[6]}), {x[0], x[1], x[2]}};
    if (!poses.empty()) {
      const ToolPose& last = poses.back();
      const double dt_s = std::max(1e-9 * static_cast<double>(pose.time_ns - last.time_ns), 1e-6);
      pose.V_WT_W = {spatial::vector_from_rotation(glm::normalize(pose.X_WT.R * glm::conjugate(last.X_WT.R))) / dt_s,
                     (pose.X_WT.p - last.X_WT.p) / dt_s};
    }
    poses.push_back(pose);
  }
  return poses;
}

struct Look {
  double us = 0;
  std::uint32_t contacts = 0, pressing = 0;
  double off_N = 0, off_Nm = 0;  ///< from what the remote's own search of all contacts says
  double push_N = 0;
  std::uint64_t print = 0;  ///< of every bit that was answered
  StageTimes stages;
};

/// FNV-1a.
void add_print(std::uint64_t& print, const double* numbers, std::size_t count) {
  for (const std::byte byte : std::as_bytes(std::span(numbers, count)))
    print = (print ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001B3u;
}

double thread_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

/// Of springs alone.
spatial::Vector6 springs_To_W(const contact::ContactSet& set) {
  spatial::Vector6 sum = spatial::Vector6::Zero();
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    if (c.depth_m > 0) sum -= c.material.stiffness_N_per_m * c.depth_m * c.gradient;
  }
  return sum;
}

/// From one recorded pose to the next.
tool::StepWork step_to(const ToolPose& next, double dt_s) {
  const spatial::Vector6 V = spatial::to_vector6(next.V_WT_W);
  return {.V_moved = V, .V_change = spatial::Vector6::Zero(), .share = dt_s > 0 ? 1.0 : 0.0, .kinetic_J = 0};
}

std::vector<Look> of_local_model(const std::vector<ToolPose>& poses, ContactService& remote, local_model::Rung rung) {
  local_model::LocalModelSettings settings;
  settings.rung = rung;
  local_model::LocalModel model(settings);
  std::vector<Look> looks;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const ToolPose &pose = poses[i], &next = poses[i + 1];
    const double dt_s = 1e-9 * static_cast<double>(next.time_ns - pose.time_ns);
    ToolPose asked = pose;
    asked.wants_curvature = rung == local_model::Rung::kQuadratic;
    const contact::ContactSet& answer = remote.answer(asked);
    const double began_us = thread_us();
    model.advance(dt_s, pose.X_WT);
    model.update(answer, pose.X_WT);
    const local_model::Felt felt = model.evaluate(pose.X_WT, pose.V_WT_W, dt_s);
    const tool::StepWork step = step_to(next, dt_s);
    model.settle(tool::applied_wrench(felt.response, step, dt_s), step.V_moved, dt_s, next.X_WT);
    Look look;
    look.us = thread_us() - began_us, look.contacts = answer.count, look.pressing = felt.pressing;
    look.push_N = glm::length(spatial::wrench_from(felt.response.F_To_W).force_N);
    add_print(look.print, felt.response.F_To_W.data(), 6);
    add_print(look.print, felt.response.by_pose.data(), 36), add_print(look.print, felt.response.by_twist.data(), 36);
    looks.push_back(look);
  }
  return looks;
}

std::vector<Look> replayed(const Options& options) {
  const std::vector<ToolPose> poses = recorded_poses(options.csv);
  auto definition = slave_sim::wished_scene({.scene = options.scene});
  if (!definition) throw CLI::RuntimeError(definition.error().message, 1);
  auto world = slave_sim::load_world(*std::move(definition));
  if (!world) throw CLI::RuntimeError(world.error().message, 1);
  std::vector<std::unique_ptr<penetration::FeltSurface>> felt;
  const auto touchable = [&](const codecs::Asset& asset, const spatial::Pose& X_WO) {
    felt.push_back(std::make_unique<penetration::FeltSurface>(asset.felt));
    return TouchableObject{&asset.felt, asset.material, X_WO, felt.back().get()};
  };
  std::vector<TouchableObject> bodies{touchable(world->tool, {})};
  for (const slave_sim::WorldObject& object : world->objects) bodies.push_back(touchable(object.asset, object.X_WO));
  const std::span<const TouchableObject> objects = std::span(bodies).subspan(1);
  const contact_service::ContactOptions felt_options{.tolerance_m = world->definition.tolerance_m,
                                                     .grid_samples = world->definition.grid_samples,
                                                     .soft_width_m = world->definition.softness_m,
                                                     .most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m};
  ContactService remote(objects, bodies[0], felt_options);
  if (options.rung != local_model::Rung::kTiles) return of_local_model(poses, remote, options.rung);
  local_model::TileCache cache(
      codecs::read_felt_outline(codecs::write_felt_outline(bodies, felt_options).value()).value());
  local_model::LocalContacts contacts(cache);
  master_station::TileReceiver receiver(cache);
  ContactService truth(objects, bodies[0], felt_options);
  slave_sim::TileFeed feed(objects, bodies[0], felt_options);

  std::vector<Look> looks;
  std::array<std::byte, codecs::kTileRequestBytes> request;
  (void)codecs::write(codecs::TileRequest{1}, request);
  feed.on_request(request);
  transport::MessageBuffer part;
  const contact_service::Answer* answered = nullptr;
  for (const ToolPose& pose : poses) {
    if (pose.sequence % 2 == 0) answered = &remote.answer(pose), contacts.hear(*answered);
    feed.aim(answered ? answered->at_proxy(pose) : pose, answered ? answered->times.widest_m : 0, 0, pose.time_ns);
    while (feed.urgency(pose.time_ns)) {
      if (const auto tile = feed.next(part, pose.time_ns)) receiver.on_tile(std::span(part).first(tile->bytes));
    }
    receiver.put_waiting();
    const double began_us = thread_us();
    const local_model::TickContacts& here = contacts.at(pose);
    Look look;
    look.us = thread_us() - began_us, look.contacts = here.set.count;
    look.stages = contacts.last_times();
    for (const contact::Contact& contact : std::span(here.set.contacts).first(here.set.count)) {
      look.pressing += contact.depth_m > 0;
      add_print(look.print, &contact.depth_m, 1), add_print(look.print, contact.gradient.data(), 6);
      add_print(look.print, &contact.p_WC_W.x, 3), add_print(look.print, &contact.nhat_ST_W.x, 3);
    }
    const spatial::Wrench felt_W = spatial::wrench_from(springs_To_W(here.set));
    look.push_N = glm::length(felt_W.force_N);
    if (options.is_compared && here.lacking == 0) {
      const spatial::Wrench true_W = spatial::wrench_from(springs_To_W(truth.answer(pose)));
      look.off_N = glm::distance(felt_W.force_N, true_W.force_N);
      look.off_Nm = glm::distance(felt_W.torque_Nm, true_W.torque_Nm);
    }
    looks.push_back(look);
  }
  return looks;
}

/// They are wall-clock time: a mean would be of whatever else the machine does.
double p50_of(const std::vector<Look>& looks, double StageTimes::*stage) {
  std::vector<double> us;
  for (const Look& look : looks) us.push_back(look.stages.*stage);
  std::nth_element(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(us.size() / 2), us.end());
  return us[us.size() / 2];
}

void run(const Options& options) {
  const std::vector<Look> looks = replayed(options);
  std::vector<double> us;
  std::uint64_t print = 0xCBF29CE484222325u;
  double push2 = 0, off2 = 0, turn2 = 0, most_N = 0, contacts = 0, pressing = 0;
  for (const Look& look : looks) {
    us.push_back(look.us);
    print = (print ^ look.print) * 0x100000001B3u;
    contacts += look.contacts, pressing += look.pressing;
    push2 += look.push_N * look.push_N, off2 += look.off_N * look.off_N, turn2 += look.off_Nm * look.off_Nm;
    most_N = std::max(most_N, look.off_N);
  }
  if (us.empty()) return;
  std::sort(us.begin(), us.end());
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  const auto n = static_cast<double>(us.size());
  fmt::print("{} ticks, {:.2f} contacts near and {:.2f} that press on average\n", us.size(), contacts / n,
             pressing / n);
  const bool are_tiles = options.rung == local_model::Rung::kTiles;
  fmt::print("{}: p50 {:.1f}, p90 {:.1f}, p99 {:.1f}, p99.9 {:.1f}, max {:.0f} us\n",
             are_tiles ? "looks at the tiles" : "local model, an answer every tick", at(0.5), at(0.9), at(0.99),
             at(0.999), us.back());
  if (are_tiles)
    fmt::print("of which p50: proximity {:.1f}, clusters {:.1f}, penetration {:.1f}, assembly {:.1f} us\n",
               p50_of(looks, &StageTimes::proximity_us), p50_of(looks, &StageTimes::clusters_us),
               p50_of(looks, &StageTimes::penetration_us), p50_of(looks, &StageTimes::assembly_us));
  fmt::print("answers' fingerprint {:016x}: two builds with the same one answered the same to the last bit\n", print);
  if (options.is_compared)
    fmt::print("springs: {:.3f} N rms, off the remote's by {:.4f} N and {:.3f} mNm rms, at most {:.2f} N\n",
               std::sqrt(push2 / n), std::sqrt(off2 / n), 1e3 * std::sqrt(turn2 / n), most_N);
  if (options.as_json)
    fmt::print("{}\n", nlohmann::json{{"ticks", us.size()},
                                      {"contacts", contacts / n},
                                      {"pressing", pressing / n},
                                      {"fingerprint", fmt::format("{:016x}", print)},
                                      {"p50_us", at(0.5)},
                                      {"p99_us", at(0.99)},
                                      {"p99_9_us", at(0.999)},
                                      {"off_rms_N", std::sqrt(off2 / n)}}
                           .dump());
}

}  // namespace

void add_session(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app =
      bench.add_subcommand("session", "What the ticks of a recorded session cost: two builds on the very same ticks");
  app->add_option("csv", options->csv, "session.csv of a session, as farfeel loopback leaves it")->required();
  app->add_option("--scene", options->scene, "The scene that it was of")->capture_default_str();
  app->add_option("--rung", options->rung, "How contacts are felt")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, local_model::Rung>{{"linear", local_model::Rung::kLinear},
                                                                           {"quadratic", local_model::Rung::kQuadratic},
                                                                           {"tiles", local_model::Rung::kTiles}}))
      ->default_str("tiles");
  app->add_flag("--compare", options->is_compared, "Also how far off the remote's own search of all contacts they are");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
