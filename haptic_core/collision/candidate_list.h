// The pairs of pieces that may be near: complete while the tool moves by less than a slack, and renewed before that is
// used up, a few nodes of the trees in each query, so that no query pays for all of it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_tree.h"

namespace farfeel::collision {

struct Candidate {
  std::uint32_t piece_s, piece_t;
  PairSimplex simplex{};
  HullFeature feature_s{}, feature_t{};  ///< of the simplex
  TranslationAxis axis{};

  [[nodiscard]] std::uint64_t key() const { return std::uint64_t(piece_s) << 32 | piece_t; }
};

class CandidateList {
 public:
  /// Room for max_candidates. rounding_m: of coordinates.
  CandidateList(const HullTree& S, const HullTree& T, std::uint32_t max_candidates, double rounding_m);

  /// Afterwards candidates() holds every pair nearer than tolerance_m at X_ST (between the trees' centres). motion_m:
  /// how far T's points have moved at most, summed over all queries. Bounded; no allocation.
  void update(const Placement& X_ST, double motion_m, double tolerance_m);

  void forget();

  /// Ordered by key. A candidate is farther than the tolerance while asleep_until_m is at least the motion's sum.
  [[nodiscard]] std::span<Candidate> candidates() { return candidates_; }
  [[nodiscard]] std::span<double> asleep_until_m() { return asleep_until_m_; }

  /// Searches that found more pairs than there is room for.
  [[nodiscard]] std::uint64_t overflows() const { return overflows_; }

 private:
  struct Found {
    std::uint32_t piece_s, piece_t;
    double asleep_until_m;
  };
  // A walk down both trees at one pose.
  struct Search {
    bool is_open = false;
    Placement X;
    double motion_m, slack_m;
    std::uint64_t seen;  // pairs of nodes
  };

  void begin(const Placement& X_ST, double motion_m, double slack_m);
  void advance(std::uint64_t pairs_of_nodes);
  void finish();
  void order_found();

  const HullTree *S_, *T_;
  std::uint32_t max_candidates_;
  double rounding_m_, tolerance_m_ = -1;

  std::vector<Candidate> candidates_, last_candidates_;
  std::vector<double> asleep_until_m_, last_asleep_until_m_;
  double searched_at_m_ = 0, good_until_m_ = -1;  // of the motion's sum
  std::uint64_t usual_ = 0, overflows_ = 0;       // usual_: pairs of nodes that the last search saw

  Search search_{};
  std::vector<std::array<std::uint32_t, 2>> open_;  // pairs of nodes still to look at
  std::vector<Found> found_, sorted_;
  std::vector<std::uint32_t> places_;
};

}  // namespace farfeel::collision
