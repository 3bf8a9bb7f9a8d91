// Distance of a pair (p, n) to a cluster (q, m), 1 at the cluster's rim:
//   D = |p - q|^2 / radius^2 + (1 - n.m) / (1 - cos angle).
// A pair joins the nearest cluster with D < 1; it leaves its own only when D > kLeave or another is nearer by kSwitch.
// Pairs that no cluster takes found new ones, the weightiest first; where there are enough, each goes on with its own
// unless another is nearer by kSwitch. Two clusters nearer than kMerge become one.
//
// A line or a face that lies on another touches all along it, but a witness is one of its ends, and which shows a tilt
// of microradians. So a pair lies between the place of its witness and the one that this hopped from, and p is the
// place between them that is nearest to q: a peg in its hole would else lose all its clusters at every other tremor.
#include "haptic_core/contact/tracking/clustering.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/tracking/constants.h"

namespace farfeel::contact {
namespace {

using collision::ProximityPair;
using glm::dot;
using glm::dvec3;

constexpr std::uint8_t kNone = 0xFF;

struct Pair {
  std::uint64_t key;  // (piece_s, piece_t)
  dvec3 p, n;
  dvec3 hopped_from;  // p where it has not
  double distance, weight;
  std::uint8_t owner;
  std::uint8_t last_owner;  // until clusters are removed
};

std::uint64_t key_of(const ProximityPair& p) {
  return std::uint64_t(p.piece_s) << 32 | p.piece_t;
}

// Turns unit `from` towards unit `to` by at most `most` radians.
dvec3 turned(const dvec3& from, const dvec3& to, double most) {
  const double cosine = dot(from, to), sine = glm::length(glm::cross(from, to));
  const double angle = std::atan2(sine, cosine);
  if (angle <= most) return to;
  dvec3 across = to - cosine * from;
  if (!(glm::length(across) > 1e-9)) {  // opposite: any way round
    across = glm::cross(from, std::abs(from.x) < 0.6 ? dvec3(1, 0, 0) : dvec3(0, 1, 0));
  }
  return glm::normalize(std::cos(most) * from + std::sin(most) * glm::normalize(across));
}

}  // namespace

struct Clustering::State {
  ClusteringOptions options;
  std::vector<Pair> pairs, last_pairs;
  std::vector<Cluster> clusters, reported;  // reported: the same by falling weight
  std::vector<dvec3> sum_p, sum_n;
  std::vector<std::uint32_t> order;
  std::uint32_t last_id = 0;
  double radius2 = 0, angle = 0, fastest = 0;

  explicit State(const ClusteringOptions& o) : options(o) {
    options.max_clusters = std::clamp<std::uint32_t>(o.max_clusters, 1, kMaxContacts);
    pairs.reserve(o.max_pairs), last_pairs.reserve(o.max_pairs), order.reserve(o.max_pairs);
    clusters.reserve(kMaxContacts + 1), reported.reserve(kMaxContacts + 1);
    sum_p.reserve(kMaxContacts + 1), sum_n.reserve(kMaxContacts + 1);
    angle = 1 - std::cos(o.angle_rad);
  }

  // Opposed directions are far apart whatever the place. Among more than six some are not, so that clusters which are
  // too many never have to join the two walls of a slot.
  double distance(const dvec3& p, const dvec3& n, const dvec3& q, const dvec3& m) const {
    const double cosine = dot(n, m);
    return dot(p - q, p - q) / radius2 + (1 - cosine) / angle + (cosine < 0 ? kOpposed : 0);
  }
  double distance(const Pair& pair, const Cluster& c) const {
    const dvec3 back = pair.hopped_from - pair.p;
    const double length2 = dot(back, back);
    const double share = length2 > 0 ? std::clamp(dot(c.p_S - pair.p, back) / length2, 0.0, 1.0) : 0;
    return distance(pair.p + share * back, pair.n, c.p_S, c.nhat_ST_S);
  }

  // The other end of where a pair lies whose witness is at p now.
  static dvec3 place_left(const Pair& before, const dvec3& p, double hop_m, double kept) {
    const double way_m = glm::distance(p, before.p);
    if (way_m <= hop_m) return p + kept * std::exp(-way_m / kHopKept_m) * (before.hopped_from - before.p);
    return glm::distance(p, before.hopped_from) > way_m ? before.hopped_from : before.p;
  }

  // Takes the pairs that weigh something, who owned them last time and where they hopped from: further than a cluster
  // may follow.
  void take(std::span<const ProximityPair> from, double tolerance, double dt_s) {
    std::swap(pairs, last_pairs);
    pairs.clear();
    fastest = 0;
    const double hop_m = options.point_m_per_s * dt_s, kept = std::exp(-dt_s / kHopKept_s);
    std::size_t last = 0;
    for (const ProximityPair& f : from) {
      if (pairs.size() == options.max_pairs) break;
      const double weight = std::min(tolerance - f.distance_m, kMostWeight * tolerance) * squareness(f.facing);
      if (!(weight > 0)) continue;
      const dvec3 p = 0.5 * (f.p_Ss_S + f.p_St_S);
      Pair pair{key_of(f), p, f.nhat_ST_S, p, f.distance_m, weight, kNone, kNone};
      while (last < last_pairs.size() && last_pairs[last].key < pair.key) ++last;
      if (last < last_pairs.size() && last_pairs[last].key == pair.key) {
        const Pair& before = last_pairs[last];
        pair.owner = pair.last_owner = before.owner;
        fastest = std::max(fastest, std::abs(pair.distance - before.distance));
        if (dot(pair.n, before.n) > kSameSideCosine && !ablated(Mechanism::kWitnessHops))
          pair.hopped_from = place_left(before, p, hop_m, kept);
      }
      pairs.push_back(pair);
    }
  }

  void assign() {
    for (Pair& pair : pairs) {
      std::uint8_t best = kNone;
      double least = 1;
      for (std::size_t c = 0; c < clusters.size(); ++c) {
        const double d = distance(pair, clusters[c]);
        if (d < least) least = d, best = std::uint8_t(c);
      }
      if (pair.owner != kNone) {
        const double own = distance(pair, clusters[pair.owner]);
        if (own < kLeave && (best == kNone || own < least + kSwitch)) best = pair.owner;
      }
      pair.owner = best;
    }
  }

  // Every pair without an owner founds a cluster or joins one that another has just founded; when there are enough, it
  // joins the nearest that it is not opposed to, or stays where it was.
  void found() {
    order.clear();
    for (std::uint32_t i = 0; i < pairs.size(); ++i) {
      if (pairs[i].owner == kNone) order.push_back(i);
    }
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(-pairs[a].weight, a) < std::pair(-pairs[b].weight, b);
    });
    for (const std::uint32_t i : order) {
      Pair& pair = pairs[i];
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t c = 0; c < clusters.size(); ++c) {
        const double d = distance(pair, clusters[c]);
        if (d < least) least = d, pair.owner = std::uint8_t(c);
      }
      const std::size_t most =
          least < kOpposed ? std::min<std::size_t>(options.max_clusters, kMaxContacts - kKeptForOpposed) : kMaxContacts;
      const bool is_room = clusters.size() < most;
      if (!is_room && pair.last_owner != kNone && distance(pair, clusters[pair.last_owner]) < least + kSwitch)
        pair.owner = pair.last_owner;
      if (least < 1 || !is_room) continue;
      pair.owner = std::uint8_t(clusters.size());
      Cluster fresh;
      fresh.p_S = pair.p, fresh.nhat_ST_S = pair.n;
      clusters.push_back(fresh);  // id 0: nothing to limit yet
    }
  }

  void remove(std::size_t c) {
    clusters.erase(clusters.begin() + std::ptrdiff_t(c));
    for (std::vector<Pair>* list : {&pairs, &last_pairs}) {
      for (Pair& pair : *list) {
        if (pair.owner == c) pair.owner = kNone;
        if (pair.owner != kNone && pair.owner > c) --pair.owner;
      }
    }
  }

  void remove_empty() {
    for (std::size_t c = clusters.size(); c-- > 0;) {
      if (std::none_of(pairs.begin(), pairs.end(), [&](const Pair& pair) { return pair.owner == c; })) remove(c);
    }
  }

  void sum() {
    sum_p.assign(clusters.size(), dvec3(0)), sum_n.assign(clusters.size(), dvec3(0));
    for (Cluster& c : clusters) c.weight_m = 0, c.pairs = 0;
    for (const Pair& pair : pairs) {
      Cluster& c = clusters[pair.owner];
      c.weight_m += pair.weight, ++c.pairs;
      sum_p[pair.owner] += pair.weight * pair.p, sum_n[pair.owner] += pair.weight * pair.n;
    }
  }

  dvec3 mean_point(std::size_t c) const { return sum_p[c] / clusters[c].weight_m; }
  dvec3 mean_direction(std::size_t c) const {
    const double length = glm::length(sum_n[c]);
    return length > 1e-9 * clusters[c].weight_m ? sum_n[c] / length : clusters[c].nhat_ST_S;
  }

  // Joins the two nearest clusters while they are too near, or too many; then those go first that have no name yet. The
  // older keeps its name.
  void merge() {
    while (clusters.size() > 1) {
      std::size_t keep = 0, give = 1;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < clusters.size(); ++i) {
        for (std::size_t j = i + 1; j < clusters.size(); ++j) {
          const bool is_settled = clusters.size() > options.max_clusters && clusters[i].id != 0 && clusters[j].id != 0;
          const double d = distance(mean_point(i), mean_direction(i), mean_point(j), mean_direction(j)) +
                           (is_settled ? kSettled : 0);
          if (d < least) least = d, keep = i, give = j;
        }
      }
      if (least > kMerge && clusters.size() <= options.max_clusters) return;
      for (Pair& pair : pairs) {
        if (pair.owner == give) pair.owner = std::uint8_t(keep);
      }
      sum_p[keep] += sum_p[give], sum_n[keep] += sum_n[give];
      clusters[keep].weight_m += clusters[give].weight_m, clusters[keep].pairs += clusters[give].pairs;
      sum_p.erase(sum_p.begin() + std::ptrdiff_t(give)), sum_n.erase(sum_n.begin() + std::ptrdiff_t(give));
      remove(give);
    }
  }

  void move(double dt_s) {
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      Cluster& cluster = clusters[c];
      double depth = -std::numeric_limits<double>::infinity();
      for (const Pair& pair : pairs) {
        if (pair.owner == c) depth = std::max(depth, -pair.distance);
      }
      const dvec3 p = mean_point(c), n = mean_direction(c);
      if (cluster.id == 0) {
        cluster.id = ++last_id;
        cluster.p_S = p, cluster.nhat_ST_S = n, cluster.depth_m = depth;
      } else {
        const dvec3 step = p - cluster.p_S;
        const double length = glm::length(step), most = options.point_m_per_s * dt_s;
        cluster.p_S += length > most ? step * (most / length) : step;
        cluster.nhat_ST_S = turned(cluster.nhat_ST_S, n, options.slew_rad_per_s * dt_s);
        const double change = fastest + options.depth_creep_m_per_s * dt_s;
        cluster.depth_m += std::clamp(depth - cluster.depth_m, -change, change);
      }
    }
  }

  void list_pieces() {
    for (Cluster& c : clusters) c.pieces_s.count = c.pieces_t.count = 0, c.lateral_m = 0;
    order.resize(pairs.size());
    for (std::uint32_t i = 0; i < pairs.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(-pairs[a].weight, a) < std::pair(-pairs[b].weight, b);
    });
    const auto add = [](PieceList& list, std::uint32_t piece) {
      const auto end = list.pieces.begin() + list.count;
      if (list.count < kMaxClusterPieces && std::find(list.pieces.begin(), end, piece) == end)
        list.pieces[list.count++] = piece;
    };
    for (const std::uint32_t i : order) {
      const Pair& pair = pairs[i];
      Cluster& c = clusters[pair.owner];
      add(c.pieces_s, std::uint32_t(pair.key >> 32));
      add(c.pieces_t, std::uint32_t(pair.key));
      const dvec3 e = pair.p - c.p_S;
      c.lateral_m = std::max(c.lateral_m, glm::length(e - c.nhat_ST_S * dot(e, c.nhat_ST_S)));
    }
  }

  std::span<const Cluster> update(std::span<const ProximityPair> from, double tolerance_m, double dt_s) {
    const double radius = options.radius_in_tolerances * tolerance_m;
    radius2 = radius * radius;
    take(from, tolerance_m, dt_s);
    assign();
    found();
    remove_empty();
    sum();
    merge();
    move(ablated(Mechanism::kBoundedMoves) ? 1e6 : dt_s);
    list_pieces();
    reported.assign(clusters.begin(), clusters.end());
    std::sort(reported.begin(), reported.end(), [](const Cluster& a, const Cluster& b) {
      return std::pair(-a.weight_m, a.id) < std::pair(-b.weight_m, b.id);
    });
    return reported;
  }
};

Clustering::Clustering(const ClusteringOptions& options) : state_(std::make_unique<State>(options)) {}
Clustering::~Clustering() = default;
Clustering::Clustering(Clustering&&) noexcept = default;
Clustering& Clustering::operator=(Clustering&&) noexcept = default;

std::span<const Cluster> Clustering::update(std::span<const ProximityPair> pairs, double tolerance_m,
                                            double dt_s) noexcept {
  return state_->update(pairs, tolerance_m, dt_s);
}

void Clustering::restart() noexcept {
  state_->clusters.clear(), state_->pairs.clear(), state_->last_pairs.clear();
  state_->last_id = 0;
}

}  // namespace farfeel::contact
