#include "master_station/session_pictures.h"

#include <fmt/format.h>

#include <fstream>

#include "haptic_core/contact/penalty.h"
#include "master_station/display/picture.h"
#include "master_station/report/report_page.h"

namespace farfeel::master_station {
namespace {

constexpr int kWidth_px = 1280, kHeight_px = 800;
constexpr glm::vec3 kSteel{0.62F, 0.66F, 0.71F}, kBrass{0.86F, 0.66F, 0.28F};
constexpr double kCloseUp_m = 0.06;  // height of the second picture at the contacts

void write_file(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

void write_pictures(const std::string& folder, const codecs::SceneDescription& scene, const Moment& moment) {
  Still still;
  for (const codecs::SceneObject& object : scene.objects) {
    still.bodies.push_back({&object.visible_O, object.X_WO, kSteel});
  }
  // Contacts are shown with the pose they answer: the tool has moved on since.
  const bool has_contacts = moment.contacts.count > 0;
  still.bodies.push_back({&scene.tool.visible_T, has_contacts ? moment.contacts.X_WT : moment.tick.X_WT, kBrass});

  std::vector<glm::dvec3> touched;
  for (std::size_t i = 0; i < moment.contacts.count; ++i) {
    const contact::Contact& contact = moment.contacts.contacts[i];
    const glm::dvec3 force_N = contact::penalty_wrench(contact, {}).force_N;
    if (glm::length(force_N) <= 0) continue;
    still.arrows.push_back({contact.p_WC_W, force_N});
    touched.push_back(contact.p_WC_W);
  }

  std::vector<Camera> cameras{camera_for(box_around(still), static_cast<double>(kWidth_px) / kHeight_px)};
  if (!touched.empty()) cameras.push_back(closer(cameras[0], touched, kCloseUp_m));
  const auto images = draw(still, cameras, kWidth_px, kHeight_px);
  if (!images) {
    write_file(fmt::format("{}/{}", folder, kNoPicture), images.error().message);
    return;
  }
  const char* const names[] = {kScenePicture, kContactsPicture};
  for (std::size_t i = 0; i < images->size(); ++i)
    write_file(fmt::format("{}/{}", folder, names[i]), png((*images)[i]));
}

}  // namespace farfeel::master_station
