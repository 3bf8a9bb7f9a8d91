// Two triangles that are not in one plane cross where an edge of one pierces the other. Embree, in float, proposes the
// triangles along each edge; whether the edge pierces them is decided in double.
#include "slave_sim/bake/self_crossing.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::slave_sim {
namespace {

constexpr double kMargin = 1e-6;  // of the mesh's size: nearer than this is touching
constexpr int kMostHits = 32;     // triangles looked at along one edge

class Bvh {
 public:
  /// p: relative to the mesh's middle, so that float is fine enough wherever the mesh stands.
  Bvh(const std::vector<glm::dvec3>& p, const std::vector<geometry::Triangle>& triangles) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), p.size()));
    for (const glm::dvec3& v : p) {
      for (int axis = 0; axis < 3; ++axis) *positions++ = static_cast<float>(v[axis]);
    }
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles.size()));
    for (const geometry::Triangle& t : triangles) indices = std::copy(t.begin(), t.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_);
  }
  ~Bvh() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Bvh(const Bvh&) = delete;
  Bvh& operator=(const Bvh&) = delete;

  /// Calls is_last(triangle) for triangles that the segment from a to b meets, near ones first, until it says so.
  template <typename IsLast>
  void along(const glm::dvec3& a, const glm::dvec3& b, IsLast is_last) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const glm::dvec3 d = b - a;
    float near = 0;
    for (int hit = 0; hit < kMostHits; ++hit) {
      RTCRayHit ray{};
      ray.ray.org_x = static_cast<float>(a.x), ray.ray.org_y = static_cast<float>(a.y),
      ray.ray.org_z = static_cast<float>(a.z);
      ray.ray.dir_x = static_cast<float>(d.x), ray.ray.dir_y = static_cast<float>(d.y),
      ray.ray.dir_z = static_cast<float>(d.z);
      ray.ray.tnear = near;
      ray.ray.tfar = 1;
      ray.ray.mask = ~0U;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_, &context, &ray);
      if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID || is_last(ray.hit.primID)) return;
      near = std::nextafter(ray.ray.tfar * 1.000001F, std::numeric_limits<float>::infinity());
    }
  }

 private:
  RTCDevice device_ = rtcNewDevice("threads=1");
  RTCScene scene_ = rtcNewScene(device_);
};

/// Does the segment from p to q pass through triangle abc, by more than margin on either side of its plane?
bool pierces(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
             double margin) {
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double length = glm::length(n);
  if (!(length > 0)) return false;
  const double above = glm::dot(n, p - a) / length, below = glm::dot(n, q - a) / length;
  if (!(std::min(above, below) < -margin && std::max(above, below) > margin)) return false;
  const glm::dvec3 at = p + above / (above - below) * (q - p);
  const auto side = [&](const glm::dvec3& from, const glm::dvec3& to) {
    return glm::dot(n, glm::cross(to - from, at - from));
  };
  const double slack = -margin * length;  // where two triangles of one face meet is inside as well
  return side(a, b) >= slack && side(b, c) >= slack && side(c, a) >= slack;
}

}  // namespace

SelfCrossing self_crossing(const geometry::TriangleMesh& mesh, std::size_t most_edges) {
  const geometry::Box box = geometry::bounding_box(mesh);
  const glm::dvec3 middle = box.centre();
  const double margin = kMargin * glm::length(box.size());
  std::vector<glm::dvec3> p;
  p.reserve(mesh.positions_O.size());
  for (const glm::dvec3& v : mesh.positions_O) p.push_back(v - middle);
  const Bvh bvh(p, mesh.triangles);

  SelfCrossing found;
  found.of = 3 * mesh.triangles.size() / 2;  // a closed surface's
  const std::size_t stride = std::max<std::size_t>(1, (found.of + most_edges - 1) / most_edges);
  std::size_t turn = 0;
  for (const geometry::Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k], to = t[(k + 1) % 3];
      if (from > to || turn++ % stride != 0) continue;  // of an edge's two triangles, one runs upwards
      ++found.looked;
      bvh.along(p[from], p[to], [&](std::uint32_t triangle) {
        const geometry::Triangle& other = mesh.triangles[triangle];
        for (const std::uint32_t v : other) {
          if (v == from || v == to) return false;
        }
        if (!pierces(p[from], p[to], p[other[0]], p[other[1]], p[other[2]], margin)) return false;
        if (found.edges++ == 0) found.first_O = 0.5 * (p[from] + p[to]) + middle;
        return true;
      });
    }
  }
  return found;
}

std::optional<std::string> words_about(const SelfCrossing& found) {
  if (found.edges == 0) return std::nullopt;
  const std::string sampled =
      found.looked < found.of ? fmt::format(", of {} that were looked at out of {}", found.looked, found.of) : "";
  return fmt::format(
      "the surface passes through itself ({} edges pierce it{}; the first near ({:.6g}, {:.6g}, {:.6g}) m): it is kept "
      "as it is, all of it is felt where it lies outermost, and mass and origin count the overlap twice; unite its "
      "parts in a mesh editor if that matters",
      found.edges, sampled, found.first_O.x, found.first_O.y, found.first_O.z);
}

}  // namespace farfeel::slave_sim
