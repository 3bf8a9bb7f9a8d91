// The ball's middle walks on the surface that is one distance from the mesh: a step along the way's direction, then
// straight from or to the mesh's nearest point until the distance is right. Across an edge the direction goes on as the
// last step went; along it it is the edge's. The way ends where there is no such place: in a corner that the ball does
// not fit in.
#include "tests/bench/touch_edges.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

namespace farfeel::bench {
namespace {

using glm::dvec3;

constexpr double kStraightCosine = 0.7071;                 // of 45 degrees
constexpr double kHalfWay_m = 12e-3, kLeastWay_m = 3e-3;   // to either side of the edge; in all
constexpr double kLeastStep_m = 0.1e-3, kAnswer_s = 1e-3;  // the service is asked so often, but no more closely
constexpr double kSlowest_m_s = 10e-3, kFastest_m_s = 0.3;
constexpr double kFlattest = 0.1;         // of the edge's own angle: so near its triangles the ball may come
constexpr double kLongestWayIn_m = 6e-3;  // of the press
constexpr int kMostMoves = 12, kMostDraws = 40;
constexpr double kShortestMove = 0.3;  // of a step: shorter, and it is stuck in a corner

/// Onto the surface that is away_m from the mesh.
std::optional<dvec3> moved_clear(const TouchTruth& truth, dvec3 p_O, double away_m) {
  for (int i = 0; i < kMostMoves; ++i) {
    const TouchTruth::Nearest nearest = truth.nearest(p_O);
    if (std::abs(nearest.distance_m - away_m) < kClearWithin_m) return p_O;
    if (!(nearest.distance_m > 0)) return std::nullopt;
    p_O = nearest.q_O + (away_m / nearest.distance_m) * (p_O - nearest.q_O);
  }
  return std::nullopt;
}

/// Places after p_O, which is clear. edge: which to go along; else straight on.
std::vector<dvec3> walked(const TouchSubject& subject, const FreeEdges& edges, std::optional<FreeEdge> edge, dvec3 p_O,
                          dvec3 direction_O, double away_m, double step_m) {
  std::vector<dvec3> way;
  double left_m = edge ? glm::length(edges.along_O(*edge)) : 0;  // of the edge at hand
  for (double gone_m = 0; gone_m < kHalfWay_m; gone_m += step_m) {
    while (edge && left_m <= 0) {
      edge = edges.after(*edge);
      if (!edge) return way;
      left_m += glm::length(edges.along_O(*edge));
    }
    if (edge) direction_O = glm::normalize(edges.along_O(*edge));
    left_m -= step_m;
    const auto next = moved_clear(subject.truth, p_O + step_m * direction_O, away_m);
    if (!next || glm::distance(*next, p_O) < kShortestMove * step_m) return way;
    direction_O = glm::normalize(*next - p_O);
    way.push_back(p_O = *next);
  }
  return way;
}

}  // namespace

FreeEdges::FreeEdges(const geometry::TriangleMesh& mesh) : mesh_(mesh), at_vertex_(mesh.positions_O.size()) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> triangle_of;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) triangle_of[{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}] = t;
  }
  double length_m = 0;
  for (const auto& [ends, left] : triangle_of) {
    const auto other = triangle_of.find({ends.second, ends.first});
    if (ends.first > ends.second || other == triangle_of.end()) continue;
    const geometry::Triangle& beyond = mesh.triangles[other->second];
    const FreeEdge edge{ends.first, ends.second, geometry::unit_normal(mesh, mesh.triangles[left]),
                        geometry::unit_normal(mesh, beyond)};
    const bool is_convex = std::all_of(beyond.begin(), beyond.end(), [&](std::uint32_t v) {
      return v == edge.from || v == edge.to || glm::dot(mesh.positions_O[v] - from_O(edge), edge.nhat_left_O) < 0;
    });
    const double cosine = glm::dot(edge.nhat_left_O, edge.nhat_right_O);
    const bool has_area = glm::length(edge.nhat_left_O) > 0.5 && glm::length(edge.nhat_right_O) > 0.5;
    if (!is_convex || !has_area || cosine > std::cos(kLeastTurn_rad)) continue;
    for (const std::uint32_t v : {edge.from, edge.to})
      at_vertex_[v].push_back(static_cast<std::uint32_t>(edges_.size()));
    edges_.push_back(edge);
    length_up_to_m_.push_back(length_m += glm::length(along_O(edge)));
  }
}

const FreeEdge& FreeEdges::at_share(double share) const {
  const auto found = std::lower_bound(length_up_to_m_.begin(), length_up_to_m_.end(), share * length_up_to_m_.back());
  return edges_[std::min<std::size_t>(found - length_up_to_m_.begin(), edges_.size() - 1)];
}

FreeEdge FreeEdges::reversed(const FreeEdge& e) {
  return {e.to, e.from, e.nhat_right_O, e.nhat_left_O};
}

std::optional<FreeEdge> FreeEdges::after(const FreeEdge& edge) const {
  std::optional<FreeEdge> best;
  double straightest = kStraightCosine;
  for (const std::uint32_t i : at_vertex_[edge.to]) {
    const FreeEdge next = edges_[i].from == edge.to ? edges_[i] : reversed(edges_[i]);
    if (next.to == edge.from) continue;
    const double cosine = glm::dot(glm::normalize(along_O(next)), glm::normalize(along_O(edge)));
    if (cosine > straightest) straightest = cosine, best = next;
  }
  return best;
}

std::optional<Passage> passage_on(const TouchSubject& subject, const FreeEdges& edges, const TouchTool& ball,
                                  double clear_m, std::uint64_t seed, std::uint32_t index) {
  if (edges.is_empty()) return std::nullopt;
  std::mt19937_64 random(seed_of(subject.baked.asset.name, ball.name, seed, index));
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  const double away_m = ball.shape.radius_m + clear_m;
  for (int draw = 0; draw < kMostDraws; ++draw) {
    const FreeEdge& edge = edges.at_share(unit(random));
    const dvec3 along_O = edges.along_O(edge), p_edge_O = edges.from_O(edge) + unit(random) * along_O;
    const double share = kFlattest + (1 - 2 * kFlattest) * unit(random);
    Passage passage;
    passage.is_across = unit(random) < 0.5;
    const glm::dquat R_OT = glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random)));
    passage.speed_m_s = kSlowest_m_s * std::pow(kFastest_m_s / kSlowest_m_s, unit(random));
    passage.step_m = std::max(kLeastStep_m, kAnswer_s * passage.speed_m_s);
    const dvec3 out_O = glm::normalize(glm::mix(edge.nhat_left_O, edge.nhat_right_O, share));
    const dvec3 start_O = p_edge_O + away_m * out_O;
    if (std::abs(subject.truth.nearest(start_O).distance_m - away_m) > kClearWithin_m) continue;
    const auto walk = [&](const FreeEdge& from) {
      const dvec3 direction_O = passage.is_across ? glm::cross(out_O, edges.along_O(from)) : edges.along_O(from);
      return walked(subject, edges, passage.is_across ? std::nullopt : std::optional(from), start_O,
                    glm::normalize(direction_O), away_m, passage.step_m);
    };
    const std::vector<dvec3> back = walk(FreeEdges::reversed(edge)), on = walk(edge);
    passage.p_O.assign(back.rbegin(), back.rend());
    passage.p_O.push_back(start_O);
    passage.p_O.insert(passage.p_O.end(), on.begin(), on.end());
    if (static_cast<double>(passage.p_O.size()) * passage.step_m < kLeastWay_m) continue;
    passage.pressed = {.p_touch_O = p_edge_O + ball.shape.radius_m * out_O,
                       .out_O = out_O,
                       .R_OT = R_OT,
                       .speed_m_s = passage.speed_m_s};
    passage.pressed.free_way_m = free_way_m(subject, ball, passage.pressed, kLongestWayIn_m);
    return passage;
  }
  return std::nullopt;
}

}  // namespace farfeel::bench
