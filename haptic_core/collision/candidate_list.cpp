// A search at motion m with slack s finds what is nearer than tolerance + s then, so it is complete until m + s. The
// next one starts when much of that is used and is to end before all is: each query does its share. When the tool is
// faster than that, the query that needs the list searches all of it.
#include "haptic_core/collision/candidate_list.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/collision/hull_support.h"
#include "haptic_core/counting/work.h"

namespace farfeel::collision {
namespace {

constexpr double kSlack = 1.2;               // of the tolerance
constexpr double kStart = 0.6, kEnd = 0.95;  // of the slack
constexpr std::uint64_t kLeastShare = 32;    // pairs of nodes a query
constexpr double kMargin = 1 + 1e-9;         // on bounds of motion and distance, for rounding
constexpr double kAwake = -1;                // of the motion's sum, which starts at 0
constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

}  // namespace

CandidateList::CandidateList(const HullTree& S, const HullTree& T, std::uint32_t max_candidates, double rounding_m)
    : S_(&S), T_(&T), max_candidates_(max_candidates), rounding_m_(rounding_m) {
  for (auto* list : {&candidates_, &last_candidates_}) list->reserve(max_candidates);
  for (auto* list : {&asleep_until_m_, &last_asleep_until_m_}) list->reserve(max_candidates);
  for (auto* list : {&found_, &sorted_}) list->reserve(max_candidates + 1);
  open_.reserve(256);  // two for each level of two balanced trees, at most
  places_.resize(std::max(S.pieces().size(), T.pieces().size()) + 1);
}

void CandidateList::forget() {
  candidates_.clear(), asleep_until_m_.clear();
  search_.is_open = false;
  good_until_m_ = -1, tolerance_m_ = -1;
}

void CandidateList::update(const Placement& X_ST, double motion_m, double tolerance_m) {
  if (tolerance_m != tolerance_m_) {
    search_.is_open = false;
    good_until_m_ = -1;
    std::fill(asleep_until_m_.begin(), asleep_until_m_.end(), kAwake);
    tolerance_m_ = tolerance_m;
  }
  const double slack_m = kSlack * tolerance_m;
  const bool is_due = motion_m > good_until_m_;
  if (is_due && (!search_.is_open || motion_m > search_.motion_m + search_.slack_m)) begin(X_ST, motion_m, slack_m);
  if (!search_.is_open && motion_m > searched_at_m_ + kStart * (good_until_m_ - searched_at_m_)) {
    begin(X_ST, motion_m, slack_m);
  }
  if (!search_.is_open) return;
  const double used = (motion_m - search_.motion_m) / ((kEnd - kStart) * slack_m);
  const auto due = std::uint64_t(std::min(used, 1.0) * double(usual_));
  advance(is_due ? kAll : std::max(kLeastShare, due > search_.seen ? due - search_.seen : 0));
  if (!open_.empty()) return;
  if (found_.size() > max_candidates_) {  // too many: do without slack
    begin(X_ST, motion_m, 0);
    advance(kAll);
  }
  finish();
}

void CandidateList::begin(const Placement& X_ST, double motion_m, double slack_m) {
  search_ = {true, X_ST, motion_m, slack_m, 0};
  found_.clear(), open_.clear();
  open_.push_back({0, 0});
}

namespace {

// The columns of a matrix, four lanes each.
struct Columns {
  Four x, y, z;
  explicit Columns(const glm::dmat3& m)
      : x{m[0].x, m[0].y, m[0].z, 0}, y{m[1].x, m[1].y, m[1].z, 0}, z{m[2].x, m[2].y, m[2].z, 0} {}
};

[[gnu::always_inline]] inline void times(Four& product, const Columns& m, const Four& v) {
  product = m.x * v[0] + m.y * v[1] + m.z * v[2];
}

[[gnu::always_inline]] inline void without_sign(Four& v) {
  v = v < 0 ? -v : v;
}

// A lower bound of the distance of two boxes: the widest gap along their six face normals.
struct BoxGap {
  Columns R, R_back, R_abs, R_back_abs;
  Four p;
  explicit BoxGap(const Placement& X)
      : R(X.R),
        R_back(glm::transpose(X.R)),
        R_abs(without_signs(X.R)),
        R_back_abs(glm::transpose(without_signs(X.R))),
        p{X.p.x, X.p.y, X.p.z, 0} {}
  static glm::dmat3 without_signs(const glm::dmat3& m) { return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])}; }

  [[gnu::always_inline]] double operator()(const HullTreeNode& a, const HullTreeNode& b) const {
    Four centre_a, half_a, centre_b, half_b, c, c_back, reach_b, reach_a;
    load_four(centre_a, a.centre.data()), load_four(half_a, a.half.data());
    load_four(centre_b, b.centre.data()), load_four(half_b, b.half.data());
    times(c, R, centre_b);
    c = c + p - centre_a;
    times(c_back, R_back, c), times(reach_b, R_abs, half_b), times(reach_a, R_back_abs, half_a);
    without_sign(c), without_sign(c_back);
    const Four along_a = c - half_a - reach_b, along_b = c_back - half_b - reach_a;
    const Four most = along_a > along_b ? along_a : along_b;
    const double xy = most[0] > most[1] ? most[0] : most[1];
    return xy > most[2] ? xy : most[2];
  }
};

[[gnu::always_inline]] inline double size2(const HullTreeNode& n) {
  return n.half[0] * n.half[0] + n.half[1] * n.half[1] + n.half[2] * n.half[2];
}

}  // namespace

FARFEEL_WIDE_VECTORS
void CandidateList::advance(std::uint64_t pairs_of_nodes) {
  const double reach_m = (tolerance_m_ + search_.slack_m) * kMargin + rounding_m_;
  const BoxGap gap(search_.X);
  for (std::uint64_t k = 0; k < pairs_of_nodes && !open_.empty(); ++k, ++search_.seen) {
    const auto [i, j] = open_.back();
    open_.pop_back();
    counting::count(Work::kNodes);
    const HullTreeNode &a = S_->nodes()[i], &b = T_->nodes()[j];
    const double apart_m = gap(a, b);
    if (apart_m >= reach_m) continue;
    if (a.count == 1 && b.count == 1) {
      if (found_.size() > max_candidates_) continue;
      const double spare_m = (apart_m - tolerance_m_) / kMargin - rounding_m_;
      found_.push_back({S_->order()[a.first], T_->order()[b.first], spare_m > 0 ? search_.motion_m + spare_m : kAwake});
      continue;
    }
    const bool split_s = b.count == 1 || (a.count > 1 && size2(a) > size2(b));
    if (split_s) {
      open_.push_back({i + 1, j}), open_.push_back({a.second_child, j});
    } else {
      open_.push_back({i, j + 1}), open_.push_back({i, b.second_child});
    }
  }
}

// By counting: by T's piece first, then, stably, by S's.
void CandidateList::order_found() {
  const auto sort_by = [&](std::uint32_t Found::*piece, std::uint32_t pieces) {
    std::fill_n(places_.begin(), pieces + 1, 0U);
    for (const Found& f : found_) ++places_[f.*piece + 1];
    for (std::uint32_t i = 0; i < pieces; ++i) places_[i + 1] += places_[i];
    sorted_.resize(found_.size());
    for (const Found& f : found_) sorted_[places_[f.*piece]++] = f;
    std::swap(found_, sorted_);
  };
  sort_by(&Found::piece_t, T_->pieces().size());
  sort_by(&Found::piece_s, S_->pieces().size());
}

void CandidateList::finish() {
  search_.is_open = false;
  if (found_.size() > max_candidates_) ++overflows_, found_.resize(max_candidates_);
  order_found();
  usual_ = search_.seen;
  searched_at_m_ = search_.motion_m, good_until_m_ = search_.motion_m + search_.slack_m;

  std::swap(candidates_, last_candidates_), std::swap(asleep_until_m_, last_asleep_until_m_);
  candidates_.clear(), asleep_until_m_.clear();
  std::size_t last = 0;
  for (const Found& f : found_) {
    Candidate fresh{f.piece_s, f.piece_t};
    double asleep_until_m = f.asleep_until_m;
    while (last < last_candidates_.size() && last_candidates_[last].key() < fresh.key()) ++last;
    if (last < last_candidates_.size() && last_candidates_[last].key() == fresh.key()) {
      fresh = last_candidates_[last];
      asleep_until_m = std::max(asleep_until_m, last_asleep_until_m_[last]);
    }
    candidates_.push_back(fresh), asleep_until_m_.push_back(asleep_until_m);
  }
}

}  // namespace farfeel::collision
