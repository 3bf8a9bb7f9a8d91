#include "slave_sim/living/saved_files.h"

#include <fmt/format.h>

#include <set>

#include "codecs/scene/saved_scene.h"
#include "codecs/text/plain_names.h"
#include "slave_sim/edits/stamp.h"
#include "transport/bulk/object.h"

namespace farfeel::slave_sim {
namespace {

using codecs::quoted_for_toml;

constexpr std::size_t kMostOfName = 50;  // of an asset's name; a number may follow, and the ending

std::string of(const glm::dvec3& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

std::string degrees(const glm::dquat& R) {
  return of(glm::degrees(spatial::vector_from_rotation(R)));
}

std::string pose_text(const spatial::Pose& X_WM, const glm::dvec3& origin_m) {
  return fmt::format("position_m = {}\nrotation_vector_deg = {}\n", of(X_WM.p + origin_m), degrees(X_WM.R));
}

/// The keys say how far the object is from its first.
std::string motion_text(const motion::ScriptedMotion& motion) {
  std::string text =
      fmt::format("[object.motion]\nrepeats = {}\nkey = [\n", motion.afterwards() == motion::Afterwards::kRepeats);
  const spatial::Pose& first = motion.keys().front().X_WO;
  for (const motion::Keyframe& key : motion.keys()) {
    text += fmt::format("  {{ at_s = {}, moved_m = {}, turned_deg = {} }},\n", key.at_s, of(key.X_WO.p - first.p),
                        degrees(key.X_WO.R * glm::conjugate(first.R)));
  }
  return text + "]\n";
}

std::string exploration_text(const codecs::Exploration& e, const glm::dvec3& origin_m) {
  return fmt::format(
      "\n[exploration]\ntool_point_m = {}\ntool_normal = {}\nregion_low_m = {}\nregion_high_m = {}\napproach = {}\n"
      "press_force_N = {}\nstroke_speed_m_per_s = {}\n",
      of(e.p_TWork_T), of(e.nhat_work_T), of(e.region_low_W + origin_m), of(e.region_high_W + origin_m),
      of(e.approach_W), e.press_force_N, e.stroke_speed_m_per_s);
}

/// As it is, without the room that was made below its heights for stamps to come: a node makes that anew. Heights are
/// told one by one: where room was made or a stamp pressed they do not follow from the bake's detail any more.
codecs::Asset as_it_is(codecs::Asset asset) {
  take_room_back(asset.felt);
  asset.detail = {};
  return asset;
}

std::vector<std::string> asset_names(const World& world) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  const auto add = [&](const std::string& name) {
    names.push_back(codecs::unlike(codecs::plain_name(name.substr(0, kMostOfName), "object"), taken) +
                    codecs::kSavedAssetEnding);
  };
  for (const WorldObject& object : world.objects) add(object.name);
  add("tool");
  return names;
}

}  // namespace

std::string scene_text(const World& world, const std::vector<std::string>& asset_names) {
  const SceneDefinition& scene = world.definition;
  const glm::dvec3 origin_m = scene.origin_m.value_or(glm::dvec3(0));
  std::string text = fmt::format("title = {}\neditable = {}\nstamp_room_m = {}\n", quoted_for_toml(scene.title),
                                 scene.is_editable, scene.stamp_room_m);
  if (scene.origin_m) text += fmt::format("origin_m = {}\n", of(origin_m));
  text += fmt::format("tolerance_m = {}\ngrid_samples = {}\nsoftness_m = {}\n", scene.tolerance_m, scene.grid_samples,
                      scene.softness_m);
  text += fmt::format("\n[workspace]\nscale = {}\nclutch = {}\n\n[force]\nscale = {}\n\n[tool]\nasset = {}\n",
                      scene.workspace_scale, scene.has_clutch, scene.force_scale, quoted_for_toml(asset_names.back()));
  for (std::size_t k = 0; k < world.objects.size(); ++k) {
    const WorldObject& object = world.objects[k];
    text += fmt::format("\n[[object]]\nname = {}\nasset = {}\n", quoted_for_toml(object.name),
                        quoted_for_toml(asset_names[k]));
    if (!object.is_there) text += "present = false\n";
    if (const auto& motion = scene.objects[k].motion) {
      text += pose_text(motion->keys().front().X_WO, origin_m) + motion_text(*motion);
    } else {
      text += pose_text(object.X_WO * spatial::Pose{{1, 0, 0, 0}, object.asset.p_OM_O}, origin_m);
    }
  }
  return scene.exploration ? text + exploration_text(*scene.exploration, origin_m) : text;
}

tl::expected<std::vector<std::byte>, std::string> saved_files(const World& world) {
  const std::vector<std::string> names = asset_names(world);
  const std::string text = scene_text(world, names);
  std::vector<codecs::SavedFile> files{{codecs::kSavedSceneFile, std::as_bytes(std::span(text))}};
  std::vector<std::vector<std::byte>> assets;
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const bool is_tool = k == world.objects.size();
    auto asset = codecs::write_asset(is_tool ? world.tool : as_it_is(world.objects[k].asset));
    if (!asset) return tl::unexpected(asset.error().message);
    bytes += asset->size();
    if (bytes > transport::kMaxObjectBytes) break;
    assets.push_back(*std::move(asset));
    files.push_back({names[k], assets.back()});
  }
  auto object = codecs::write_saved_scene(files);
  if (files.size() <= names.size() || object.size() > transport::kMaxObjectBytes)
    return tl::unexpected(fmt::format(
        "the scene as files takes more than {} MiB, which is more than may be sent: save it where its assets are, or "
        "make scenes of fewer objects",
        transport::kMaxObjectBytes >> 20));
  return object;
}

}  // namespace farfeel::slave_sim
