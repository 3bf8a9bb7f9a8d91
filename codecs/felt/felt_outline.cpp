// The bytes, little-endian; PROTOCOL.md has the tables:
//   u32 "FFFO", u16 version 3, u16 bodies, f64 tolerance_m, f64 soft_width_m, u32 grid samples, u32 0, then each body:
//   pose X_WO, 4 f64 material, f64 height offset_m and scale_m, u32 vertices, triangles, pieces, charts,
//   vertices: 3 f32 each,
//   triangles: u32 x 3 vertices, u32 piece, u32 chart, f64 x 2 relief,
//   pieces: f32 thickness,
//   charts: pose X_OH, f64 texel_m, u32 columns, u32 rows, f64 most bend. Their tiles follow each other in the charts'
//   order.
#include "codecs/felt/felt_outline.h"

#include <algorithm>
#include <cmath>

#include "codecs/tile/coarse_level.h"
#include "codecs/tile/tile_codec.h"
#include "haptic_core/geometry/coarse_heights.h"
#include "haptic_core/geometry/piece_thickness.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using contact_service::FeltBody;
using contact_service::FeltScene;
using geometry::Chart;
using geometry::HapticSurface;
using penetration::HeightLimits;
using transport::ByteReader;
using transport::ByteWriter;

constexpr std::uint32_t kMagic = 0x4F46'4646;  // "FFFO"
constexpr std::uint16_t kVersion = 3;
constexpr double kMaxLength_m = 1e4;
constexpr double kMaxRelief_m = 1;
constexpr double kMaxBend_1_per_m = 1e15;
/// Of a second difference of coefficients that are each off by one, and a mixed one: what height_bounds.cpp adds up.
constexpr double kBendOfOneOff = 4 + 4;
constexpr std::size_t kHeadBytes = 32, kBodyBytes = 7 * 8 + 6 * 8 + 4 * 4 + 4;
constexpr std::size_t kVertexBytes = 12, kTriangleBytes = 36, kPieceBytes = 4, kChartBytes = 7 * 8 + 8 + 8 + 8;

bool is_within(double v, double low, double high) {
  return v >= low && v <= high;  // false for NaN
}
bool is_pose(const spatial::Pose& X) {
  return spatial::is_valid(X) && is_within(glm::length(X.p), 0, kMaxLength_m);
}
bool is_material(const contact::Material& m) {
  return is_within(m.stiffness_N_per_m, 0, 1e8) && is_within(m.damping_Ns_per_m, 0, 1e6) &&
         is_within(m.static_friction, 0, 100) && is_within(m.dynamic_friction, 0, 100);
}

void write_pose(ByteWriter& w, const spatial::Pose& X) {
  for (const double v : {X.p.x, X.p.y, X.p.z, X.R.w, X.R.x, X.R.y, X.R.z}) w.f64(v);
}
spatial::Pose read_pose(ByteReader& r) {
  spatial::Pose X;
  for (double* v : {&X.p.x, &X.p.y, &X.p.z, &X.R.w, &X.R.x, &X.R.y, &X.R.z}) *v = r.f64();
  return X;
}

/// How many tiles a chart has; 0 when there would be absurdly many.
std::uint32_t tile_count(const Chart& chart) {
  const std::uint64_t count = std::uint64_t{chart.tiles_across()} * chart.tiles_down();
  return chart.columns > 1u << 24 || chart.rows > 1u << 24 || count > kMaxFeltTiles ? 0
                                                                                    : static_cast<std::uint32_t>(count);
}

/// How far off heights may be that come as tiles: limits must hold for them too.
double heights_off_m(const HapticSurface& surface) {
  return nearness(surface).coefficients * surface.scale.scale_m;
}

/// What is wrong with a body, beyond what geometry::faults() finds; null if nothing.
const char* fault_of(const FeltBody& body) {
  const HapticSurface& surface = body.surface;
  if (!is_pose(body.X_WO)) return "a pose is none";
  if (!is_material(body.material)) return "a material is absurd";
  if (!is_within(surface.scale.scale_m, 1e-12, 1e-3) || !is_within(std::abs(surface.scale.offset_m), 0, kMaxLength_m))
    return "a height scale is absurd";
  if (!geometry::faults(surface).empty()) return "a surface has faults";
  for (const glm::dvec3& p : surface.coarse.positions_O) {
    if (!is_within(glm::length(p), 0, kMaxLength_m)) return "a vertex is beyond 10 km";
  }
  std::vector<bool> is_used(surface.piece_count, false);
  for (const std::uint32_t piece : surface.triangle_piece) is_used[piece] = true;
  if (std::find(is_used.begin(), is_used.end(), false) != is_used.end()) return "a piece has no triangle";
  for (const Chart& chart : surface.charts) {
    if (!is_pose(chart.X_OH) || !is_within(chart.texel_m, 1e-7, 1)) return "a chart is absurd";
  }
  for (const penetration::Relief& relief : body.limits.reliefs) {
    if (!is_within(relief.low_m, -kMaxRelief_m, relief.high_m) || !(relief.high_m <= kMaxRelief_m))
      return "a relief is absurd";
  }
  for (const double bend_1_per_m : body.limits.most_bends_1_per_m) {
    if (!is_within(bend_1_per_m, 0, kMaxBend_1_per_m)) return "a bend is absurd";
  }
  return nullptr;
}

tl::unexpected<std::string> wrong(const std::string& why) {
  return tl::unexpected("the outline of what is felt: " + why);
}

/// The coarsest level of a surface's heights, and what is known of the surface that it makes: limits must hold for that
/// too.
struct Coarsest {
  geometry::CoarseHeights level;
  HeightLimits limits;
};

/// to_come: of all bodies; those of this one count.
Coarsest coarsest_of(HapticSurface surface, std::size_t body, std::span<const contact::SurfaceEdit> to_come) {
  geometry::CoarseHeights level = geometry::coarse_heights(surface);
  for (const contact::SurfaceEdit& edit : to_come) {
    if (edit.where.surface == body) geometry::widen_bound(level, surface, edit.where.tile, edit.tile);
  }
  geometry::stand_in(surface, level);
  return {std::move(level), penetration::FeltSurface(surface).limits()};
}

/// Of all versions that its tiles will have.
HeightLimits limits_of(const contact_service::TouchableObject& of, std::size_t body,
                       std::span<const contact::SurfaceEdit> to_come) {
  const auto is_of_body = [&](const contact::SurfaceEdit& edit) { return edit.where.surface == body; };
  if (std::none_of(to_come.begin(), to_come.end(), is_of_body)) return of.prepared->limits();
  HapticSurface surface = *of.felt;
  penetration::FeltSurface later(surface, of.prepared->limits());
  for (const contact::SurfaceEdit& edit : to_come) {
    if (!is_of_body(edit)) continue;
    surface.tiles[edit.where.tile] = edit.tile;
    later.take_tile(edit.where.tile);
  }
  return later.limits();
}

const char* read_coarse_level(std::span<const std::byte> bytes, FeltBody& body) {
  HapticSurface& surface = body.surface;
  if (surface.charts.empty()) return bytes.empty() ? nullptr : "it has heights without charts";
  const auto level = decoded_coarse_level(surface, bytes);
  if (!level) return "its coarsest heights are none";
  geometry::stand_in(surface, *level);
  const double step_m = geometry::coarse_step(surface.scale) * surface.scale.scale_m;
  for (const std::uint16_t off : level->off) body.off_m.push_back(step_m * off);
  return nullptr;
}

/// Reads one body; what stops it, if anything. tiles: of all bodies so far.
const char* read_body(ByteReader& r, FeltBody& body, std::uint32_t& tiles) {
  HapticSurface& surface = body.surface;
  body.X_WO = read_pose(r);
  contact::Material& m = body.material;
  for (double* v : {&m.stiffness_N_per_m, &m.damping_Ns_per_m, &m.static_friction, &m.dynamic_friction}) *v = r.f64();
  surface.scale.offset_m = r.f64();
  surface.scale.scale_m = r.f64();
  const std::uint32_t vertices = r.u32(), triangles = r.u32(), pieces = r.u32(), charts = r.u32();
  if (!r.ok() || vertices < 3 || vertices > kMaxFeltTriangles || triangles == 0 || triangles > kMaxFeltTriangles ||
      pieces == 0 || pieces > triangles || charts > triangles)
    return "a count is out of bounds";
  if (r.remaining() <
      vertices * kVertexBytes + triangles * kTriangleBytes + pieces * kPieceBytes + charts * kChartBytes)
    return "it is cut short";
  surface.piece_count = pieces;
  surface.coarse.positions_O.resize(vertices);
  for (glm::dvec3& p : surface.coarse.positions_O) {
    for (int k = 0; k < 3; ++k) p[k] = r.f32();
  }
  for (std::uint32_t i = 0; i < triangles; ++i) {
    geometry::Triangle& triangle = surface.coarse.triangles.emplace_back();
    for (std::uint32_t& vertex : triangle) vertex = r.u32();
    surface.triangle_piece.push_back(r.u32());
    surface.triangle_chart.push_back(r.u32());
    const double low_m = r.f64(), high_m = r.f64();
    body.limits.reliefs.push_back({low_m, high_m});
  }
  for (std::uint32_t i = 0; i < pieces; ++i) surface.piece_thickness_m.push_back(r.f32());
  std::uint32_t own_tiles = 0;
  for (std::uint32_t i = 0; i < charts; ++i) {
    Chart& chart = surface.charts.emplace_back();
    chart.X_OH = read_pose(r);
    chart.texel_m = r.f64();
    chart.columns = r.u32();
    chart.rows = r.u32();
    body.limits.most_bends_1_per_m.push_back(r.f64());
    chart.first_tile = own_tiles;
    const std::uint32_t count = tile_count(chart);
    if (chart.columns == 0 || chart.rows == 0 || count == 0) return "a chart has no tiles, or too many";
    own_tiles += count;
    if (tiles + own_tiles > kMaxFeltTiles) return "it has too many tiles";
  }
  tiles += own_tiles;
  surface.tiles.resize(own_tiles);
  const std::uint32_t level_bytes = r.u32();
  const auto level = r.bytes(level_bytes);
  if (!r.ok()) return "it is cut short";
  if (const char* why = fault_of(body)) return why;
  return read_coarse_level(level, body);
}

}  // namespace

tl::expected<std::vector<std::byte>, std::string> write_felt_outline(
    std::span<const contact_service::TouchableObject> bodies, const contact_service::ContactOptions& options,
    std::span<const contact::SurfaceEdit> to_come) {
  if (bodies.size() < 2 || bodies.size() > kMaxFeltBodies) return wrong("there must be a tool and 1 to 256 objects");
  std::size_t size = kHeadBytes, tiles = 0;
  for (const auto& body : bodies) {
    const HapticSurface& surface = *body.felt;
    if (surface.coarse.triangles.size() > kMaxFeltTriangles || surface.coarse.positions_O.size() > kMaxFeltTriangles)
      return wrong("a coarse mesh has more than 65,536 triangles or vertices");
    size += kBodyBytes + surface.coarse.positions_O.size() * kVertexBytes +
            surface.coarse.triangles.size() * kTriangleBytes + surface.piece_count * kPieceBytes +
            surface.charts.size() * kChartBytes;
    std::uint32_t own_tiles = 0;
    for (const Chart& chart : surface.charts) {
      if (chart.first_tile != own_tiles) return wrong("a surface's tiles are not in its charts' order");
      own_tiles += tile_count(chart);
    }
    tiles += own_tiles;
  }
  if (tiles > kMaxFeltTiles) return wrong("the scene has more than 65,536 height tiles");

  std::vector<Coarsest> coarse;
  std::vector<std::vector<std::byte>> levels;
  std::vector<HeightLimits> limits;
  for (const auto& body : bodies) {
    limits.push_back(limits_of(body, limits.size(), to_come));
    coarse.push_back(coarsest_of(*body.felt, coarse.size(), to_come));
    levels.push_back(body.felt->is_textured() ? encoded_coarse_level(*body.felt, coarse.back().level)
                                              : std::vector<std::byte>());
    size += levels.back().size();
  }

  std::vector<std::byte> bytes(size);
  ByteWriter w(bytes);
  w.u32(kMagic);
  w.u16(kVersion);
  w.u16(static_cast<std::uint16_t>(bodies.size()));
  w.f64(options.tolerance_m);
  w.f64(options.soft_width_m);
  w.u32(options.grid_samples);
  w.u32(0);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const contact_service::TouchableObject& body = bodies[b];
    const HapticSurface& surface = *body.felt;
    write_pose(w, body.X_WO);
    const contact::Material& m = body.material;
    for (const double v : {m.stiffness_N_per_m, m.damping_Ns_per_m, m.static_friction, m.dynamic_friction,
                           surface.scale.offset_m, surface.scale.scale_m})
      w.f64(v);
    const auto u32 = [&w](std::size_t v) { w.u32(static_cast<std::uint32_t>(v)); };
    u32(surface.coarse.positions_O.size());
    u32(surface.coarse.triangles.size());
    u32(surface.piece_count);
    u32(surface.charts.size());
    for (const glm::dvec3& p : surface.coarse.positions_O) {
      for (int k = 0; k < 3; ++k) w.f32(p[k]);
    }
    for (std::uint32_t i = 0; i < surface.coarse.triangles.size(); ++i) {
      for (const std::uint32_t vertex : surface.coarse.triangles[i]) w.u32(vertex);
      w.u32(surface.triangle_piece[i]);
      w.u32(surface.triangle_chart[i]);
      const penetration::Relief& relief = limits[b].reliefs[i];
      const double off_m = relief.low_m < relief.high_m ? heights_off_m(surface) : 0;
      w.f64(std::min(relief.low_m - off_m, coarse[b].limits.reliefs[i].low_m));
      w.f64(std::max(relief.high_m + off_m, coarse[b].limits.reliefs[i].high_m));
    }
    for (const double thickness_m : geometry::piece_thickness_m(surface)) w.f32(thickness_m);
    for (std::uint32_t i = 0; i < surface.charts.size(); ++i) {
      const Chart& chart = surface.charts[i];
      write_pose(w, chart.X_OH);
      w.f64(chart.texel_m);
      w.u32(chart.columns);
      w.u32(chart.rows);
      w.f64(std::max(
          limits[b].most_bends_1_per_m[i] + kBendOfOneOff * heights_off_m(surface) / (chart.texel_m * chart.texel_m),
          coarse[b].limits.most_bends_1_per_m[i]));
    }
    u32(levels[b].size());
    w.bytes(levels[b]);
  }
  return bytes;
}

tl::expected<FeltScene, std::string> read_felt_outline(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  if (r.u32() != kMagic || r.u16() != kVersion) return wrong("it does not begin as one of version 3");
  const std::uint32_t bodies = r.u16();
  FeltScene scene;
  scene.tolerance_m = r.f64();
  scene.soft_width_m = r.f64();
  scene.grid_samples = r.u32();
  const std::uint32_t zero = r.u32();
  if (!r.ok() || zero != 0 || bodies < 2 || bodies > kMaxFeltBodies || !is_within(scene.tolerance_m, 1e-6, 1) ||
      !is_within(scene.soft_width_m, 0, 1) || scene.grid_samples < 1 || scene.grid_samples > penetration::kMaxSamples)
    return wrong("its head is cut short or out of bounds");
  std::uint32_t tiles = 0;
  for (std::uint32_t i = 0; i < bodies; ++i) {
    if (const char* why = read_body(r, scene.bodies.emplace_back(), tiles)) return wrong(why);
  }
  if (!r.is_at_end()) return wrong("its length does not fit its contents");
  return scene;
}

}  // namespace farfeel::codecs
