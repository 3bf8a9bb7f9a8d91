#include "slave_sim/confinement/confinement.h"

#include <fmt/format.h>
#include <glob.h>

#include <cstdlib>

#include "haptic_core/headless_gl/headless_context.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/depths/chosen_depths.h"
#include "transport/confine/calls.h"
#include "transport/confine/files.h"
#include "transport/confine/privileges.h"

namespace farfeel::slave_sim {
namespace {

using transport::FileRights;

void add_asset(FileRights& rights, const AssetSource& source) {
  if (!source.asset.empty()) rights.read.push_back(source.asset.string());
}

bool has_models(const SceneDefinition& scene) {
  bool has = !scene.tool.model.empty();
  for (const ObjectDefinition& object : scene.objects) has = has || !object.source.model.empty();
  return has;
}

/// What drivers of graphics devices open: their devices, and the folders where they keep compiled shaders.
void add_driver(FileRights& rights) {
  rights.read.emplace_back("/");
  for (const char* path : {"/dev/dri", "/dev/kfd", "/dev/dxg", "/dev/shm", "/dev/null"}) rights.use.emplace_back(path);
  glob_t found{};
  if (glob("/dev/nvidia*", 0, nullptr, &found) == 0)
    for (std::size_t i = 0; i < found.gl_pathc; ++i) rights.use.emplace_back(found.gl_pathv[i]);
  globfree(&found);
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    for (const char* cache : {"/.nv", "/.cache/nvidia", "/.cache/mesa_shader_cache", "/.cache/mesa_shader_cache_db"})
      rights.write.emplace_back(std::string(home) + cache);
}

}  // namespace

Confinement::Confinement(ConfinementWish wish)
    : wish_(std::move(wish)), has_device_(headless_gl::has_graphics_device()) {}

bool Confinement::may_load_driver(bool is_textured) const {
  return may_draw(wish_.penetration, is_textured, has_device_);
}

tl::expected<void, std::string> Confinement::drop_privileges() const {
  if (!wish_.is_on) {
    wish_.warn("--unconfined: whoever takes over this program may do all that its user may; for debugging only");
    return {};
  }
  const auto words = transport::drop_privileges(wish_.user);
  if (!words) return tl::unexpected(words.error() + "; --unconfined runs it with all that it has");
  wish_.say(*words);
  return {};
}

void Confinement::restrict_files(const SceneDefinition& scene, const std::string& keys_folder) const {
  if (!wish_.is_on) return;
  FileRights rights;
  transport::add_system_files(rights);
  add_asset(rights, scene.tool);
  for (const ObjectDefinition& object : scene.objects) add_asset(rights, object.source);
  rights.read.push_back(keys_folder);
  if (has_models(scene)) {
    const std::filesystem::path cache = asset_cache_folder();
    std::error_code told_by_the_bake;
    std::filesystem::create_directories(cache, told_by_the_bake);
    rights.write.push_back(cache.string());
  }
  const bool has_driver = may_load_driver(true);
  if (has_driver) add_driver(rights);
  if (const auto version = transport::restrict_files(rights); !version)
    wish_.warn(fmt::format("it may open any file that its user may: {}", version.error()));
  else
    wish_.say(fmt::format("confined by Landlock {}: it reads {}", *version,
                          has_driver ? "any file, because a graphics driver may need it; it writes to its caches alone"
                                     : "its scene and its keys alone"));
}

void Confinement::restrict_calls(bool is_textured) const {
  if (!wish_.is_on) return;
  const auto calls = may_load_driver(is_textured) ? transport::Calls::kServerWithDriver : transport::Calls::kServer;
  if (const auto done = transport::restrict_calls(calls); !done)
    wish_.warn(fmt::format("it may ask the kernel for anything: {}", done.error()));
  else
    wish_.say(fmt::format("confined by seccomp: {}", transport::words(calls)));
}

}  // namespace farfeel::slave_sim
