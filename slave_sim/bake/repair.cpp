#include "slave_sim/bake/repair.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>

#include "haptic_core/spatial/spatial.h"
#include "slave_sim/bake/mass.h"
#include "slave_sim/bake/shared_edges.h"
#include "slave_sim/bake/shells.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kJoin = 1e-6;    // corners nearer than this share of the size are one
constexpr double kOnEdge = 1e-5;  // a vertex nearer than this share of the size to an edge lies on it
constexpr double kSpeck = 1e-3;   // a shell with less than this share of the area, unless it is most of it, is a speck
constexpr double kLargestHole = 1.0 / 3;  // of the size
constexpr double kSmallest_m = 1e-3, kLargest_m = 10;

tl::unexpected<RepairError> refused(std::string why) {
  return tl::unexpected(RepairError{std::move(why)});
}

std::string at(const glm::dvec3& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x, p.y, p.z);
}

/// Corners within a cell's width of each other get one vertex: the first of them in the file.
std::size_t join_corners(TriangleMesh& mesh, double width_m) {
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> kept;  // by cell
  const glm::dvec3 low = geometry::bounding_box(mesh).low;  // cells are counted from here: far away they would overflow
  const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::uint64_t>(x) * 0x9E37'79B9'7F4A'7C15 ^
           static_cast<std::uint64_t>(y) * 0xC2B2'AE3D'27D4'EB4F ^
           static_cast<std::uint64_t>(z) * 0x1656'67B1'9E37'79F9;
  };
  std::vector<std::uint32_t> name(mesh.positions_O.size(), kNone);
  std::vector<glm::dvec3> positions;
  for (std::size_t v = 0; v < mesh.positions_O.size(); ++v) {
    const glm::dvec3 p = mesh.positions_O[v], cell = glm::floor((p - low) / width_m);
    const auto x = static_cast<std::int64_t>(cell.x), y = static_cast<std::int64_t>(cell.y),
               z = static_cast<std::int64_t>(cell.z);
    for (int n = 0; n < 27 && name[v] == kNone; ++n) {
      const auto found = kept.find(key(x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1));
      if (found == kept.end()) continue;
      for (const std::uint32_t other : found->second) {
        const glm::dvec3 apart = positions[other] - p;
        if (glm::dot(apart, apart) <= width_m * width_m) name[v] = other;
      }
    }
    if (name[v] != kNone) continue;
    name[v] = static_cast<std::uint32_t>(positions.size());
    kept[key(x, y, z)].push_back(name[v]);
    positions.push_back(p);
  }
  const std::size_t joined = mesh.positions_O.size() - positions.size();
  mesh.positions_O = std::move(positions);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = name[v];
  }
  return joined;
}

/// Triangles that name a vertex twice; copies of another (all but one); pairs back to back (both).
std::array<std::size_t, 2> drop_degenerate_and_doubled(TriangleMesh& mesh) {
  std::vector<std::pair<Triangle, std::uint32_t>> by_corners;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    Triangle t = mesh.triangles[i];
    std::sort(t.begin(), t.end());
    if (t[0] != t[1] && t[1] != t[2]) by_corners.emplace_back(t, i);
  }
  std::sort(by_corners.begin(), by_corners.end());
  const std::size_t degenerate = mesh.triangles.size() - by_corners.size();
  const auto is_even = [&](std::uint32_t i) {
    const Triangle& t = mesh.triangles[i];
    return (t[0] < t[1]) + (t[1] < t[2]) + (t[2] < t[0]) == 2;
  };
  std::vector<bool> is_kept(mesh.triangles.size());
  std::size_t kept = 0;
  for (std::size_t i = 0, end = 0; i < by_corners.size(); i = end) {
    std::array<std::size_t, 2> copies{};  // odd, even
    std::array<std::uint32_t, 2> last{};
    for (end = i; end < by_corners.size() && by_corners[end].first == by_corners[i].first; ++end) {
      const bool even = is_even(by_corners[end].second);
      ++copies[even];
      last[even] = by_corners[end].second;
    }
    if (copies[0] == copies[1]) continue;  // as many this way as that way: a fold, nothing inside
    is_kept[last[copies[1] > copies[0]]] = true;
    ++kept;
  }
  const std::size_t doubled = mesh.triangles.size() - degenerate - kept;
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (is_kept[i]) triangles.push_back(mesh.triangles[i]);
  }
  mesh.triangles = std::move(triangles);
  return {degenerate, doubled};
}

std::size_t drop_specks(TriangleMesh& mesh, Shells& shells) {
  std::vector<double> area(shells.count);
  double whole = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const glm::dvec3& a = mesh.positions_O[t[0]];
    const double own = 0.5 * glm::length(glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a));
    area[shells.of_triangle[i]] += own;
    whole += own;
  }
  const auto is_speck = [&](std::uint32_t shell) { return area[shell] < kSpeck * whole; };
  std::size_t dropped = 0;
  for (std::uint32_t shell = 0; shell < shells.count; ++shell) dropped += is_speck(shell);
  if (dropped == 0 || dropped == shells.count) return 0;
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!is_speck(shells.of_triangle[i])) triangles.push_back(mesh.triangles[i]);
  }
  mesh.triangles = std::move(triangles);
  return dropped;
}

/// The borders as closed walks over vertices, in the direction in which new triangles must run along them.
tl::expected<std::vector<std::vector<std::uint32_t>>, RepairError> holes_of(const TriangleMesh& mesh,
                                                                            const Edges& edges) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> next;
  for (const auto& [key, sharing] : edges) {
    if (sharing.size() != 1) continue;
    const auto a = static_cast<std::uint32_t>(key >> 32), b = static_cast<std::uint32_t>(key & kNone);
    const bool runs_ab = runs(mesh.triangles[sharing[0]], a, b);
    next[runs_ab ? b : a].push_back(runs_ab ? a : b);
  }
  std::vector<std::vector<std::uint32_t>> holes;
  while (!next.empty()) {
    std::vector<std::uint32_t> hole;
    std::uint32_t v = next.begin()->first;
    const std::uint32_t first = v;
    do {
      const auto found = next.find(v);
      if (found == next.end())
        return refused("the surface's borders do not close; close its holes in a mesh editor first");
      hole.push_back(v);
      v = found->second.back();
      found->second.pop_back();
      if (found->second.empty()) next.erase(found);
    } while (v != first);
    holes.push_back(std::move(hole));
  }
  return holes;
}

/// A fan from the middle of each hole.
std::string close_holes(TriangleMesh& mesh, const std::vector<std::vector<std::uint32_t>>& holes, double size_m) {
  for (const std::vector<std::uint32_t>& hole : holes) {
    geometry::Box box;
    glm::dvec3 sum(0);
    for (const std::uint32_t v : hole) box.include(mesh.positions_O[v]), sum += mesh.positions_O[v];
    const double extent_m = glm::length(box.size());
    if (extent_m > kLargestHole * size_m) {
      return fmt::format(
          "it has an opening {:.3g} m across near {}, too large to close by guessing; close it in a mesh editor first",
          extent_m, at(box.centre()));
    }
    if (hole.size() == 3) {
      mesh.triangles.push_back({hole[0], hole[1], hole[2]});
      continue;
    }
    const auto middle = static_cast<std::uint32_t>(mesh.positions_O.size());
    mesh.positions_O.push_back(sum / static_cast<double>(hole.size()));
    for (std::size_t i = 0; i < hole.size(); ++i)
      mesh.triangles.push_back({hole[i], hole[(i + 1) % hole.size()], middle});
  }
  return {};
}

/// Where the triangles round one vertex form several fans (the surface touches itself in a point), each gets its own.
std::size_t split_pinched(TriangleMesh& mesh) {
  std::unordered_map<std::uint64_t, std::uint32_t> corner_after;  // directed edge -> the triangle that runs along it
  std::vector<std::uint32_t> corners_left(mesh.positions_O.size()), first(mesh.positions_O.size(), kNone);
  const auto directed = [](std::uint64_t from, std::uint64_t to) { return from << 32 | to; };
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      corner_after[directed(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])] = i;
      ++corners_left[mesh.triangles[i][k]];
    }
  }
  const std::vector<Triangle> as_given = mesh.triangles;
  std::vector<std::array<bool, 3>> is_visited(as_given.size());
  std::size_t split = 0;
  for (std::uint32_t seed = 0; seed < as_given.size(); ++seed) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      if (is_visited[seed][corner]) continue;
      const std::uint32_t v = as_given[seed][corner];
      std::uint32_t name = v;
      if (first[v] != kNone) {  // a second fan round the same vertex
        name = static_cast<std::uint32_t>(mesh.positions_O.size());
        mesh.positions_O.push_back(mesh.positions_O[v]);
        ++split;
      }
      first[v] = seed;
      for (std::uint32_t t = seed;;) {  // across the edge that leaves v, round and round
        const std::size_t k =
            static_cast<std::size_t>(std::find(as_given[t].begin(), as_given[t].end(), v) - as_given[t].begin());
        if (is_visited[t][k]) break;
        is_visited[t][k] = true;
        mesh.triangles[t][k] = name;
        t = corner_after.at(directed(v, as_given[t][(k + 2) % 3]));
      }
    }
  }
  return split;
}

void drop_unused(TriangleMesh& mesh) {
  std::vector<std::uint32_t> name(mesh.positions_O.size(), kNone);
  std::vector<glm::dvec3> positions;
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) {
      if (name[v] == kNone)
        name[v] = static_cast<std::uint32_t>(positions.size()), positions.push_back(mesh.positions_O[v]);
      v = name[v];
    }
  }
  mesh.positions_O = std::move(positions);
}

}  // namespace

tl::expected<Repaired, RepairError> repaired(const TriangleMesh& given, double metres_per_unit) {
  Repaired out{.mesh = given, .notes = {}};
  TriangleMesh& mesh = out.mesh;
  const auto note = [&](std::size_t count, std::string_view what) {
    if (count > 0) out.notes.push_back(fmt::format("{} {}", count, what));
  };
  drop_unused(mesh);
  if (mesh.triangles.empty()) return refused("it has no triangles");
  for (std::size_t i = 0; i < mesh.positions_O.size(); ++i) {
    mesh.positions_O[i] *= metres_per_unit;
    if (!spatial::is_finite(mesh.positions_O[i])) {
      return refused(fmt::format("a coordinate of vertex {} is not a finite number; export the mesh again", i));
    }
  }
  const double size_m = glm::length(geometry::bounding_box(mesh).size());
  if (!(size_m >= kSmallest_m && size_m <= kLargest_m)) {
    return refused(fmt::format("it is {:.3g} m across, outside 1 mm .. 10 m; say its unit, as in --unit mm", size_m));
  }
  note(join_corners(mesh, kJoin * size_m), "corners joined with others in the same place");
  const auto [degenerate, doubled] = drop_degenerate_and_doubled(mesh);
  note(degenerate, "degenerate triangles dropped");
  note(doubled, "doubled triangles dropped");

  note(cut_at_t_junctions(mesh, kOnEdge * size_m), "edges cut where a vertex of their neighbours lay on them");

  Edges edges = edges_of(mesh);
  Shells shells = orient(mesh, edges);
  std::size_t turned = shells.turned;
  const glm::dvec3 first_turned = shells.first_O;
  const auto look_again = [&] {
    edges = edges_of(mesh);
    shells = orient(mesh, edges);
  };
  if (const std::size_t specks = drop_specks(mesh, shells); specks > 0) {
    note(specks, "specks (loose shells of almost no area) dropped");
    drop_unused(mesh);
    look_again();
  }
  if (mesh.triangles.empty()) return refused("nothing is left of it once degenerate and doubled triangles are dropped");
  if (const std::size_t parted = part_shared_edges(mesh, edges); parted > 0) {
    note(parted, "edges that solids shared parted, each solid with its own");
    look_again();
  }
  for (const auto& [key, sharing] : edges) {
    if (sharing.size() <= 2) continue;
    return refused(fmt::format(
        "{} triangles meet in one edge at {}, so it has no inside there; make it a manifold in a mesh editor first",
        sharing.size(), at(mesh.positions_O[key >> 32])));
  }
  if (shells.has_one_side) return refused("its surface has only one side (a Moebius strip), so it has no inside");
  if (turned > 0)
    note(turned, fmt::format("triangles turned to agree with their neighbours, the first at {}", at(first_turned)));

  const auto holes = holes_of(mesh, edges);
  if (!holes) return tl::unexpected(holes.error());
  if (const std::string why = close_holes(mesh, *holes, size_m); !why.empty()) return refused(why);
  note(holes->size(), "holes closed");
  if (!holes->empty()) look_again();
  note(split_pinched(mesh), "vertices split where the surface touched itself in a point");
  drop_unused(mesh);

  if (!geometry::is_closed_and_oriented(mesh))
    return refused("its holes could not be closed; close them in a mesh editor first");
  const Facing facing = face_by_depth(mesh, shells);
  if (facing.outwards + facing.inwards == shells.count) {
    out.notes.emplace_back("the whole surface turned: it faced inwards");
  } else {
    if (facing.outwards > 0)
      note(facing.outwards, fmt::format("shells turned outwards, the first at {}", at(facing.first_outwards_O)));
    if (facing.inwards > 0) {
      note(facing.inwards,
           fmt::format("shells that lie within another turned inwards, the first at {}: they are cavities; where they "
                       "are solid, leave them out of the file",
                       at(facing.first_inwards_O)));
    }
  }
  constexpr double kLeastVolume = 1e-9;                                                 // of the size's cube
  if (!(mass_properties(mesh, 1).mass_kg > kLeastVolume * size_m * size_m * size_m)) {  // in cubic metres
    return refused("it encloses no volume; give it a thickness first");
  }
  return out;
}

}  // namespace farfeel::slave_sim
