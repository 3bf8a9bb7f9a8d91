// farfeel-scene: says what a scene file describes, or what is wrong with it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

#include "codecs/settings/command_line.h"
#include "slave_sim/world/world.h"

namespace farfeel::slave_sim {
namespace {

std::string source_of(const AssetSource& source) {
  if (source.is_given()) return "given with --object";
  return source.model.empty() ? source.asset.string() : fmt::format("model {}", source.model);
}

/// Whether an asset file that a scene names is there; complains if not.
bool is_there(const AssetSource& source) {
  std::error_code error;
  if (source.asset.empty() || std::filesystem::is_regular_file(source.asset, error)) return true;
  fmt::print(stderr, "  missing    {}: bake it there, as in farfeel bake part.stl --unit mm -o {}\n",
             source.asset.string(), source.asset.string());
  return false;
}

bool check(const std::string& name_or_path, bool loads) {
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
  if (!loads || !is_complete) return is_complete;
  const auto world = load_world(*scene);
  if (!world) fmt::print(stderr, "{}\n", world.error().message);
  for (const std::string& note : world ? world->notes : std::vector<std::string>())
    fmt::print("  mind       {}\n", note);
  return world.has_value();
}

}  // namespace
}  // namespace farfeel::slave_sim

int main(int argc, char** argv) {
  using namespace farfeel::slave_sim;
  CLI::App app{"farfeel-scene: what scene files describe, and what is wrong with them.", "farfeel-scene"};
  app.require_subcommand(1);
  std::vector<std::string> scenes;
  bool loads = false;
  CLI::App* check_command = app.add_subcommand("check", "Read scene files; exit code 1 if any is wrong");
  check_command->add_option("SCENE", scenes, "scene.toml files or built-in scenes")->required();
  check_command->add_flag("--load", loads, "Load every asset too (benchmark models are baked if need be)");
  CLI::App* list_command = app.add_subcommand("list", "Name the built-in scenes");
  app.footer("Example:\n  farfeel scene check my-scene.toml");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  if (list_command->parsed()) fmt::print("{}\n", fmt::join(built_in_scene_names(), "\n"));
  bool all_good = true;
  for (const std::string& scene : scenes) all_good = check(scene, loads) && all_good;
  return all_good ? 0 : 1;
}
