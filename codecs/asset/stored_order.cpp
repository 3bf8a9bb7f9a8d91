#include <algorithm>
#include <unordered_map>

#include "codecs/asset/felt_stream.h"
#include "codecs/asset/felt_triangles.h"

namespace farfeel::codecs {
namespace {

using geometry::HapticSurface;
using geometry::Triangle;

struct Order {
  std::vector<std::uint32_t> triangles;  ///< old numbers
  std::vector<std::size_t> turns;        ///< which of the old corners comes first
};

/// Across the newest open edge, as long as there is one with something behind it; then the next that is left.
Order order_along_edges(const geometry::TriangleMesh& mesh) {
  std::unordered_map<std::uint64_t, std::pair<std::uint32_t, std::size_t>> of_edge;  // triangle, corner
  const auto key = [](std::uint64_t from, std::uint64_t to) { return from << 32 | to; };
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) of_edge[key(v[k], v[(k + 1) % 3])] = {t, k};
  }
  Order order;
  std::vector<bool> is_taken(mesh.triangles.size());
  OpenEdges open(static_cast<std::uint32_t>(mesh.positions_O.size()));
  const auto take = [&](std::uint32_t t, std::size_t turn) {
    const Triangle& v = mesh.triangles[t];
    is_taken[t] = true;
    order.triangles.push_back(t), order.turns.push_back(turn);
    open.take({v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]});
  };
  for (std::uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (is_taken[seed]) continue;
    take(seed, 0);
    for (std::int32_t rank = 0; rank <= OpenEdges::kMostRank;) {
      const std::uint32_t edge = open.of_rank(rank);
      if (edge == OpenEdges::kNone) break;
      const auto behind = of_edge.find(key(open[edge].to, open[edge].from));
      if (behind == of_edge.end() || is_taken[behind->second.first]) {
        ++rank;
      } else {
        take(behind->second.first, behind->second.second);
        rank = 0;
      }
    }
  }
  return order;
}

/// Old numbers become new ones in the order in which they are asked for; those that nobody asks for come last.
class Renumbering {
 public:
  explicit Renumbering(std::size_t count) : new_of_(count, kNoVertex) {}
  std::uint32_t operator()(std::uint32_t old) {
    if (new_of_[old] == kNoVertex) new_of_[old] = static_cast<std::uint32_t>(old_of_.size()), old_of_.push_back(old);
    return new_of_[old];
  }
  template <typename Value>
  std::vector<Value> applied(const std::vector<Value>& in) {
    for (std::uint32_t old = 0; old < new_of_.size(); ++old) (void)(*this)(old);
    std::vector<Value> out;
    for (const std::uint32_t old : old_of_) out.push_back(in[old]);
    return out;
  }

 private:
  std::vector<std::uint32_t> new_of_, old_of_;
};

}  // namespace

HapticSurface stored_order(const HapticSurface& in) {
  HapticSurface out;
  out.scale = in.scale;
  out.piece_count = in.piece_count;
  const Order order = order_along_edges(in.coarse);
  Renumbering vertices(in.coarse.positions_O.size()), pieces(in.piece_count), charts(in.charts.size());
  for (std::size_t i = 0; i < order.triangles.size(); ++i) {
    const std::uint32_t old = order.triangles[i];
    const Triangle& v = in.coarse.triangles[old];
    Triangle& t = out.coarse.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) t[k] = vertices(v[(order.turns[i] + k) % 3]);
    out.triangle_piece.push_back(pieces(in.triangle_piece[old]));
    const std::uint32_t chart = in.triangle_chart[old];
    out.triangle_chart.push_back(chart == geometry::kNoChart ? chart : charts(chart));
  }
  out.coarse.positions_O = vertices.applied(in.coarse.positions_O);
  if (!in.piece_thickness_m.empty()) out.piece_thickness_m = pieces.applied(in.piece_thickness_m);
  for (geometry::Chart& chart : out.charts = charts.applied(in.charts)) {
    const std::size_t tiles = std::size_t{chart.tiles_across()} * chart.tiles_down(), first = chart.first_tile;
    chart.first_tile = static_cast<std::uint32_t>(out.tiles.size());
    for (std::size_t n = 0; n < tiles; ++n) out.tiles.push_back(in.tiles[first + n]);
  }
  return out;
}

geometry::TriangleMesh stored_order(const geometry::TriangleMesh& mesh) {
  HapticSurface surface;
  surface.coarse = mesh;
  surface.triangle_piece.assign(mesh.triangles.size(), 0);
  surface.triangle_chart.assign(mesh.triangles.size(), geometry::kNoChart);
  surface.piece_count = 1;
  return stored_order(surface).coarse;
}

}  // namespace farfeel::codecs
