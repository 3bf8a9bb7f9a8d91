// A bowl and a leaf of thin wall, baked as anybody's mesh is and pressed by a ball from both sides. The judge is the
// mesh that they were baked from.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/bench/hardcases_contact.h"
#include "tests/bench/touch_places.h"

namespace farfeel::bench {
namespace {

using spatial::Pose;

constexpr double kmm = 1e-3;
constexpr double kRadius_m = 60 * kmm, kWall_m = 3 * kmm, kBall_m = 3 * kmm;
constexpr double kClear_m = 0.2 * kmm, kStep_m = 0.3 * kmm, kPress_m = 0.3 * kmm;
constexpr std::uint32_t kPlaces = 60;
constexpr double kJab_m_s = 1;

TouchSubject subject_of(const char* name, geometry::TriangleMesh mesh) {
  auto baked = kept_asset(name, {std::move(mesh), {}}, false);
  if (!baked) throw std::runtime_error(fmt::format("{}: {}", name, baked.error()));
  return TouchSubject(*std::move(baked));
}

/// Places whose way out looks along +-side(p_O), pressed to each depth.
template <typename Side>
void press_side(HardCaseRows& rows, const std::string& name, const TouchSubject& subject, const TouchTool& tool,
                double speed_m_s, Side&& side) {
  Presser presser(subject, tool);
  int inward = 0, missed = 0;
  double false_N = 0;
  std::uint32_t found = 0;
  for (std::uint32_t i = 0; i < 20 * kPlaces && found < kPlaces; ++i) {
    auto place = place_on(subject, tool, 1, i);
    if (!place || glm::dot(place->out_O, side(place->p_touch_O)) < 0.8) continue;
    ++found;
    if (speed_m_s > 0) place->speed_m_s = speed_m_s;
    const Pressed pressed = presser.press(*place, {kPress_m, 1 * kmm, 2.5 * kmm});
    for (const Told& at : pressed.at) {
      const Verdict v = judge(at, {}, subject.allowed_m());
      inward += v.inward, missed += v.missed;
    }
    for (const Told& at : pressed.before) false_N = std::max(false_N, glm::length(at.force_N));
  }
  rows.push_back({name, "presses that pull inwards", static_cast<double>(inward), "", 0});
  rows.push_back({name, "presses without force", static_cast<double>(missed), "", 0});
  rows.push_back({name, "force before the touch", found > 0 ? false_N : std::nan(""), "N", kFalseForce_N});
}

/// The middle of a ball that goes over the bowl's rim, clear of it all the way: up outside, across, down inside. In the
/// (r, z) half plane.
std::vector<glm::dvec2> way_over_the_rim() {
  const double away_m = kBall_m + kClear_m, inner_m = kRadius_m - kWall_m, down_m = 15 * kmm;
  std::vector<glm::dvec2> way;
  const auto add_arc = [&](const glm::dvec2& about, double from_rad, double to_rad) {
    const int n = static_cast<int>(std::ceil(away_m * std::abs(to_rad - from_rad) / kStep_m));
    for (int i = 0; i <= n; ++i) {
      const double angle = from_rad + (to_rad - from_rad) * i / n;
      way.push_back(about + away_m * glm::dvec2(std::cos(angle), std::sin(angle)));
    }
  };
  for (double z = -down_m; z < 0; z += kStep_m) way.emplace_back(std::sqrt(std::pow(kRadius_m + away_m, 2) - z * z), z);
  add_arc({kRadius_m, 0}, 0, std::numbers::pi / 2);
  for (double r = kRadius_m; r > inner_m; r -= kStep_m) way.emplace_back(r, away_m);
  add_arc({inner_m, 0}, std::numbers::pi / 2, std::numbers::pi);
  for (double z = 0; z > -down_m; z -= kStep_m) way.emplace_back(std::sqrt(std::pow(inner_m - away_m, 2) - z * z), z);
  return way;
}

void over_the_rim(HardCaseRows& rows, const TouchSubject& bowl, const TouchTool& tool) {
  constexpr int kPaths = 24;
  const std::vector<glm::dvec2> way = way_over_the_rim();
  int inward = 0, missed = 0;
  double false_N = 0;
  contact_service::ContactService service = touch_service(bowl, tool);
  for (int path = 0; path < kPaths; ++path) {
    service.restart();
    const double angle = (path + 0.37) * 2 * std::numbers::pi / kPaths;
    const auto in_space = [&](const glm::dvec2& rz) {
      return bowl.baked.asset.p_OM_O + glm::dvec3{rz.x * std::cos(angle), rz.x * std::sin(angle), rz.y};
    };
    std::uint32_t number = 0;
    for (const glm::dvec2& rz : way) {
      const auto& set = service.answer(pose_number(number++, {{1, 0, 0, 0}, in_space(rz)}));
      false_N = std::max(false_N, glm::length(set.F_To_W.force_N));
    }
    const glm::dvec3 p = in_space(way.back()), out = -glm::normalize(p - bowl.baked.asset.p_OM_O);
    for (const double pressed_m : {0.0, kPress_m}) {
      const double way_m = kClear_m + pressed_m;
      const auto& set = service.answer(pose_number(number++, {{1, 0, 0, 0}, p - way_m * out}));
      if (pressed_m == 0) continue;
      const double force_N = glm::length(set.F_To_W.force_N);
      missed += force_N < kNoForce_N;
      inward += glm::dot(set.F_To_W.force_N, out) < 0;
    }
  }
  const std::string name = "bowl of 3 mm, over the rim and in";
  rows.push_back({name, "force while 0.2 mm clear", false_N, "N", kFalseForce_N});
  rows.push_back({name, "paths that end in a pull inwards", static_cast<double>(inward), "", 0});
  rows.push_back({name, "paths that end without force", static_cast<double>(missed), "", 0});
}

/// The bowl from outside and from inside.
template <bool is_jab>
void bowl_from_both_sides(HardCaseRows& rows) {
  const auto ball = touch_tool("ball-6", false);
  const TouchSubject bowl = subject_of("bowl-3", bowl_mesh(1e3 * kWall_m));
  const auto outwards = [&](const glm::dvec3& p_O) { return glm::normalize(p_O - bowl.baked.asset.p_OM_O); };
  const auto inwards = [&](const glm::dvec3& p_O) { return -outwards(p_O); };
  const std::string name = fmt::format("bowl of 3 mm, {} from ", is_jab ? "jabbed at 1 m/s" : "pressed");
  const double speed_m_s = is_jab ? kJab_m_s : 0;
  press_side(rows, name + "outside", bowl, *ball, speed_m_s, outwards);
  press_side(rows, name + "inside", bowl, *ball, speed_m_s, inwards);
}

/// The leaf from above and from below.
template <bool is_jab>
void leaf_from_both_sides(HardCaseRows& rows) {
  const auto ball = touch_tool("ball-6", false);
  const TouchSubject leaf = subject_of("leaf-0.5", leaf_mesh(0.5));
  const auto up = [](const glm::dvec3&) { return glm::dvec3{0, 0, 1}; };
  const auto down = [](const glm::dvec3&) { return glm::dvec3{0, 0, -1}; };
  const std::string name = fmt::format("leaf of 0.5 mm, {} from ", is_jab ? "jabbed at 1 m/s" : "pressed");
  const double speed_m_s = is_jab ? kJab_m_s : 0;
  press_side(rows, name + "above", leaf, *ball, speed_m_s, up);
  press_side(rows, name + "below", leaf, *ball, speed_m_s, down);
}

void bowl_over_the_rim(HardCaseRows& rows) {
  over_the_rim(rows, subject_of("bowl-3", bowl_mesh(1e3 * kWall_m)), *touch_tool("ball-6", false));
}

}  // namespace

std::span<const HardCase> shell_cases() {
  static constexpr HardCase kCases[] = {
      {"bowl, pressed", bowl_from_both_sides<false>},
      {"leaf, pressed", leaf_from_both_sides<false>},
      {"bowl, jabbed", bowl_from_both_sides<true>},
      {"leaf, jabbed", leaf_from_both_sides<true>},
      {"over the rim", bowl_over_the_rim},
  };
  return kCases;
}

}  // namespace farfeel::bench
