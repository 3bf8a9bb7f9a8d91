#include "haptic_core/contact_service/twin_contacts.h"

#include <algorithm>

namespace farfeel::contact_service {
namespace {

using contact::Cluster;
using penetration::Penetration;
using penetration::Query;

constexpr double kAlikeCosine = 0.98;  ///< of the clusters' directions: 11 degrees
/// The same place and way to push, as far as contacts press there as one.
constexpr double kSamePlace_m = 1.5e-3, kSameWay = 0.3;
/// Two that differ as they did before by no more than this go on doing so.
constexpr double kSameDepth_m = 4e-6, kSameGradient = 0.05;

bool share_one(const contact::PieceList& a, const contact::PieceList& b) {
  const auto pieces = b.view();
  return std::any_of(a.view().begin(), a.view().end(), [&](std::uint32_t piece) {
    return std::find(pieces.begin(), pieces.end(), piece) != pieces.end();
  });
}

bool may_be_twins(const Query& a_query, const Cluster& a, const Query& b_query, const Cluster& b) {
  return a_query.s.surface == b_query.s.surface && a_query.t.surface == b_query.t.surface &&
         glm::dot(a.nhat_ST_S, b.nhat_ST_S) > kAlikeCosine && share_one(a.pieces_s, b.pieces_s) &&
         share_one(a.pieces_t, b.pieces_t);
}

spatial::Pose tool_in_S(const Query& query) {
  return spatial::inverse(query.s.X_CO) * query.t.X_CO;
}

/// How far T has gone at a place of S since it was at X_ST.
double way_at_m(const glm::dvec3& p_S, const spatial::Pose& X_ST, const Query& query) {
  return glm::distance(
      p_S, spatial::transform_point(tool_in_S(query), spatial::transform_point(spatial::inverse(X_ST), p_S)));
}

bool wants_more_than_depth(const Query& query) {
  return query.wants_hessian || query.estimates_hessian;
}

}  // namespace

TwinContacts::Found TwinContacts::Found::of(const Query& query, const Penetration& depth) noexcept {
  const spatial::Wrench g_C = spatial::wrench_from(depth.gradient);
  return {spatial::transform_point(spatial::inverse(query.s.X_CO), depth.p_CQ_C), depth.depth_m,
          spatial::rotate_back(query.s.X_CO, g_C.torque_Nm), spatial::rotate_back(query.s.X_CO, g_C.force_N)};
}

Penetration TwinContacts::Found::in(const Query& query, std::uint32_t doubts) const noexcept {
  const spatial::Pose& X_CS = query.s.X_CO;
  Penetration depth;
  depth.p_CQ_C = spatial::transform_point(X_CS, p_S);
  depth.depth_m = depth_m;
  depth.gradient =
      spatial::to_vector6(spatial::Wrench{spatial::rotate(X_CS, turning_S), spatial::rotate(X_CS, moving_S)});
  depth.doubts = doubts;
  return depth;
}

TwinContacts::Found TwinContacts::Found::plus(const Found& other, double times) const noexcept {
  return {p_S + times * other.p_S, depth_m + times * other.depth_m, turning_S + times * other.turning_S,
          moving_S + times * other.moving_S};
}

void TwinContacts::search(penetration::BackEnd& back_end, std::span<const Query> queries,
                          std::span<const std::size_t> which, std::span<Penetration> answers) noexcept {
  if (which.empty()) return;
  for (std::size_t k = 0; k < which.size(); ++k) asked_[k] = queries[which[k]];
  back_end.evaluate({asked_.data(), which.size()}, {found_.data(), which.size()});
  for (std::size_t k = 0; k < which.size(); ++k) answers[which[k]] = found_[k];
}

/// Every contact has one twin at most: whom it was tied to, or else the first that may be.
void TwinContacts::pair_up(std::span<const Query> queries, std::span<const Cluster* const> clusters) noexcept {
  std::array<bool, kMost> is_taken{};
  pair_count_ = 0;
  const auto try_pairs = [&](bool are_tied) {
    for (std::size_t b = 0; b < queries.size(); ++b) {
      for (std::size_t a = 0; a < queries.size() && !is_taken[b]; ++a) {
        if (is_taken[a] || !(queries[a].contact < queries[b].contact)) continue;
        const Tie& tie = tie_of(queries[b]);
        const bool is_tie = tie.second == queries[b].contact && tie.first == queries[a].contact;
        if (is_tie != are_tied || !may_be_twins(queries[a], *clusters[a], queries[b], *clusters[b])) continue;
        is_taken[a] = is_taken[b] = true;
        pairs_[pair_count_++] = {.first = a,
                                 .second = b,
                                 .is_one_searched = is_tie && tie.is_settled && tie.followed < kMostFollowed &&
                                                    way_at_m(tie.p_first_S, tie.X_ST, queries[a]) < kMostStep_m &&
                                                    !wants_more_than_depth(queries[a]) &&
                                                    !wants_more_than_depth(queries[b]),
                                 .does_first_follow = tie.followed % 2 == 1};
      }
    }
  };
  try_pairs(true);
  try_pairs(false);
}

/// False where the one that was searched has gone elsewhere.
bool TwinContacts::follow(const Pair& pair, std::span<const Query> queries, std::span<Penetration> answers) noexcept {
  Tie& tie = tie_of(queries[pair.second]);
  const std::size_t follows = pair.does_first_follow ? pair.first : pair.second,
                    leads = pair.does_first_follow ? pair.second : pair.first;
  if (!answers[leads].is_known()) return false;
  const Found now = Found::of(queries[leads], answers[leads]);
  const glm::dvec3 p_then_S = pair.does_first_follow ? tie.p_first_S + tie.more.p_S : tie.p_first_S;
  if (glm::distance(now.p_S, p_then_S) > kMostWay_m) return false;
  answers[follows] = now.plus(tie.more, pair.does_first_follow ? -1 : 1).in(queries[follows], answers[leads].doubts);
  ++tie.followed;
  tie.X_ST = tool_in_S(queries[leads]);
  return true;
}

void TwinContacts::tie(const Query& first, const Penetration& of_first, const Query& second,
                       const Penetration& of_second) noexcept {
  Tie& tie = tie_of(second);
  const bool was_tied = tie.second == second.contact && tie.first == first.contact;
  const Found last = tie.more;
  tie = {};
  if (!of_first.is_known() || !of_second.is_known() || !(of_first.depth_m > 0) || !(of_second.depth_m > 0)) return;
  const Found its = Found::of(first, of_first), more = Found::of(second, of_second).plus(its, -1);
  if (glm::length(more.p_S) > kSamePlace_m || glm::length(more.moving_S) > kSameWay) return;
  const Found changed = more.plus(last, -1);
  const bool is_settled =
      was_tied && std::abs(changed.depth_m) < kSameDepth_m && glm::length(changed.moving_S) < kSameGradient;
  tie = {first.contact, second.contact, 0, is_settled, its.p_S, tool_in_S(first), more};
}

void TwinContacts::evaluate(penetration::BackEnd& back_end, std::span<const Query> queries,
                            std::span<const Cluster* const> clusters, std::span<Penetration> answers) noexcept {
  pair_up(queries, clusters);
  const std::span<Pair> pairs{pairs_.data(), pair_count_};
  std::array<bool, kMost> follows{};
  for (const Pair& pair : pairs) {
    if (pair.is_one_searched) follows[pair.does_first_follow ? pair.first : pair.second] = true;
  }
  std::array<std::size_t, kMost> which;
  std::size_t searched = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (!follows[i]) which[searched++] = i;
  }
  search(back_end, queries, {which.data(), searched}, answers);
  followed_ = static_cast<std::uint32_t>(queries.size() - searched);
  searched = 0;
  for (Pair& pair : pairs) {
    if (!pair.is_one_searched || follow(pair, queries, answers)) continue;
    pair.is_one_searched = false;
    which[searched++] = pair.does_first_follow ? pair.first : pair.second;
  }
  search(back_end, queries, {which.data(), searched}, answers);
  followed_ -= static_cast<std::uint32_t>(searched);
  for (const Pair& pair : pairs) {
    if (!pair.is_one_searched) {
      tie(queries[pair.first], answers[pair.first], queries[pair.second], answers[pair.second]);
    }
  }
}

}  // namespace farfeel::contact_service
