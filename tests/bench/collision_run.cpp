#include "tests/bench/collision_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

namespace farfeel::bench {
namespace {

constexpr double kDoubtful = 1e-9;      // of the tolerance: nearer to it, a pair may be reported or not
constexpr std::size_t kSmallHull = 24;  // points that the oracle takes without knowing their triangles

double quantile(const std::vector<double>& sorted, double q) {
  return sorted[std::min(sorted.size() - 1, std::size_t(q * double(sorted.size())))];
}

// A piece as the oracle sees it: from the surface itself, not from what the library under test made of it.
struct OraclePiece {
  support::PointHull hull;
  geometry::Box box;
  double size_m = 0;
};

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
    if (glm::length(area[i]) <= 1e-6 * total[i]) pieces[i].hull.outwards.clear();      // closed
    if (pieces[i].hull.points.size() <= kSmallHull) pieces[i].hull.triangles.clear();  // every triple counts
    if (!pieces[i].box.is_empty()) pieces[i].size_m = glm::length(pieces[i].box.size());
  }
  return pieces;
}

support::PointHull moved(support::PointHull h, const spatial::Pose& X) {
  for (auto& p : h.points) p = spatial::transform_point(X, p);
  for (auto& n : h.outwards) n = spatial::rotate(X, n);
  return h;
}

}  // namespace

Timing timing(CollisionPeer& peer, double tolerance_m, const std::vector<spatial::Pose>& motion, int replays,
              bool is_cold, std::vector<std::pair<double, double>>* pairs_and_us) {
  std::vector<PeerPair> pairs;
  pairs.reserve(1 << 14);
  std::vector<double> least_us(motion.size(), 1e300);
  std::vector<std::size_t> found(motion.size());
  for (int pass = 0; pass < replays; ++pass) {
    peer.forget();
    for (std::size_t i = 0; i < motion.size(); ++i) {
      if (is_cold) peer.forget();
      const auto start = std::chrono::steady_clock::now();
      peer.nearer_than(tolerance_m, motion[i], pairs);
      const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
      least_us[i] = std::min(least_us[i], took.count());
      found[i] = pairs.size();
    }
  }
  Timing result;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    result.pairs_mean += double(found[i]) / double(motion.size());
    if (pairs_and_us != nullptr) pairs_and_us->emplace_back(double(found[i]), least_us[i]);
  }
  std::sort(least_us.begin(), least_us.end());
  result.p50_us = quantile(least_us, 0.5), result.p95_us = quantile(least_us, 0.95);
  result.p99_us = quantile(least_us, 0.99), result.max_us = least_us.back();
  return result;
}

Accuracy accuracy(const BenchScene& scene, CollisionPeer& peer, const std::vector<spatial::Pose>& motion,
                  std::size_t stride, bool is_plain) {
  const auto pieces_s = oracle_pieces(scene.S), pieces_t = oracle_pieces(scene.T);
  Accuracy result;
  std::vector<PeerPair> pairs;
  for (std::size_t frame = 0; frame < motion.size(); ++frame) {
    peer.nearer_than(scene.tolerance_m, motion[frame], pairs);  // every frame: its memory is part of the question
    if (frame % stride != 0) continue;
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> found;
    for (const PeerPair& p : pairs) found[{p.piece_s, p.piece_t}] = p.distance_m;
    for (std::uint32_t t = 0; t < pieces_t.size(); ++t) {
      const support::PointHull hull_t = moved(pieces_t[t].hull, motion[frame]);
      geometry::Box box_t;
      for (const auto& p : hull_t.points) box_t.include(p);
      for (std::uint32_t s = 0; s < pieces_s.size(); ++s) {
        const glm::dvec3 gap = glm::max(pieces_s[s].box.low - box_t.high, box_t.low - pieces_s[s].box.high);
        const auto it = found.find({s, t});
        if (it == found.end() && std::max({gap.x, gap.y, gap.z}) > scene.tolerance_m) continue;
        const auto truth = support::exact_proximity(pieces_s[s].hull, hull_t);
        const double distance = is_plain ? truth.plain_distance_m : truth.distance_m;
        const bool is_near = distance < scene.tolerance_m;
        const bool is_doubtful = std::abs(distance - scene.tolerance_m) < kDoubtful * scene.tolerance_m;
        if (it == found.end()) {
          result.missed += is_near && !is_doubtful;
          continue;
        }
        ++result.checked;
        result.extra += !is_near && !is_doubtful;
        const double error = std::abs(it->second - distance) / std::max(pieces_s[s].size_m, pieces_t[t].size_m);
        result.max_error_rel = std::isnan(error) ? 1e300 : std::max(result.max_error_rel, error);
      }
    }
  }
  return result;
}

}  // namespace farfeel::bench
