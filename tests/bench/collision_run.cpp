#include "tests/bench/collision_run.h"
#include "tests/support/quantile.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

namespace farfeel::bench {
namespace {

using support::quantile;

constexpr double kDoubtful = 1e-9;         // of the tolerance: nearer to it, a pair may be reported or not
constexpr std::uint32_t kMostTried = 200;  // points of which every triple is tried as a face

// A piece as the oracle sees it: from the surface itself, not from what the library under test made of it.
struct OraclePiece {
  support::PointHull hull;
  geometry::Box box;
  double size_m = 0;
};

// Triples of points with all others on one side: the hull's faces, coplanar ones in every way, found by trying. The
// tolerance only adds triples, which lie within the hull and so change nothing.
std::vector<std::array<std::uint32_t, 3>> outermost_triples(const std::vector<glm::dvec3>& points, double size_m) {
  std::vector<std::array<std::uint32_t, 3>> outermost;
  const auto n = std::uint32_t(points.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = i + 1; j < n; ++j) {
      for (std::uint32_t k = j + 1; k < n; ++k) {
        const glm::dvec3 c = glm::cross(points[j] - points[i], points[k] - points[i]);
        const double slack = 1e-9 * size_m * glm::length(c);
        bool above = false, below = false;
        for (std::uint32_t m = 0; m < n && !(above && below); ++m) {
          const double height = glm::dot(c, points[m] - points[i]);
          above = above || height > slack, below = below || height < -slack;
        }
        if (glm::length(c) > 0 && !(above && below)) outermost.push_back({i, j, k});
      }
    }
  }
  return outermost;
}

std::vector<OraclePiece> oracle_pieces(const geometry::HapticSurface& s) {
  std::vector<OraclePiece> pieces(s.piece_count);
  std::vector<std::map<std::uint32_t, std::uint32_t>> place(s.piece_count);
  std::vector<glm::dvec3> area(s.piece_count, glm::dvec3(0));
  std::vector<double> total(s.piece_count, 0);
  for (std::size_t t = 0; t < s.coarse.triangles.size(); ++t) {
    const std::uint32_t i = s.triangle_piece[t];
    OraclePiece& piece = pieces[i];
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = s.coarse.triangles[t][k];
      const auto [it, fresh] = place[i].try_emplace(v, std::uint32_t(piece.hull.points.size()));
      if (fresh) piece.hull.points.push_back(s.coarse.positions_O[v]), piece.box.include(s.coarse.positions_O[v]);
      corners[k] = it->second;
    }
    piece.hull.triangles.push_back(corners);
    const auto& p = s.coarse.positions_O;
    const auto& [a, b, c] = s.coarse.triangles[t];
    const glm::dvec3 twice = glm::cross(p[b] - p[a], p[c] - p[a]);
    if (!(glm::length(twice) > 0)) continue;
    area[i] += twice, total[i] += glm::length(twice);
    piece.hull.outwards.push_back(glm::normalize(twice));
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (glm::length(area[i]) <= 1e-6 * total[i]) pieces[i].hull.outwards.clear();  // closed
    if (!pieces[i].box.is_empty()) pieces[i].size_m = glm::length(pieces[i].box.size());
    // Of the largest, the gear's, every triangle is one of its hull's.
    if (pieces[i].hull.points.size() > kMostTried) continue;
    pieces[i].hull.triangles = outermost_triples(pieces[i].hull.points, pieces[i].size_m);
  }
  return pieces;
}

support::PointHull moved(support::PointHull h, const spatial::Pose& X) {
  for (auto& p : h.points) p = spatial::transform_point(X, p);
  for (auto& n : h.outwards) n = spatial::rotate(X, n);
  return h;
}

// What the oracle says of one frame.
using PairKey = std::pair<std::uint32_t, std::uint32_t>;
struct Truth {
  double distance_m, plain_m;
};

class Oracle {
 public:
  explicit Oracle(const BenchmarkScene& scene)
      : tolerance_m_(scene.tolerance_m),
        pieces_s_(oracle_pieces(scene.object.felt)),
        pieces_t_(oracle_pieces(scene.tool.felt)) {}

  // All pairs whose boxes are nearer than the tolerance.
  std::map<PairKey, Truth> look(const spatial::Pose& X_ST) {
    std::map<PairKey, Truth> all;
    for (std::uint32_t t = 0; t < pieces_t_.size(); ++t) {
      const support::PointHull hull_t = moved(pieces_t_[t].hull, X_ST);
      geometry::Box box_t;
      for (const auto& p : hull_t.points) box_t.include(p);
      for (std::uint32_t s = 0; s < pieces_s_.size(); ++s) {
        const glm::dvec3 gap = glm::max(pieces_s_[s].box.low - box_t.high, box_t.low - pieces_s_[s].box.high);
        if (std::max({gap.x, gap.y, gap.z}) <= tolerance_m_) all[{s, t}] = measure(s, hull_t);
      }
    }
    return all;
  }
  Truth measure(std::uint32_t s, const support::PointHull& hull_t) const {
    const auto truth = support::exact_proximity(pieces_s_[s].hull, hull_t);
    return {truth.distance_m, truth.plain_distance_m};
  }
  void judge(const std::map<PairKey, Truth>& truths, const std::vector<PeerPair>& pairs, bool is_plain,
             Accuracy& result) const {
    std::map<PairKey, double> found;
    for (const PeerPair& p : pairs) found[{p.piece_s, p.piece_t}] = p.distance_m;
    for (const auto& [key, truth] : truths) {
      const double distance = is_plain ? truth.plain_m : truth.distance_m;
      const bool is_doubtful = std::abs(distance - tolerance_m_) < kDoubtful * tolerance_m_;
      const auto it = found.find(key);
      if (it == found.end()) {
        result.missed += distance < tolerance_m_ && !is_doubtful;
        continue;
      }
      ++result.checked;
      result.extra += !(distance < tolerance_m_) && !is_doubtful;
      const double size = std::max(pieces_s_[key.first].size_m, pieces_t_[key.second].size_m);
      const double error = std::abs(it->second - distance) / size;
      result.max_error_rel = std::isnan(error) ? 1e300 : std::max(result.max_error_rel, error);
    }
    for (const auto& [key, distance] : found) result.extra += !truths.contains(key);  // their boxes are farther
  }

 private:
  double tolerance_m_;
  std::vector<OraclePiece> pieces_s_, pieces_t_;
};

}  // namespace

std::vector<Timing> timings(std::span<Entrant> entrants, double tolerance_m, const std::vector<spatial::Pose>& motion,
                            int replays, bool is_cold) {
  std::vector<Timing> results(entrants.size());
  for (Timing& r : results) r.pairs_and_us.assign(motion.size(), {0, 1e300});
  for (int pass = 0; pass < replays; ++pass) {
    for (std::size_t k = 0; k < entrants.size(); ++k) {
      CollisionPeer& peer = *entrants[k].peer;
      peer.forget();
      for (std::size_t i = 0; i < motion.size(); ++i) {
        if (is_cold) peer.forget();
        const auto start = std::chrono::steady_clock::now();
        peer.query(tolerance_m, motion[i]);
        const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
        auto& [found, least_us] = results[k].pairs_and_us[i];
        found = double(peer.pairs().size()), least_us = std::min(least_us, took.count());
      }
    }
  }
  for (Timing& r : results) {
    std::vector<double> times_us;
    for (const auto& [found, us] : r.pairs_and_us) {
      times_us.push_back(us), r.pairs_mean += found / double(motion.size());
    }
    std::sort(times_us.begin(), times_us.end());
    r.p50_us = quantile(times_us, 0.5), r.p95_us = quantile(times_us, 0.95);
    r.p99_us = quantile(times_us, 0.99), r.max_us = times_us.back();
  }
  return results;
}

std::vector<Accuracy> accuracies(const BenchmarkScene& scene, std::span<Entrant> entrants,
                                 const std::vector<spatial::Pose>& motion, std::size_t stride) {
  Oracle oracle(scene);
  std::vector<std::map<PairKey, Truth>> truths;
  for (std::size_t frame = 0; frame < motion.size(); frame += stride) truths.push_back(oracle.look(motion[frame]));
  std::vector<Accuracy> results(entrants.size());
  for (std::size_t k = 0; k < entrants.size(); ++k) {
    for (std::size_t frame = 0; frame < motion.size(); ++frame) {
      CollisionPeer& peer = *entrants[k].peer;
      peer.query(scene.tolerance_m, motion[frame]);  // every frame: its memory is part of the question
      if (frame % stride != 0) continue;
      oracle.judge(truths[frame / stride], peer.pairs(), entrants[k].is_plain, results[k]);
    }
  }
  return results;
}

}  // namespace farfeel::bench
