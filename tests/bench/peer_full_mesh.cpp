#include "tests/bench/peer_full_mesh.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace farfeel::bench {
namespace {

constexpr int kSide = 181;  // quads along a side: 2 x 181 x 181 = 65,522 triangles
constexpr float kFar_m = 0.02f;

/// One plate as a regular grid of heights, in its own frame.
struct Mesh {
  std::vector<glm::dvec3> vertices;
  std::vector<std::array<unsigned, 3>> triangles;

  explicit Mesh(const HeightFunction& height) {
    for (int j = 0; j <= kSide; ++j) {
      for (int i = 0; i <= kSide; ++i) {
        const double x = kPlateWidth_m * (static_cast<double>(i) / kSide - 0.5),
                     y = kPlateWidth_m * (static_cast<double>(j) / kSide - 0.5);
        vertices.push_back({x, y, height(x, y)});
      }
    }
    for (unsigned j = 0; j < kSide; ++j) {
      for (unsigned i = 0; i < kSide; ++i) {
        const unsigned a = j * (kSide + 1) + i, b = a + 1, c = a + kSide + 2, d = a + kSide + 1;
        triangles.push_back({a, b, c});
        triangles.push_back({a, c, d});
      }
    }
  }
};

RTCScene embree_scene(RTCDevice device, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                3 * sizeof(float), mesh.vertices.size()));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k)
      positions[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(mesh.vertices[i][k]);
  }
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), mesh.triangles.size()));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) std::copy_n(mesh.triangles[i].begin(), 3, indices + 3 * i);
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

/// Distance along the ray to the mesh, or infinity.
double cast(RTCScene scene, const glm::dvec3& from, const glm::dvec3& along) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit hit{};
  hit.ray.org_x = static_cast<float>(from.x), hit.ray.org_y = static_cast<float>(from.y);
  hit.ray.org_z = static_cast<float>(from.z);
  hit.ray.dir_x = static_cast<float>(along.x), hit.ray.dir_y = static_cast<float>(along.y);
  hit.ray.dir_z = static_cast<float>(along.z);
  hit.ray.tfar = 2 * kFar_m;
  hit.ray.mask = ~0u;
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &hit);
  return hit.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<double>::infinity()
                                                   : static_cast<double>(hit.ray.tfar);
}

/// A triangle over C's plane: z = plane . (1, u, v); a corner lies in it where all edges are >= 0.
struct Flat {
  std::array<glm::dvec2, 3> corners;
  glm::dvec3 plane;
  std::array<glm::dvec3, 3> edges;
};

Flat flattened(const glm::dvec3& a, glm::dvec3 b, glm::dvec3 c) {
  glm::dvec3 n = glm::cross(b - a, c - a);
  if (n.z < 0) std::swap(b, c), n = -n;
  Flat flat{
      {glm::dvec2{a}, glm::dvec2{b}, glm::dvec2{c}}, {a.z + (n.x * a.x + n.y * a.y) / n.z, -n.x / n.z, -n.y / n.z}, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec2 p = flat.corners[k], along = flat.corners[(k + 1) % 3] - p;
    flat.edges[k] = {along.y * p.x - along.x * p.y, -along.y, along.x};
  }
  return flat;
}

double value(const glm::dvec3& plane, const glm::dvec2& p) {
  return plane.x + plane.y * p.x + plane.z * p.y;
}

}  // namespace

struct FullMeshes::State {
  Mesh s, t;
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene s_scene, t_scene;
  mutable std::vector<glm::dvec3> t_moved;

  explicit State(const PlatePair& pair)
      : s(pair.s_height()),
        t(pair.t_height()),
        s_scene(embree_scene(device, s)),
        t_scene(embree_scene(device, t)),
        t_moved(t.vertices.size()) {}
  ~State() {
    rtcReleaseScene(s_scene);
    rtcReleaseScene(t_scene);
    rtcReleaseDevice(device);
  }
};

FullMeshes::FullMeshes(const PlatePair& pair) : state_(std::make_unique<State>(pair)) {}
FullMeshes::~FullMeshes() = default;

double FullMeshes::cast_m(const spatial::Pose& X_CT, std::uint32_t samples) const {
  const spatial::Pose X_TC = spatial::inverse(X_CT);
  const glm::dvec3 up_T = spatial::rotate(X_TC, {0, 0, 1});
  const glm::dvec2 step = (kPlateWindow.high - kPlateWindow.low) / static_cast<double>(samples);
  double best_m = -std::numeric_limits<double>::infinity();
  for (std::uint32_t j = 0; j < samples; ++j) {
    for (std::uint32_t i = 0; i < samples; ++i) {
      const glm::dvec2 uv = kPlateWindow.low + step * glm::dvec2{i + 0.5, j + 0.5};
      const double s_z = static_cast<double>(kFar_m) - cast(state_->s_scene, {uv, kFar_m}, {0, 0, -1});
      const double t_z =
          cast(state_->t_scene, spatial::transform_point(X_TC, {uv, -kFar_m}), up_T) - static_cast<double>(kFar_m);
      if (std::isfinite(s_z) && std::isfinite(t_z)) best_m = std::max(best_m, s_z - t_z);
    }
  }
  return best_m;
}

double FullMeshes::exact_m(const spatial::Pose& X_CT) const {
  const State& m = *state_;
  for (std::size_t i = 0; i < m.t.vertices.size(); ++i) {
    m.t_moved[i] = spatial::transform_point(X_CT, m.t.vertices[i]);
  }
  const double per_quad = kSide / kPlateWidth_m;
  const auto quad = [&](double x, double shift) {
    return static_cast<std::size_t>(
        std::clamp(std::floor((x + 0.5 * kPlateWidth_m) * per_quad + shift), 0.0, kSide - 1.0));
  };
  double best_m = -std::numeric_limits<double>::infinity();
  for (const auto& triangle : m.t.triangles) {
    const Flat t = flattened(m.t_moved[triangle[0]], m.t_moved[triangle[1]], m.t_moved[triangle[2]]);
    const glm::dvec2 low = glm::min(glm::min(t.corners[0], t.corners[1]), t.corners[2]);
    const glm::dvec2 high = glm::max(glm::max(t.corners[0], t.corners[1]), t.corners[2]);
    if (low.x > kPlateWindow.high.x || high.x < kPlateWindow.low.x || low.y > kPlateWindow.high.y ||
        high.y < kPlateWindow.low.y) {
      continue;
    }
    for (std::size_t j = quad(low.y, 0); j <= quad(high.y, 0); ++j) {
      for (std::size_t i = quad(low.x, 0); i <= quad(high.x, 0); ++i) {
        for (std::size_t half = 0; half < 2; ++half) {
          const auto& corners = m.s.triangles[2 * (j * kSide + i) + half];
          const Flat s = flattened(m.s.vertices[corners[0]], m.s.vertices[corners[1]], m.s.vertices[corners[2]]);
          std::array<glm::dvec2, 9> polygon{t.corners[0], t.corners[1], t.corners[2]};
          std::size_t count = 3;
          for (const glm::dvec3& edge : s.edges) {  // Sutherland and Hodgman 1974
            std::array<glm::dvec2, 9> kept;
            std::size_t n = 0;
            for (std::size_t k = 0; k < count; ++k) {
              const glm::dvec2 p = polygon[k], q = polygon[(k + 1) % count];
              const double at_p = value(edge, p), at_q = value(edge, q);
              if (at_p >= 0) kept[n++] = p;
              if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) kept[n++] = p + (q - p) * (at_p / (at_p - at_q));
            }
            polygon = kept;
            count = n;
          }
          for (std::size_t k = 0; k < count; ++k) best_m = std::max(best_m, value(s.plane - t.plane, polygon[k]));
        }
      }
    }
  }
  return best_m;
}

}  // namespace farfeel::bench
