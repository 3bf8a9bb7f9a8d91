#include "tests/bench/touch_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace farfeel::bench {
namespace {

/// What says that a depth may be off. That an edge decides it says where it touches, not how well that is known.
constexpr std::uint8_t kDoubtsOfDepth = contact::kAllDoubts & ~penetration::kSilhouette;

using contact_service::ContactOptions;
using contact_service::TouchableObject;

constexpr int kMostDraws = 40;             // of points for one place
constexpr double kTouches_m = 10e-6;       // facets beside the touched one may reach so far into the tool
constexpr double kLongestWay_m = 6e-3;     // beyond the tolerance of the service: it first hears of the pair on the way
constexpr double kShortestWay_m = 0.5e-3;  // less is no way in
constexpr double kLeastOpening = 0.1;      // of the way back that the tool must come free of everything
constexpr double kSlowest_m_s = 1e-3, kFastest_m_s = 0.3;
constexpr double kAnswer_s = 1e-3;  // the service is asked a thousand times a second

struct SurfacePoint {
  glm::dvec3 p_O, nhat_O;
};

SurfacePoint random_point(const TouchSubject& subject, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const auto& up_to = subject.area_up_to_m2;
  const auto found = std::lower_bound(up_to.begin(), up_to.end(), up_to.back() * unit(random));
  const auto& mesh = subject.baked.original_O;
  const geometry::Triangle& t = mesh.triangles[std::min<std::size_t>(found - up_to.begin(), mesh.triangles.size() - 1)];
  const double root = std::sqrt(unit(random)), v = unit(random) * root;
  const auto& p = mesh.positions_O;
  return {(1 - root) * p[t[0]] + (root - v) * p[t[1]] + v * p[t[2]], geometry::unit_normal(mesh, t)};
}

ContactOptions options_of_programs() {
  return {.most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m};
}

/// Ways to go before the first touch, as pressed depths below zero, ascending: from far, each half as far, to just
/// beyond what the asset may be off by, where a force would be false.
std::vector<double> approach_m(double free_way_m, double allowed_m) {
  const double last_m = 1.05 * allowed_m;
  std::vector<double> at;
  for (double way_m = free_way_m; way_m > 1.5 * last_m; way_m /= 2) at.push_back(-way_m);
  if (last_m < free_way_m) at.push_back(-last_m);
  return at;
}

}  // namespace

RoundToolPose Place::round_pose(double pressed_m) const {
  return {p_touch_O - pressed_m * out_O, spatial::rotate({R_OT, {}}, {0, 0, 1}), out_O, std::max(0.0, pressed_m)};
}

// FNV-1a of words and numbers.
std::uint64_t seed_of(const std::string& model, const std::string& tool, std::uint64_t seed, std::uint32_t index) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  const auto add = [&](std::uint64_t value) { hash = (hash ^ value) * 0x0000'0100'0000'01B3; };
  for (const std::string* word : {&model, &tool}) {
    for (const char c : *word) add(static_cast<unsigned char>(c));
    add(0);
  }
  add(seed), add(index);
  return hash;
}

std::optional<Place> place_on(const TouchSubject& subject, const TouchTool& tool, std::uint64_t seed,
                              std::uint32_t index) {
  std::mt19937_64 random(seed_of(subject.baked.asset.name, tool.name, seed, index));
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  for (int draw = 0; draw < kMostDraws; ++draw) {
    const SurfacePoint point = random_point(subject, random);
    const glm::dquat R = glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random)));
    const double speed_m_s = kSlowest_m_s * std::pow(kFastest_m_s / kSlowest_m_s, unit(random));
    if (glm::length(point.nhat_O) < 0.5) continue;  // of a triangle without area
    Place place{.out_O = point.nhat_O, .R_OT = R, .speed_m_s = speed_m_s};
    // Of a capsule the end that looks inwards touches.
    const glm::dvec3 axis = spatial::rotate({R, {}}, {0, 0, 1});
    const double end = glm::dot(axis, point.nhat_O) > 0 ? 1 : -1;
    place.p_touch_O = point.p_O + tool.shape.radius_m * point.nhat_O + end * tool.shape.half_length_m * axis;
    place.free_way_m = bench::free_way_m(subject, tool, place, kLongestWay_m);
    if (place.free_way_m >= kShortestWay_m) return place;
  }
  return std::nullopt;
}

// Each step is shorter than the room there is.
double free_way_m(const TouchSubject& subject, const TouchTool& tool, const Place& place, double longest_m) {
  if (subject.truth.clearance_m(tool.shape, place.round_pose(0)) < -kTouches_m) return 0;
  constexpr double kLeastStep_m = 20e-6;
  double free_m = 0;
  for (double way_m = kLeastStep_m;;) {
    const double room_m = subject.truth.clearance_m(tool.shape, place.round_pose(-way_m));
    if (room_m < kLeastOpening * way_m) return free_m;
    free_m = way_m;
    if (way_m >= longest_m) return free_m;
    way_m = std::min(longest_m, way_m + std::max(kLeastStep_m, 0.9 * room_m));
  }
}

contact_service::ContactService touch_service(const TouchSubject& subject, const TouchTool& tool) {
  const codecs::Asset &S = subject.baked.asset, &T = tool.baked.asset;
  const TouchableObject object{&S.felt, S.material, {}, &subject.felt}, touched{&T.felt, T.material, {}, &tool.felt};
  return {std::span(&object, 1), touched, options_of_programs()};
}

Presser::Presser(const TouchSubject& subject, const TouchTool& tool)
    : subject_(subject), tool_(tool), service_(touch_service(subject, tool)) {}

ToldDepth told_depth(const contact::ContactSet& set) {
  ToldDepth told;
  double deepest_m = -std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    if (!(c.depth_m > deepest_m)) continue;
    told.depth_m = deepest_m = c.depth_m, told.doubts = c.doubts & kDoubtsOfDepth;
  }
  return told;
}

Told Presser::ask(const Place& place, double pressed_m, double speed_m_s) {
  // The tool's origin is its asset's centre of mass, the middle of its axis.
  const contact::ContactSet& set =
      service_.answer({sequence_++, time_ns_, place.X_OT(pressed_m), {{}, -speed_m_s * place.out_O}});
  Told told{.pressed_m = pressed_m, .truth = subject_.truth.touch(tool_.shape, place.round_pose(pressed_m))};
  told.force_N = set.F_To_W.force_N;
  const ToldDepth deepest = told_depth(set);
  told.depth_m = deepest.depth_m, told.doubts = deepest.doubts;
  const double force_N = glm::length(told.force_N);
  told.angle_rad =
      force_N > kNoForce_N ? told.truth.angle_rad(told.force_N / force_N) : std::numeric_limits<double>::quiet_NaN();
  return told;
}

Pressed Presser::press(const Place& place, const std::vector<double>& depths_m) {
  service_.restart();
  time_ns_ = 0, sequence_ = 0;
  Pressed pressed;
  double at_m = -place.free_way_m;
  const auto go_to = [&](double next_m, double speed_m_s) {
    time_ns_ += std::llround(1e9 * std::max(0.0, next_m - at_m) / place.speed_m_s);
    at_m = next_m;
    return ask(place, next_m, speed_m_s);
  };
  for (const double next_m : approach_m(place.free_way_m, subject_.allowed_m()))
    pressed.before.push_back(go_to(next_m, place.speed_m_s));
  // Steps as long as those of the fastest tool; the last two answers before it stops are as far apart as its own.
  const double own_m = place.speed_m_s * kAnswer_s, longest_m = std::max(own_m, kFastest_m_s * kAnswer_s);
  for (const double depth_m : depths_m) {
    while (depth_m - own_m - at_m > longest_m) (void)go_to(at_m + longest_m, place.speed_m_s);
    if (depth_m - own_m > at_m) (void)go_to(depth_m - own_m, place.speed_m_s);
    time_ns_ += std::llround(1e9 * kAnswer_s);
    pressed.at.push_back(go_to(depth_m, 0));
  }
  return pressed;
}

Verdict judge(const Told& at, const std::vector<Told>& before, double allowed_m) {
  Verdict v;
  const double force_N = glm::length(at.force_N), depth_m = at.truth.main.depth_m;
  v.missed = depth_m > allowed_m && force_N < kNoForce_N;
  const auto is_false = [&](const Told& told) {
    return told.truth.main.depth_m < -allowed_m && glm::length(told.force_N) > kFalseForce_N;
  };
  v.is_false = is_false(at) || std::any_of(before.begin(), before.end(), is_false);
  v.inward = depth_m > 0 && !at.truth.is_squeezed && at.angle_rad > M_PI / 2;
  const double off_m = std::abs(at.depth_m - at.truth.depth_nearest_m(at.depth_m));
  v.is_right = off_m <= std::max(allowed_m, 0.1 * std::abs(depth_m));
  v.is_flagged = at.doubts != 0;
  v.unflagged = depth_m > 0 && !v.is_right && !v.is_flagged;
  return v;
}

}  // namespace farfeel::bench
