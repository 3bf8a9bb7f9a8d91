#include "slave_sim/bake/repair.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>

#include "haptic_core/spatial/spatial.h"
#include "slave_sim/bake/left_out.h"
#include "slave_sim/bake/mass.h"
#include "slave_sim/bake/shared_edges.h"
#include "slave_sim/bake/shells.h"
#include "slave_sim/bake/thicken.h"
#include "slave_sim/bake/unit_of_length.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kJoin = 1e-6;    // corners nearer than this share of the size are one
constexpr double kOnEdge = 1e-5;  // a vertex nearer than this share of the size to an edge lies on it
constexpr double kSpeck = 1e-3;   // a shell with less than this share of the area, unless it is most of it, is a speck
constexpr double kFin = 0.02;     // a sheet that hangs on an edge and is smaller than this share of the size
constexpr double kLargestHole = 1.0 / 3;  // of the size

tl::unexpected<RepairError> refused(std::string why, std::vector<std::string> notes = {}) {
  return tl::unexpected(RepairError{std::move(why), std::move(notes)});
}

std::string at(const glm::dvec3& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x, p.y, p.z);
}

struct Joined {
  std::size_t same = 0;  ///< as formats without indices repeat them
  Found apart;
};

/// Corners within a cell's width of each other get one vertex: the first of them in the file.
Joined join_corners(TriangleMesh& mesh, double width_m) {
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> kept;  // by cell
  const glm::dvec3 low = geometry::bounding_box(mesh).low;  // cells are counted from here: far away they would overflow
  const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::uint64_t>(x) * 0x9E37'79B9'7F4A'7C15 ^
           static_cast<std::uint64_t>(y) * 0xC2B2'AE3D'27D4'EB4F ^
           static_cast<std::uint64_t>(z) * 0x1656'67B1'9E37'79F9;
  };
  std::vector<std::uint32_t> name(mesh.positions_O.size(), kNone);
  std::vector<glm::dvec3> positions;
  Joined joined;
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
    if (name[v] != kNone) {
      if (positions[name[v]] == p) {
        ++joined.same;
      } else {
        joined.apart.add(p);
      }
      continue;
    }
    name[v] = static_cast<std::uint32_t>(positions.size());
    kept[key(x, y, z)].push_back(name[v]);
    positions.push_back(p);
  }
  mesh.positions_O = std::move(positions);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = name[v];
  }
  return joined;
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

struct Closed {
  Found holes;
  double widest_m = 0;
  std::string refusal;  ///< empty: all are closed
};

/// A fan from the middle of each hole that is not wider.
Closed close_holes(TriangleMesh& mesh, const std::vector<std::vector<std::uint32_t>>& holes, double widest_m) {
  Closed closed;
  for (const std::vector<std::uint32_t>& hole : holes) {
    geometry::Box box;
    glm::dvec3 sum(0);
    for (const std::uint32_t v : hole) box.include(mesh.positions_O[v]), sum += mesh.positions_O[v];
    const double extent_m = glm::length(box.size());
    if (extent_m > widest_m) {
      if (closed.refusal.empty())
        closed.refusal = fmt::format(
            "it has an opening {:.3g} m across near {}{}, too large to close by guessing: --close says up to what "
            "width "
            "openings are filled, --thicken makes a sheet of what is open, or close it in a mesh editor",
            extent_m, at(box.centre()), holes.size() > 1 ? fmt::format(", one of {}", holes.size()) : "");
      continue;
    }
    closed.holes.add(box.centre());
    closed.widest_m = std::max(closed.widest_m, extent_m);
    if (hole.size() == 3) {
      mesh.triangles.push_back({hole[0], hole[1], hole[2]});
      continue;
    }
    const auto middle = static_cast<std::uint32_t>(mesh.positions_O.size());
    mesh.positions_O.push_back(sum / static_cast<double>(hole.size()));
    for (std::size_t i = 0; i < hole.size(); ++i)
      mesh.triangles.push_back({hole[i], hole[(i + 1) % hole.size()], middle});
  }
  return closed;
}

/// Where the triangles round one vertex form several fans (the surface touches itself in a point), each gets its own.
Found split_pinched(TriangleMesh& mesh) {
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
  Found split;
  for (std::uint32_t seed = 0; seed < as_given.size(); ++seed) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      if (is_visited[seed][corner]) continue;
      const std::uint32_t v = as_given[seed][corner];
      std::uint32_t name = v;
      if (first[v] != kNone) {  // a second fan round the same vertex
        name = static_cast<std::uint32_t>(mesh.positions_O.size());
        mesh.positions_O.push_back(mesh.positions_O[v]);
        split.add(mesh.positions_O[v]);
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

/// What repaired() has done so far.
class Notes {
 public:
  explicit Notes(Repaired& out) : out_(out) {}
  void mended(const Found& found, std::string_view what, std::string_view more = "") {
    if (found.count == 0) return;
    out_.was_sound = false;
    out_.notes.push_back(fmt::format("{} {}, the first at {}{}", found.count, what, at(found.first_O), more));
  }
  void sound(std::size_t count, std::string_view what) {
    if (count > 0) out_.notes.push_back(fmt::format("{} {}", count, what));
  }

 private:
  Repaired& out_;
};

}  // namespace

tl::expected<Repaired, RepairError> repaired(const TriangleMesh& given, double metres_per_unit,
                                             const Openings& openings) {
  Repaired out{.mesh = given, .left_out = {}, .notes = {}};
  TriangleMesh& mesh = out.mesh;
  Notes notes(out);
  const auto refuse = [&](std::string why) { return refused(std::move(why), std::move(out.notes)); };
  drop_unused_vertices(mesh);
  if (mesh.triangles.empty()) return refuse("it has no triangles");
  for (std::size_t i = 0; i < mesh.positions_O.size(); ++i) {
    mesh.positions_O[i] *= metres_per_unit;
    if (!spatial::is_finite(mesh.positions_O[i])) {
      return refuse(fmt::format("a coordinate of vertex {} is not a finite number; export the mesh again", i));
    }
  }
  const double size_m = glm::length(geometry::bounding_box(mesh).size());
  if (!(size_m >= kSmallest_m && size_m <= kLargest_m)) {
    return refuse(fmt::format("it is {:.3g} m across, outside 1 mm .. 10 m; say what one unit is: {}", size_m,
                              units_that_fit(size_m / metres_per_unit)));
  }
  const Joined joined = join_corners(mesh, kJoin * size_m);
  notes.sound(joined.same, "corners joined with others in the same place");
  notes.mended(joined.apart, fmt::format("corners joined with others nearer than {:.2g} um", 1e6 * kJoin * size_m));
  const Doubled dropped = drop_degenerate_and_doubled(mesh);
  notes.mended(dropped.degenerate, "degenerate triangles dropped");
  notes.mended(dropped.doubled, "doubled triangles dropped");
  notes.mended(dropped.folded, "triangles that lie back to back dropped (sheets without thickness, or walls within)");
  append(out.left_out, dropped.folds);

  notes.mended(cut_at_t_junctions(mesh, kOnEdge * size_m),
               "edges cut where a vertex of their neighbours lay on them (T-junctions)");

  Edges edges = edges_of(mesh);
  Shells shells = orient(mesh, edges);
  const Found turned = shells.turned;
  const auto look_again = [&] {
    edges = edges_of(mesh);
    shells = orient(mesh, edges);
  };
  const auto take_out = [&](const LeftOut& found, std::string_view what) {
    if (found.shells.count == 0) return;
    notes.mended(found.shells, what, fmt::format("; together {:.2g} % of the area", 100 * found.area_share));
    append(out.left_out, found.mesh);
    drop_unused_vertices(mesh);
    look_again();
  };
  take_out(drop_fins(mesh, shells, edges, kFin * size_m), "fins (sheets that hang on an edge) dropped");
  take_out(drop_specks(mesh, shells, kSpeck), "specks (loose shells of almost no area) dropped");
  if (mesh.triangles.empty()) return refuse("nothing is left of it once degenerate and doubled triangles are dropped");
  if (const Found parted = part_shared_edges(mesh, edges); parted.count > 0) {
    notes.mended(parted, "edges that solids shared parted, each solid with its own");
    look_again();
  }
  Found crowded;
  std::size_t most = 0;
  for (const auto& [key, sharing] : edges) {
    if (sharing.size() <= 2) continue;
    crowded.add(mesh.positions_O[key >> 32]);
    if (crowded.count == 1) most = sharing.size();
  }
  if (crowded.count > 0) {
    return refuse(fmt::format(
        "{} triangles meet in one edge at {}, so it has no inside there{}; make it a manifold in a mesh editor first",
        most, at(crowded.first_O),
        crowded.count > 1 ? fmt::format(" (nor at {} more such edges)", crowded.count - 1) : ""));
  }
  if (shells.has_one_side) return refuse("its surface has only one side (a Moebius strip), so it has no inside");
  notes.mended(turned, "triangles turned to agree with their neighbours");

  const auto holes = holes_of(mesh, edges);
  if (!holes) return refuse(holes.error().message);
  const double widest_m = openings.widest_m.value_or(openings.thickness_m ? 0 : kLargestHole * size_m);
  const Closed closed = close_holes(mesh, *holes, widest_m);
  if (!closed.refusal.empty() && !openings.thickness_m) return refuse(closed.refusal);
  notes.mended(closed.holes, "holes closed", fmt::format("; the widest {:.3g} mm across", 1e3 * closed.widest_m));
  if (closed.holes.count > 0) look_again();
  if (!closed.refusal.empty()) {
    notes.mended(thicken_open_shells(mesh, shells, edges, *openings.thickness_m),
                 fmt::format("open sheets made {:.3g} mm thick, behind what is given", 1e3 * *openings.thickness_m));
    look_again();
    if (part_shared_edges(mesh, edges).count > 0) look_again();  // walls, where borders touch
  }
  notes.mended(split_pinched(mesh), "vertices split where the surface touched itself in a point");
  drop_unused_vertices(mesh);

  if (!geometry::is_closed_and_oriented(mesh))
    return refuse("its holes could not be closed; close them in a mesh editor first");
  const Facing facing = face_by_depth(mesh, shells);
  if (facing.outwards.count + facing.inwards.count == shells.count) {
    out.was_sound = false;
    out.notes.emplace_back("the whole surface turned: it faced inwards");
  } else {
    notes.mended(facing.outwards, "shells turned outwards");
    notes.mended(facing.inwards, "shells that lie within another turned inwards",
                 ": they are cavities; where they are solid, leave them out of the file");
  }
  notes.sound(facing.cavities, "of the shells lie within another as cavities");
  constexpr double kLeastVolume = 1e-9;                                                 // of the size's cube
  if (!(mass_properties(mesh, 1).mass_kg > kLeastVolume * size_m * size_m * size_m)) {  // in cubic metres
    return refuse("it encloses no volume; give it a thickness first");
  }
  out.left_out = outside_of(mesh, std::move(out.left_out));
  return out;
}

}  // namespace farfeel::slave_sim
