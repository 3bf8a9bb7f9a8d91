// Embree works in float. Rays start a reach away, so a hit is found within about 1e-7 of the mesh's size, and its
// height is then computed again in double from the triangle that was hit.
#include "slave_sim/bake/full_surface.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "slave_sim/bake/nearest_on_triangle.h"

namespace farfeel::slave_sim {
namespace {

constexpr double kLeastFacing = 0.2588;  // cos 75 degrees

struct NearestQuery {
  const geometry::TriangleMesh* mesh;
  glm::dvec3 p;
  double distance_m;
  unsigned triangle;
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<NearestQuery*>(arguments->userPtr);
  const geometry::Triangle& t = query.mesh->triangles[arguments->primID];
  const auto& v = query.mesh->positions_O;
  const double distance_m = glm::length(nearest_on_triangle(query.p, v[t[0]], v[t[1]], v[t[2]]) - query.p);
  if (distance_m >= query.distance_m) return false;
  query.distance_m = distance_m;
  query.triangle = arguments->primID;
  arguments->query->radius = std::nextafter(static_cast<float>(distance_m), std::numeric_limits<float>::infinity());
  return true;
}

}  // namespace

struct FullSurface::Scene {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
  /// Embree goes on without memory until it falls, and gives nothing where it has none for a device of its own: here it
  /// ends as any allocation does.
  void demand_memory(const void* given) const {
    if (given == nullptr || rtcGetDeviceError(device) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  }
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

FullSurface::FullSurface(const geometry::TriangleMesh& mesh) : mesh_(mesh), scene_(std::make_unique<Scene>()) {
  RTCGeometry geometry = rtcNewGeometry(scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                3 * sizeof(float), mesh.positions_O.size()));
  scene_->demand_memory(positions);
  for (const glm::dvec3& p : mesh.positions_O) {
    for (int axis = 0; axis < 3; ++axis) *positions++ = static_cast<float>(p[axis]);
  }
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
  scene_->demand_memory(indices);
  for (const geometry::Triangle& t : mesh.triangles) indices = std::copy(t.begin(), t.end(), indices);
  rtcSetGeometryPointQueryFunction(geometry, visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(scene_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(scene_->scene);
  scene_->demand_memory(scene_->scene);
}

FullSurface::~FullSurface() = default;

std::optional<double> FullSurface::height_along(const glm::dvec3& p_O, const glm::dvec3& d_O, double reach_m) const {
  const glm::dvec3 start = p_O + reach_m * d_O;  // looking down from outside
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  std::optional<double> best;
  float near = 0;
  constexpr int kMostHits = 64;
  for (int hit = 0; hit < kMostHits; ++hit) {
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(start.x), ray.ray.org_y = static_cast<float>(start.y),
    ray.ray.org_z = static_cast<float>(start.z);
    ray.ray.dir_x = static_cast<float>(-d_O.x), ray.ray.dir_y = static_cast<float>(-d_O.y),
    ray.ray.dir_z = static_cast<float>(-d_O.z);
    ray.ray.tnear = near;
    ray.ray.tfar = static_cast<float>(2 * reach_m);
    ray.ray.mask = ~0U;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_->scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
    near = std::nextafter(ray.ray.tfar * 1.000001F, std::numeric_limits<float>::infinity());
    const geometry::Triangle& t = mesh_.triangles[ray.hit.primID];
    const glm::dvec3 n = geometry::unit_normal(mesh_, t);
    const double facing = glm::dot(n, d_O);
    if (facing < kLeastFacing) continue;
    const double z = glm::dot(n, mesh_.positions_O[t[0]] - p_O) / facing;
    if (std::abs(z) <= reach_m && (!best || std::abs(z) < std::abs(*best))) best = z;
    if (best && reach_m - near < -std::abs(*best)) break;  // further hits are further away
  }
  return best;
}

std::optional<double> FullSurface::thickness_m(const glm::dvec3& p_O, const glm::dvec3& d_O,
                                               double least_facing) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  float near = 0;
  constexpr int kMostHits = 64;
  for (int hit = 0; hit < kMostHits; ++hit) {
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(p_O.x), ray.ray.org_y = static_cast<float>(p_O.y),
    ray.ray.org_z = static_cast<float>(p_O.z);
    ray.ray.dir_x = static_cast<float>(d_O.x), ray.ray.dir_y = static_cast<float>(d_O.y),
    ray.ray.dir_z = static_cast<float>(d_O.z);
    ray.ray.tnear = near;
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = ~0U;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_->scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    if (glm::dot(geometry::unit_normal(mesh_, mesh_.triangles[ray.hit.primID]), d_O) >= least_facing)
      return ray.ray.tfar;
    near = std::nextafter(ray.ray.tfar * 1.000001F, std::numeric_limits<float>::infinity());
  }
  return {};
}

FullSurface::Nearest FullSurface::nearest(const glm::dvec3& p_O) const {
  NearestQuery query{&mesh_, p_O, std::numeric_limits<double>::infinity(), 0};
  RTCPointQuery point{};
  point.x = static_cast<float>(p_O.x), point.y = static_cast<float>(p_O.y), point.z = static_cast<float>(p_O.z);
  point.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_->scene, &point, &context, nullptr, &query);
  return {query.distance_m, geometry::unit_normal(mesh_, mesh_.triangles[query.triangle])};
}

}  // namespace farfeel::slave_sim
