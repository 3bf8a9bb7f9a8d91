// farfeel-scene: says what a scene file describes, or what is wrong with it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "codecs/settings/command_line.h"
#include "slave_sim/world/world.h"

namespace farfeel::slave_sim {
namespace {

std::string source_of(const AssetSource& source) {
  if (source.is_given()) return "given with --object";
  return source.model.empty() ? source.asset.string() : fmt::format("model {}", source.model);
}

/// Nothing to load it with: whoever starts a slave names the object.
bool needs_an_object(const SceneDefinition& scene) {
  return std::any_of(scene.objects.begin(), scene.objects.end(),
                     [](const ObjectDefinition& object) { return object.source.is_given(); });
}

/// Whether an asset file that a scene names is there; complains if not.
bool is_there(const AssetSource& source) {
  std::error_code error;
  if (source.asset.empty() || std::filesystem::is_regular_file(source.asset, error)) return true;
  fmt::print(stderr, "  missing    {}: bake it there, as in farfeel bake part.stl --unit mm -o {}\n",
             source.asset.string(), source.asset.string());
  return false;
}

/// Ends this program, with words, if it still lives after so long: loading cannot be broken off.
class Patience {
 public:
  explicit Patience(double seconds)
      : thread_([seconds](const std::stop_token& is_over) {
          std::mutex mutex;
          std::condition_variable_any never;
          std::unique_lock lock(mutex);
          never.wait_for(lock, is_over, std::chrono::duration<double>(seconds), [] { return false; });
          if (is_over.stop_requested()) return;
          fmt::print(
              stderr,
              "  load       not done after {:g} s, and a slave's start takes longer still: take fewer objects or "
              "coarser assets, or wait for longer with --load-within\n",
              seconds);
          std::_Exit(1);
        }) {}

 private:
  std::jthread thread_;
};

/// Loads what the scene names, as a slave does, and says how long that takes.
bool loads(const SceneDefinition& scene, double within_s) {
  std::fflush(stdout);
  const auto begun = std::chrono::steady_clock::now();
  tl::expected<World, SceneError> world = [&] {
    const Patience patience(within_s);
    return load_world(scene);
  }();
  if (!world) {
    fmt::print(stderr, "{}\n", world.error().message);
    return false;
  }
  for (const std::string& note : world->notes) fmt::print("  mind       {}\n", note);
  std::size_t pieces = world->tool.felt.piece_count;
  for (const WorldObject& object : world->objects) pieces += object.asset.felt.piece_count;
  fmt::print(
      "  load       {:.1f} s for {} objects of {} convex pieces; a slave's start takes that, and what it needs to "
      "make them ready\n",
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(), world->objects.size(), pieces);
  return true;
}

bool check(const std::string& name_or_path, double load_within_s) {
  const auto scene = find_scene(name_or_path);
  if (!scene) {
    fmt::print(stderr, "{}\n", scene.error().message);
    return false;
  }
  fmt::print("{}: {}\n", scene->name, scene->title);
  fmt::print("  tool       {}\n", source_of(scene->tool));
  for (const ObjectDefinition& object : scene->objects) {
    fmt::print("  object     {} ({})\n", object.name, source_of(object.source));
  }
  fmt::print("  tolerance  {:g} mm; grid {}; soft maximum {:g} um wide\n", scene->tolerance_m * 1e3,
             scene->grid_samples, scene->softness_m * 1e6);
  fmt::print(
      "  scales     {:g} m of the tool for a metre of the hand, {:g} N on the hand for a newton on the tool; {}\n",
      scene->workspace_scale, scene->force_scale, scene->has_clutch ? "clutch" : "no clutch");
  fmt::print("  operator   {}\n", scene->exploration ? fmt::format("presses with {:g} N, strokes at {:g} mm/s",
                                                                   scene->exploration->press_force_N,
                                                                   scene->exploration->stroke_speed_m_per_s * 1e3)
                                                     : "finds a place to touch from above");
  bool is_complete = is_there(scene->tool);
  for (const ObjectDefinition& object : scene->objects) is_complete = is_there(object.source) && is_complete;
  return is_complete && (load_within_s == 0 || needs_an_object(*scene) || loads(*scene, load_within_s));
}

}  // namespace
}  // namespace farfeel::slave_sim

int main(int argc, char** argv) {
  using namespace farfeel::slave_sim;
  CLI::App app{"farfeel-scene: what scene files describe, and what is wrong with them.", "farfeel-scene"};
  app.require_subcommand(1);
  std::vector<std::string> scenes;
  bool was_told_to_load = false;
  double load_within_s = 60;
  CLI::App* check_command = app.add_subcommand("check", "Read scene files; exit code 1 if any is wrong");
  check_command->add_option("SCENE", scenes, "scene.toml files or built-in scenes")->required();
  check_command
      ->add_option("--load-within", load_within_s,
                   "Load every asset, too (benchmark models are baked if need be), and call it wrong if that takes "
                   "longer [s]; 0 loads none")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  check_command->add_flag("--load", was_told_to_load, "Older name of what is always done now")->configurable(false);
  CLI::App* list_command = app.add_subcommand("list", "Name the built-in scenes");
  // farfeel leads these to a program that speaks with a slave; here they are named, so that help and complaints know
  // them.
  app.add_subcommand("edit", "Change the scene of a slave that runs");
  app.add_subcommand("watch", "Tell the objects of a slave that runs, and each change");
  app.add_subcommand("save", "Write the scene of a slave that runs into a folder");
  app.footer("Example:\n  farfeel scene check my-scene.toml");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  if (!list_command->parsed() && !check_command->parsed()) {
    fmt::print(stderr, "farfeel-scene: this is for farfeel-edit: farfeel scene {}\n",
               app.get_subcommands().front()->get_name());
    return farfeel::codecs::kUsageError;
  }
  if (list_command->parsed()) fmt::print("{}\n", fmt::join(built_in_scene_names(), "\n"));
  if (was_told_to_load) fmt::print(stderr, "farfeel-scene: assets are always loaded now; leave --load out\n");
  bool all_good = true;
  for (const std::string& scene : scenes) all_good = check(scene, load_within_s) && all_good;
  return all_good ? 0 : 1;
}
