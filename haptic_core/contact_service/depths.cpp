#include "haptic_core/contact_service/depths.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/assembly.h"
#include "haptic_core/penetration/reference.h"
#include "haptic_core/penetration/simd.h"
#include "haptic_core/penetration/two_widths.h"

namespace farfeel::contact_service {
namespace {

using contact::Cluster;
using penetration::SearchBudget;
using spatial::Pose;

/// The window keeps this many soft widths of overlap below the peak; weights beyond are under 1e-6.
constexpr double kTailWidths = 14;
constexpr double kLeastTail_m = 20e-6;
/// On a budget, answers for which everything is searched: one costs as much as several from what earlier ones kept.
constexpr std::uint64_t kMostSearchedAnew = 1;
/// A contact's arm from the tool's origin never counts as shorter when its stiffness against rotations is judged.
constexpr double kLeastArm_m = 10e-3;
constexpr double kSameNameCosine = 0.94;  // 20 degrees
/// Cosine between a chart's axis and a contact's direction, at least: what decides a depth faces it within 66 degrees.
constexpr double kMostLeaning = 0.4;

/// How deep coarse surfaces of this cluster can overlap along its direction n. A pair at signed distance x along its
/// own direction n_p overlaps along n by at most -x / (n . n_p), and clusters hold pairs with n . n_p above about 0.7.
/// Anything deeper is no pair of this cluster: a wall's far side, a shelf above the tool.
double deepest_m(const Cluster& cluster) {
  constexpr double kClusterLag_m = 0.5e-3;  // a cluster's depth follows its pairs at bounded speed
  return std::max(cluster.depth_m, cluster.depth_m / 0.7) + kClusterLag_m;
}

std::unique_ptr<penetration::BackEnd> make_back_end(const ContactOptions& options, const penetration::Limits& limits) {
  switch (options.back_end) {
    case DepthBackEnd::kGiven:
      return options.maker->make(limits);
    case DepthBackEnd::kReference:
      return penetration::make_reference(limits);
    case DepthBackEnd::kTruth:
      return penetration::make_reference(limits, penetration::kTruth);
    case DepthBackEnd::kSimd:
      break;
  }
  return penetration::make_simd(limits);
}

void gather(const penetration::FeltSurface& felt, const contact::PieceList& pieces, std::vector<std::uint32_t>& out) {
  out.clear();
  for (const std::uint32_t piece : pieces.view()) {
    const auto triangles = felt.triangles_of_piece(piece);
    out.insert(out.end(), triangles.begin(), triangles.end());  // within the capacity reserved for all triangles
  }
}

}  // namespace

Depths::Depths(NearContacts& near, const penetration::Limits& limits, const ContactOptions& options)
    : near_(near),
      options_(options),
      windows_(limits),
      plane_depth_(limits),
      tiles_under_(limits),
      back_end_(std::make_unique<penetration::TwoWidths>(make_back_end(options, limits))),
      widths_({.least_m = options.soft_width_m, .most_stiffness_N_per_m = options.most_stiffness_N_per_m}),
      far_(near.tool_felt()) {
  back_end_->prepare(near_.tool_felt());
  for (const FeltObject& object : near_.objects()) back_end_->prepare(*object.felt);
  for (auto& triangles : triangles_s_) triangles.reserve(limits.coarse_triangles);
  for (auto& triangles : triangles_t_) triangles.reserve(limits.coarse_triangles);
}

penetration::Query Depths::query_for(std::size_t i, const Pose& X_WT) noexcept {
  NearContact& near = near_.all()[i];
  const FeltObject& object = near_.object_of(near);
  gather(*object.felt, near.cluster.pieces_s, triangles_s_[i]);
  gather(near_.tool_felt(), near.cluster.pieces_t, triangles_t_[i]);
  near.triangles_s = triangles_s_[i], near.triangles_t = triangles_t_[i];
  const Pose X_CS = spatial::inverse(contact::contact_frame(near.cluster));
  return {.s = {object.felt, X_CS, near.triangles_s},
          .t = {&near_.tool_felt(), X_CS * (spatial::inverse(object.X_WO) * X_WT), near.triangles_t},
          .contact = near.id,
          .window = penetration::kWholePlane,
          .samples = options_.grid_samples,
          .soft_width_m = near.soft_width_m,
          .depth_width_m = options_.soft_width_m,
          .deepest_m = deepest_m(near.cluster)};
}

bool Depths::fit_window(penetration::Query& query) noexcept {
  const double tail_m = std::max(kTailWidths * query.soft_width_m, kLeastTail_m);
  const auto window = windows_.fit(query.s, query.t, penetration::kWholePlane, tail_m, query.deepest_m);
  if (window) query.window = *window;
  return window.has_value();
}

bool Depths::may_lack_heights(std::uint32_t object) const noexcept {
  return options_.heights && !(options_.heights->has_all(object + 1) && options_.heights->has_all(kToolSurface));
}

/// A height that is off moves the surface along its chart's axis; along the contact's direction that is as much more as
/// the axis leans. Soft maxima of two overlaps that differ by so much at most differ by no more.
void Depths::note_lack(NearContact& near, const penetration::Query& query) noexcept {
  near.lacks_heights = false;
  near.outline_off_m = 0;
  const auto note = [&](std::uint32_t surface, const penetration::Patch& patch, penetration::Side side) {
    if (options_.heights->has_all(surface)) return;
    double off_m = 0;
    tiles_under_.all(patch, side, query.window, [&](std::uint32_t tile) {
      if (options_.heights->has({surface, tile})) return true;
      near.lacks_heights = true;
      const glm::dvec3& axis_O = patch.surface->chart_axis_O(patch.surface->place_of(tile).chart);
      const double leaning = std::max(std::abs(spatial::rotate(patch.X_CO, axis_O).z), kMostLeaning);
      off_m = std::max(off_m, options_.heights->off_m({surface, tile}) / leaning);
      return true;
    });
    near.outline_off_m += off_m;
  };
  if (may_lack_heights(near.object)) {
    note(near.object + 1, query.s, penetration::Side::kOutermost);
    note(kToolSurface, query.t, penetration::Side::kInnermost);
  }
  lacks_[near.id % kLackSlots] = {near.id, near.lacks_heights, near.outline_off_m};
}

/// Points are made from any tile, so without all of them the coarse pieces are felt: off by what lies over these.
void Depths::note_lack_of_layers(NearContact& near) const noexcept {
  near.lacks_heights = true;
  const auto relief_m = [](const penetration::FeltSurface& felt, std::span<const std::uint32_t> triangles) {
    double most_m = 0;
    for (const std::uint32_t i : triangles) most_m = std::max({most_m, -felt.relief(i).low_m, felt.relief(i).high_m});
    return most_m;
  };
  near.outline_off_m =
      relief_m(*near_.object_of(near).felt, near.triangles_s) + relief_m(near_.tool_felt(), near.triangles_t);
}

/// The fast back ends find a contact's extent by themselves, but may not look where heights lack.
bool Depths::wants_window(std::uint32_t object) const noexcept {
  const bool finds_extent = options_.back_end == DepthBackEnd::kSimd ||
                            (options_.back_end == DepthBackEnd::kGiven && !options_.maker->wants_window());
  return (may_lack_heights(object) || !finds_extent) && !is_plain(near_.objects()[object]);
}

bool Depths::is_plain(const FeltObject& object) const noexcept {
  return !object.is_textured && options_.soft_width_m > 0 &&
         (options_.back_end == DepthBackEnd::kSimd || options_.back_end == DepthBackEnd::kGiven);
}

bool Depths::may_be_searched(NearContact& near, penetration::Query& query) noexcept {
  if (wants_window(near.object) && !fit_window(query)) return false;
  note_lack(near, query);
  return true;
}

void Depths::ask(std::size_t i, const penetration::Query& query) noexcept {
  asked_by_[asked_] = i;
  queries_[asked_++] = query;
}

/// First those that cannot be carried, then those whose search is oldest, as far as the budget goes. What is only
/// carried needs no window.
void Depths::search_on_budget(std::span<Open> open) noexcept {
  std::sort(open.begin(), open.end(),
            [](const Open& a, const Open& b) { return a.carries != b.carries ? a.carries > b.carries : a.i < b.i; });
  const std::uint64_t searched_before = back_end_->searches();
  for (Open& contact : open) {
    NearContact& near = near_.all()[contact.i];
    const bool is_spent =
        asked_ >= options_.most_searches || back_end_->searches() - searched_before >= kMostSearchedAnew;
    if (is_spent && contact.carries != SearchBudget::kNever) {
      near.depth = budget_.carried(contact.query);
    } else if (contact.is_ready || may_be_searched(near, contact.query)) {
      ask(contact.i, contact.query);
      evaluate(asked_ - 1);
    }
  }
}

/// The far contact whose turn it is, if it may be searched, becomes the last query.
bool Depths::ask_far_one() noexcept {
  const FarContacts::Turn* const turn = far_.turn();
  if (!turn) return false;
  penetration::Query query = turn->query;
  if (is_budgeted() && far_.remembers(query) && !may_be_searched(near_.all()[turn->i], query)) {
    far_.forget();
    return false;
  }
  ask(turn->i, query);
  return true;
}

void Depths::find(const Pose& X_WT, double dt_s, bool wants_curvature, StageTimes& times) noexcept {
  std::size_t open = 0;
  times.closed_forms = times.hessians = 0;
  times.widest_m = 0;
  follow_names();
  widths_.begin_answer(dt_s);
  far_.begin();
  const std::span<NearContact> all = near_.all();
  for (std::size_t i = 0; i < all.size(); ++i) {
    NearContact& near = all[i];
    const FeltObject& object = near_.object_of(near);
    near.soft_width_m = widths_.width_m(near.id);
    near.layers = object.as_points->share_by_layers(near.cluster, object.pairs,
                                                    spatial::transform_point(spatial::inverse(object.X_WO), X_WT.p));
    if (near.layers.share >= 1 && !may_lack_heights(near.object)) continue;
    penetration::Query query = query_for(i, X_WT);
    if (near.layers.share > 0 && may_lack_heights(near.object)) {
      note_lack_of_layers(near);
      continue;
    }
    // What is carried is of the heights that it was searched with.
    if (const Lack& lack = lacks_[near.id % kLackSlots]; lack.contact == near.id)
      near.lacks_heights = lack.lacks_heights, near.outline_off_m = lack.off_m;
    query.wants_hessian = wants_curvature;
    if (is_plain(object)) {
      near.depth = plane_depth_.evaluate(query);
      ++times.closed_forms;
      continue;
    }
    const std::uint32_t carries = is_budgeted() ? budget_.carries(query) : SearchBudget::kNever;
    const bool was_searched = is_budgeted() && (carries != SearchBudget::kNever || far_.remembers(query));
    if (!was_searched && !may_be_searched(near, query)) continue;
    if (far_.takes(query, i, near.depth)) continue;
    query.estimates_hessian = widths_.wants_judging(near.id);
    open_[open++] = {i, carries, !was_searched, query};
  }
  asked_ = 0;
  if (is_budgeted()) {
    search_on_budget({open_.data(), open});
  } else {
    for (const Open& contact : std::span(open_).first(open)) ask(contact.i, contact.query);
  }
  const std::size_t answered = is_budgeted() ? asked_ : 0;
  const bool has_far_one = ask_far_one();
  if (asked_ > answered) evaluate(answered);
  times.twins = asked_ > 0 ? twins_.followed() : 0;
  times.grids = static_cast<std::uint32_t>(asked_) - times.twins;
  for (std::size_t q = 0; q < asked_; ++q) {
    all[asked_by_[q]].depth = answers_[q];
    if (is_budgeted()) budget_.keep(queries_[q], answers_[q]);
    // What was carried is not: its second derivative is of a width that it may not have any more.
    if (queries_[q].estimates_hessian) judge(all[asked_by_[q]], X_WT, times);
  }
  if (has_far_one) far_.keep(answers_[asked_ - 1]);
  for (const NearContact& near : all) {
    widths_.note(near.id, near_.object_of(near).material.stiffness_N_per_m,
                 contact::is_credible(near.depth) ? near.depth.depth_m : 0);
    times.widest_m = std::max(times.widest_m, near.soft_width_m);
  }
  widths_.end_answer();
}

/// The slow back ends say what is true of every contact, and on a budget contacts are carried by themselves.
void Depths::evaluate(std::size_t first) noexcept {
  const std::size_t count = asked_ - first;
  const std::span<const penetration::Query> queries{&queries_[first], count};
  const std::span<penetration::Penetration> answers{&answers_[first], count};
  const bool is_fast = options_.back_end == DepthBackEnd::kSimd || options_.back_end == DepthBackEnd::kGiven;
  if (!is_fast || is_budgeted()) return back_end_->evaluate(queries, answers);
  for (std::size_t q = 0; q < count; ++q) clusters_[q] = &near_.all()[asked_by_[first + q]].cluster;
  twins_.evaluate(*back_end_, queries, {clusters_.data(), count}, answers);
}

// The witness of a line or a face jumps from end to end, and its cluster is made anew. A width that began anew would
// turn the force from the mean of what touches to the highest peak, and back while it grows.
void Depths::follow_names() noexcept {
  const std::span<const NearContact> all = near_.all();
  const std::span<const Named> before{named_.data(), named_count_};
  const auto is_here = [&](std::uint32_t id) {
    return std::any_of(all.begin(), all.end(), [&](const NearContact& near) { return near.id == id; });
  };
  for (const NearContact& near : all) {
    const Named* nearest = nullptr;
    const auto distance_m = [&](const Named& named) { return glm::distance(named.p_S, near.cluster.p_S); };
    for (const Named& named : before) {
      if (named.id == near.id) {
        nearest = nullptr;
        break;
      }
      if (named.object != near.object || is_here(named.id) ||
          glm::dot(named.nhat_ST_S, near.cluster.nhat_ST_S) < kSameNameCosine)
        continue;
      if (!nearest || distance_m(named) < distance_m(*nearest)) nearest = &named;
    }
    if (nearest) widths_.rename(nearest->id, near.id);
  }
  named_count_ = all.size();
  for (std::size_t i = 0; i < all.size(); ++i)
    named_[i] = {all[i].id, all[i].object, all[i].cluster.nhat_ST_S, all[i].cluster.p_S};
}

/// How wide the contact is next time, by what its Hessian, or the estimate of it, says of its stiffness.
void Depths::judge(const NearContact& near, const Pose& X_WT, StageTimes& times) noexcept {
  if (!contact::is_credible(near.depth)) return;
  ++times.hessians;
  const FeltObject& object = near_.object_of(near);
  const Pose X_CT = spatial::inverse(object.X_WO * contact::contact_frame(near.cluster)) * X_WT;
  const double arm_m = std::max(glm::distance(near.depth.p_CQ_C, X_CT.p), kLeastArm_m);
  widths_.judge(near.id, object.material.stiffness_N_per_m, near.depth.depth_m, near.depth.gradient, near.depth.hessian,
                arm_m);
}

std::span<const SurfaceTile> Depths::tiles_needed(const Pose& X_WT, double margin_m, double soft_width_m) {
  needed_.clear();
  const std::span<NearContact> all = near_.all();
  std::sort(all.begin(), all.end(),
            [](const NearContact& a, const NearContact& b) { return a.cluster.depth_m > b.cluster.depth_m; });
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].soft_width_m = std::max(options_.soft_width_m, soft_width_m);
    penetration::Query query = query_for(i, X_WT);
    if (!fit_window(query)) continue;
    query.window = {query.window.low - margin_m, query.window.high + margin_m};
    const auto note = [this](std::uint32_t surface) {
      return [this, surface](std::uint32_t tile) {
        needed_.push_back({surface, tile});
        return true;
      };
    };
    tiles_under_.all(query.s, penetration::Side::kOutermost, query.window, note(all[i].object + 1));
    tiles_under_.all(query.t, penetration::Side::kInnermost, query.window, note(kToolSurface));
  }
  return needed_;
}

}  // namespace farfeel::contact_service
