#include "master_station/session_pictures.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <future>

#include "codecs/text/whole_file.h"
#include "haptic_core/contact/penalty.h"
#include "master_station/display/picture.h"
#include "master_station/report/report_page.h"

namespace farfeel::master_station {
namespace {

constexpr int kWidth_px = 1280, kHeight_px = 800;
constexpr glm::vec3 kSteel{0.62F, 0.66F, 0.71F}, kBrass{0.86F, 0.66F, 0.28F};
constexpr double kCloseUp_m = 0.08;  // height of the second picture at the strongest contact

void write_file(const std::string& path, const std::string& bytes) {
  if (const std::string why = codecs::write_whole_file(path, bytes); !why.empty()) spdlog::warn("{}", why);
}

// The contact that presses hardest and those about it: contacts may be as far apart as the scene is wide.
std::vector<glm::dvec3> near_strongest(const std::vector<ForceArrow>& arrows) {
  const ForceArrow& strongest = *std::max_element(
      arrows.begin(), arrows.end(),
      [](const ForceArrow& a, const ForceArrow& b) { return glm::length(a.force_N) < glm::length(b.force_N); });
  std::vector<glm::dvec3> points_W;
  for (const ForceArrow& arrow : arrows)
    if (glm::distance(arrow.p_WC_W, strongest.p_WC_W) < kCloseUp_m / 2) points_W.push_back(arrow.p_WC_W);
  return points_W;
}

}  // namespace

void write_pictures(const std::string& folder, const codecs::SceneDescription& scene,
                    std::span<const motion::ObjectCourse> courses, const Moment& moment) {
  std::error_code ignored;  // an earlier session's pictures must not pass for this one's
  for (const char* name : {kScenePicture, kContactsPicture, kNoPicture})
    std::filesystem::remove(folder + "/" + name, ignored);

  // Contacts are shown with the pose they answer: the tool has moved on since.
  const bool has_contacts = moment.contacts.count > 0;
  const double scene_s = 1e-9 * static_cast<double>(has_contacts ? moment.contacts.pose_time_ns : moment.tick.time_ns);
  Still still;
  for (std::uint32_t i = 0; i < scene.objects.size(); ++i) {
    const codecs::SceneObject& object = scene.objects[i];
    motion::MovingObjects one({{i, object.motion, motion::at_rest(object.X_WO, object.is_there)}});
    for (const motion::ObjectCourse& told : courses) (void)one.set_out(told);
    const motion::Placement then = one.at(one.moved()[0], scene_s);
    if (then.is_there) still.bodies.push_back({&object.visible_O, then.X_WO, kSteel, object.colours});
  }
  still.bodies.push_back(
      {&scene.tool.visible_T, has_contacts ? moment.contacts.X_WT : moment.tick.X_WT, kBrass, scene.tool.colours});

  for (std::size_t i = 0; i < moment.contacts.count; ++i) {
    const contact::Contact& contact = moment.contacts.contacts[i];
    const glm::dvec3 force_N = contact::penalty_wrench(contact, {}).force_N;
    if (glm::length(force_N) > 0) still.arrows.push_back({contact.p_WC_W, force_N});
  }

  std::vector<Camera> cameras{camera_for(box_around(still), static_cast<double>(kWidth_px) / kHeight_px)};
  if (!still.arrows.empty()) cameras.push_back(closer(cameras[0], near_strongest(still.arrows), kCloseUp_m));
  const auto images = draw(still, cameras, kWidth_px, kHeight_px);
  if (!images) {
    write_file(fmt::format("{}/{}", folder, kNoPicture), images.error().message);
    return;
  }
  const char* const names[] = {kScenePicture, kContactsPicture};
  std::vector<std::future<std::string>> packed;  // all at once: packing takes a while
  for (const Image& image : *images) packed.push_back(std::async(std::launch::async, png, std::cref(image)));
  for (std::size_t i = 0; i < packed.size(); ++i) write_file(fmt::format("{}/{}", folder, names[i]), packed[i].get());
}

}  // namespace farfeel::master_station
