// The signed distance s of a point of the tool's axis is its distance to the mesh where the straight way to it crosses
// nothing. Where the way crosses the surface the point is behind it, whatever it has come to since: in the material, or
// through a wall and beyond. Then s is minus the distance to the nearest part that faces where the tool came from and
// has the point behind it. The tool's depth is its radius less the least s along its axis. s is 1-Lipschitz on either
// side, so of an interval of length l with ends s0 and s1 no point is below (s0 + s1 - l) / 2.
#include "tests/bench/touch_truth.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::bench {
namespace {

constexpr double kAxisTolerance_m =
    2e-6;                              // of the deepest point's depth on an axis: far below every limit of the bench
constexpr int kMostIntervals = 4000;   // an axis that lies along a plane would be cut without end
constexpr double kOnSurface_m = 1e-9;  // nearer, and the triangle's normal says which way is out
constexpr double kOnFace_m = 20e-6;    // nearer, the face there tells the side and the way out
constexpr double kNearer = 0.9;        // a part is nearer than another if its distance is below this share

/// The point of triangle abc nearest to p, by the plane and then the edges.
glm::dvec3 nearest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double nn = glm::dot(n, n);
  const auto is_inside = [&](const glm::dvec3& u, const glm::dvec3& v) {
    return glm::dot(glm::cross(v - u, p - u), n) >= 0;
  };
  if (nn > 0 && is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return p - glm::dot(p - a, n) / nn * n;
  glm::dvec3 best = a;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [u, v] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
    const glm::dvec3 e = v - u;
    const double ee = glm::dot(e, e);
    const glm::dvec3 q = u + (ee > 0 ? std::clamp(glm::dot(p - u, e) / ee, 0.0, 1.0) : 0.0) * e;
    if (const double d = glm::dot(p - q, p - q); d < least) least = d, best = q;
  }
  return best;
}

/// Embree calls visit() for each triangle that may be within the query's radius.
struct Query {
  const geometry::TriangleMesh* mesh;
  glm::dvec3 p;
  bool is_front_only = false;  ///< triangles with n . out > least_cosine that have p behind them
  glm::dvec3 out{0};
  double least_cosine = 0;
  double distance_m = std::numeric_limits<double>::infinity();
  glm::dvec3 q{0}, nhat{0};
  std::vector<WayOut>* all = nullptr;  ///< instead of the nearest: directions of all that face p, within radius_m
  double radius_m = 0;
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<Query*>(arguments->userPtr);
  const geometry::Triangle& t = query.mesh->triangles[arguments->primID];
  const auto& v = query.mesh->positions_O;
  const glm::dvec3 q = nearest_on_triangle(query.p, v[t[0]], v[t[1]], v[t[2]]);
  const double distance_m = glm::length(query.p - q);
  if (query.all != nullptr) {
    const glm::dvec3 n = geometry::unit_normal(*query.mesh, t);
    if (distance_m > kOnSurface_m && distance_m < query.radius_m && glm::dot(query.p - q, n) > 0)
      query.all->push_back({query.radius_m - distance_m, (query.p - q) / distance_m});
    return false;
  }
  if (distance_m >= query.distance_m) return false;
  const glm::dvec3 n = geometry::unit_normal(*query.mesh, t);
  if (query.is_front_only && (glm::dot(n, query.out) <= query.least_cosine || glm::dot(query.p - v[t[0]], n) > 0))
    return false;
  query.distance_m = distance_m, query.q = q, query.nhat = n;
  arguments->query->radius = 1.000001F * static_cast<float>(distance_m) + 1e-7F;
  return true;
}

void run(RTCScene scene, Query& query, double radius_m) {
  RTCPointQuery point{};
  point.x = static_cast<float>(query.p.x), point.y = static_cast<float>(query.p.y),
  point.z = static_cast<float>(query.p.z);
  point.radius = static_cast<float>(radius_m);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene, &point, &context, nullptr, &query);
}

}  // namespace

double TrueTouch::depth_nearest_m(double told_m) const {
  if (aside && std::abs(aside->depth_m - told_m) < std::abs(main.depth_m - told_m)) return aside->depth_m;
  return main.depth_m;
}

double TrueTouch::angle_rad(const glm::dvec3& direction_O) const {
  const auto angle = [&](const WayOut& way) {
    return std::atan2(glm::length(glm::cross(direction_O, way.out_O)), glm::dot(direction_O, way.out_O));
  };
  return aside ? std::min(angle(main), angle(*aside)) : angle(main);
}

struct TouchTruth::Scene {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

struct TouchTruth::AxisPoint {
  glm::dvec3 p_O;
  double signed_m;
  glm::dvec3 out_O;
  bool is_behind;
};

TouchTruth::TouchTruth(const geometry::TriangleMesh& mesh) : mesh_(mesh), scene_(std::make_unique<Scene>()) {
  RTCGeometry geometry = rtcNewGeometry(scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                3 * sizeof(float), mesh.positions_O.size()));
  for (const glm::dvec3& p : mesh.positions_O) {
    for (int axis = 0; axis < 3; ++axis) *positions++ = static_cast<float>(p[axis]);
  }
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
  for (const geometry::Triangle& t : mesh.triangles) indices = std::copy(t.begin(), t.end(), indices);
  rtcSetGeometryPointQueryFunction(geometry, visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(scene_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(scene_->scene);
}

TouchTruth::~TouchTruth() = default;

TouchTruth::Nearest TouchTruth::nearest(const glm::dvec3& p_O) const {
  Query query{.mesh = &mesh_, .p = p_O};
  run(scene_->scene, query, std::numeric_limits<double>::infinity());
  return {query.distance_m, query.q, query.nhat};
}

std::optional<TouchTruth::Nearest> TouchTruth::nearest_in_front(const glm::dvec3& p_O, const glm::dvec3& out_O,
                                                                double least_cosine) const {
  Query query{.mesh = &mesh_, .p = p_O, .is_front_only = true, .out = out_O, .least_cosine = least_cosine};
  run(scene_->scene, query, std::numeric_limits<double>::infinity());
  if (!std::isfinite(query.distance_m)) return std::nullopt;
  return Nearest{query.distance_m, query.q, query.nhat};
}

std::optional<TouchTruth::Crossing> TouchTruth::first_crossing(const glm::dvec3& from_O, const glm::dvec3& to_O) const {
  const glm::dvec3 way = to_O - from_O;
  const double length_m = glm::length(way);
  if (!(length_m > 0)) return std::nullopt;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(from_O.x), ray.ray.org_y = static_cast<float>(from_O.y),
  ray.ray.org_z = static_cast<float>(from_O.z);
  ray.ray.dir_x = static_cast<float>(way.x / length_m), ray.ray.dir_y = static_cast<float>(way.y / length_m),
  ray.ray.dir_z = static_cast<float>(way.z / length_m);
  ray.ray.tfar = static_cast<float>(length_m);
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Crossing{ray.ray.tfar / length_m, geometry::unit_normal(mesh_, mesh_.triangles[ray.hit.primID])};
}

TouchTruth::AxisPoint TouchTruth::at(const glm::dvec3& p_O, const RoundToolPose& pose) const {
  // On the surface itself neither a ray nor planes tell the sides apart.
  if (const Nearest on = nearest(p_O); on.distance_m < kOnFace_m && glm::dot(on.nhat_O, pose.out_O) > 0)
    return {p_O, glm::dot(p_O - on.q_O, on.nhat_O), on.nhat_O, false};
  const bool is_behind = pose.way_m > 0 && first_crossing(p_O + pose.way_m * pose.out_O, p_O).has_value();
  if (is_behind) {
    if (const auto front = nearest_in_front(p_O, pose.out_O)) {
      const double d = front->distance_m;
      return {p_O, -d, d > kOnSurface_m ? (front->q_O - p_O) / d : front->nhat_O, true};
    }
  }
  const Nearest found = nearest(p_O);
  const double d = found.distance_m;
  return {p_O, d, d > kOnSurface_m ? (p_O - found.q_O) / d : found.nhat_O, false};
}

TouchTruth::AxisPoint TouchTruth::deepest(const RoundTool& tool, const RoundToolPose& pose) const {
  if (tool.half_length_m == 0) return at(pose.p_O, pose);
  struct Interval {
    double from, to, s_from, s_to;
  };
  const auto point = [&](double along) { return at(pose.p_O + along * pose.axis_O, pose); };
  AxisPoint best = point(-tool.half_length_m);
  const AxisPoint other_end = point(tool.half_length_m);
  std::vector<Interval> open{{-tool.half_length_m, tool.half_length_m, best.signed_m, other_end.signed_m}};
  if (other_end.signed_m < best.signed_m) best = other_end;
  for (int i = 0; i < kMostIntervals && !open.empty(); ++i) {
    const Interval now = open.back();
    open.pop_back();
    if (0.5 * (now.s_from + now.s_to - (now.to - now.from)) > best.signed_m - kAxisTolerance_m) continue;
    const double middle = 0.5 * (now.from + now.to);
    const AxisPoint found = point(middle);
    if (found.signed_m < best.signed_m) best = found;
    const Interval low{now.from, middle, now.s_from, found.signed_m}, high{middle, now.to, found.signed_m, now.s_to};
    const bool is_low_first = now.s_from < now.s_to;  // the more promising half is looked at next
    open.push_back(is_low_first ? high : low);
    open.push_back(is_low_first ? low : high);
  }
  return best;
}

double TouchTruth::clearance_m(const RoundTool& tool, const RoundToolPose& pose) const {
  return deepest(tool, pose).signed_m - tool.radius_m;
}

bool TouchTruth::is_squeezed(const RoundTool& tool, const RoundToolPose& pose, const WayOut& main) const {
  constexpr int kAlong = 20;
  std::vector<WayOut> pressed;
  const int points = tool.half_length_m > 0 ? kAlong : 0;
  for (int i = 0; i <= points; ++i) {
    const double along = points == 0 ? 0 : tool.half_length_m * (2.0 * i / points - 1);
    Query query{.mesh = &mesh_, .p = pose.p_O + along * pose.axis_O};
    query.all = &pressed, query.radius_m = tool.radius_m;
    run(scene_->scene, query, tool.radius_m);
  }
  return std::any_of(pressed.begin(), pressed.end(), [&](const WayOut& way) {
    return way.depth_m > 0.5 * main.depth_m && glm::dot(way.out_O, main.out_O) < 0;
  });
}

TrueTouch TouchTruth::touch(const RoundTool& tool, const RoundToolPose& pose) const {
  const AxisPoint found = deepest(tool, pose);
  TrueTouch touch{.main = {tool.radius_m - found.signed_m, found.out_O}};
  if (!found.is_behind) {
    if (touch.main.depth_m > 0) touch.is_squeezed = is_squeezed(tool, pose, touch.main);
    return touch;
  }
  return with_aside(touch, found.p_O, tool.radius_m, pose.out_O);
}

TrueTouch TouchTruth::with_aside(TrueTouch touch, const glm::dvec3& p_O, double radius_m,
                                 const glm::dvec3& out_O) const {
  const double nearer_m = kNearer * (touch.main.depth_m - radius_m);
  touch.is_past_middle = nearest(p_O).distance_m < nearer_m;
  if (!touch.is_past_middle) return touch;
  const auto aside = nearest_in_front(p_O, out_O, kAsideCosine);
  if (aside && aside->distance_m > kOnSurface_m && aside->distance_m < nearer_m)
    touch.aside = {radius_m + aside->distance_m, (aside->q_O - p_O) / aside->distance_m};
  return touch;
}

TrueTouch TouchTruth::behind(const glm::dvec3& p_O, double radius_m, const glm::dvec3& out_O) const {
  const auto front = nearest_in_front(p_O, out_O);
  if (!front) return {.main = {radius_m + nearest(p_O).distance_m, out_O}};
  const double d = front->distance_m;
  return with_aside({.main = {radius_m + d, d > kOnSurface_m ? (front->q_O - p_O) / d : front->nhat_O}}, p_O, radius_m,
                    out_O);
}

}  // namespace farfeel::bench
