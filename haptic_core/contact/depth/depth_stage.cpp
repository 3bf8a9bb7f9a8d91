#include "haptic_core/contact/depth/depth_stage.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/coarse_depth.h"
#include "haptic_core/contact/depth/constants.h"
#include "haptic_core/contact/depth/contact_frame.h"
#include "haptic_core/contact/depth/tiles_under.h"
#include "haptic_core/penetration/simd/simd.h"
#include "haptic_core/penetration/two_widths.h"

namespace farfeel::contact {
namespace {

using spatial::Pose;

/// How deep coarse surfaces of this cluster can overlap along its direction n. A pair at signed distance x along its
/// own direction n_p overlaps along n by at most -x / (n . n_p), and clusters hold pairs with n . n_p above about 0.7.
/// Anything deeper is no pair of this cluster: a wall's far side, a shelf above the tool.
double deepest_m(const Cluster& cluster) {
  return std::max(cluster.depth_m, cluster.depth_m / kLeastAlignment) + kPatchLag_m;
}

/// How far below the coarse surface the felt one may lie along its normal, at most [m].
double sunk_m(const penetration::FeltSurface& felt, std::span<const std::uint32_t> triangles) {
  double most_m = 0;
  for (const std::uint32_t i : triangles) most_m = std::max(most_m, -felt.relief(i).low_m);
  return most_m;
}

/// And how far above it.
double risen_m(const penetration::FeltSurface& felt, std::span<const std::uint32_t> triangles) {
  double most_m = 0;
  for (const std::uint32_t i : triangles) most_m = std::max(most_m, felt.relief(i).high_m);
  return most_m;
}

std::unique_ptr<penetration::BackEnd> make_back_end(const ContactOptions& options, const penetration::Limits& limits) {
  return options.maker ? options.maker(limits) : penetration::make_simd(limits);
}

void gather(const penetration::FeltSurface& felt, const PieceList& pieces, std::vector<std::uint32_t>& out) {
  out.clear();
  for (const std::uint32_t piece : pieces.view()) {
    const auto triangles = felt.triangles_of_piece(piece);
    out.insert(out.end(), triangles.begin(), triangles.end());  // within the capacity reserved for all triangles
  }
}

}  // namespace

DepthStage::DepthStage(const ContactTracker& tracker, const penetration::Limits& limits, const ContactOptions& options)
    : tracker_(tracker),
      options_(options),
      windows_(limits),
      plane_depth_(limits),
      tool_layers_(std::make_unique<LayeredSurface>(tracker.tool_felt(), kLayersReach * options.tolerance_m)),
      back_end_(std::make_unique<penetration::TwoWidths>(make_back_end(options, limits))),
      traits_(back_end_->traits()),
      scheduler_(tracker.tool_felt(),
                 {.most_searches = options.most_searches, .may_extrapolate = traits_.may_substitute}),
      widths_({.least_m = options.soft_width_m, .most_stiffness_N_per_m = options.most_stiffness_N_per_m}) {
  back_end_->prepare(tracker_.tool_felt());
  for (const TrackedObject& object : tracker_.objects()) {
    back_end_->prepare(*object.felt);
    auto layers = std::make_unique<LayeredSurface>(*object.felt, kLayersReach * options.tolerance_m);
    auto fallback =
        std::make_unique<PointFallback>(*layers, *tool_layers_, options.tolerance_m, options.heights == nullptr);
    points_.push_back({std::move(layers), std::move(fallback)});
  }
  for (auto& triangles : triangles_s_) triangles.reserve(limits.coarse_triangles);
  for (auto& triangles : triangles_t_) triangles.reserve(limits.coarse_triangles);
}

penetration::Query DepthStage::make_query(std::size_t i, const Pose& X_WT) noexcept {
  const Track& track = tracker_.tracks()[i];
  const TrackedObject& object = tracker_.object_of(track);
  gather(*object.felt, track.cluster.pieces_s, triangles_s_[i]);
  gather(tracker_.tool_felt(), track.cluster.pieces_t, triangles_t_[i]);
  FieldDepth& field = fields_[i];
  field.triangles_s = triangles_s_[i], field.triangles_t = triangles_t_[i];
  const Pose X_CS = spatial::inverse(contact_frame(track.cluster));
  return {.s = {object.felt, X_CS, field.triangles_s},
          .t = {&tracker_.tool_felt(), X_CS * (spatial::inverse(object.X_WO) * X_WT), field.triangles_t},
          .contact = track.id,
          .window = penetration::kWholePlane,
          .samples = options_.grid_samples,
          .soft_width_m = field.soft_width_m,
          .depth_width_m = options_.soft_width_m,
          .deepest_m = deepest_m(track.cluster)};
}

bool DepthStage::fit_window(penetration::Query& query) noexcept {
  const double tail_m = std::max(kTailWidths * query.soft_width_m, kLeastTail_m);
  const auto window = windows_.fit(query.s, query.t, penetration::kWholePlane, tail_m, query.deepest_m);
  if (window) query.window = *window;
  return window.has_value();
}

bool DepthStage::may_lack_heights(std::uint32_t object) const noexcept {
  return options_.heights && !(options_.heights->has_all(object + 1) && options_.heights->has_all(kToolSurface));
}

/// A height that is off moves the surface along its chart's axis; along the contact's direction that is as much more as
/// the axis leans. Soft maxima of two overlaps that differ by so much at most differ by no more.
void DepthStage::note_lack(std::size_t i, const penetration::Query& query) noexcept {
  const Track& track = tracker_.tracks()[i];
  FieldDepth& field = fields_[i];
  field.lacks_heights = false;
  field.outline_off_m = 0;
  const auto note = [&](std::uint32_t surface, const penetration::Patch& patch,
                        const penetration::FacingPatch& projected) {
    if (options_.heights->has_all(surface)) return;
    double off_m = 0;
    visit_tiles_under(projected, query.window, [&](std::uint32_t tile) {
      if (options_.heights->has({surface, tile})) return;
      field.lacks_heights = true;
      const glm::dvec3& axis_O = patch.surface->chart_axis_O(patch.surface->place_of(tile).chart);
      const double leaning = std::max(std::abs(spatial::rotate(patch.X_CO, axis_O).z), kMostLeaning);
      off_m = std::max(off_m, options_.heights->off_m({surface, tile}) / leaning);
    });
    field.outline_off_m += off_m;
  };
  if (may_lack_heights(track.object)) {
    note(track.object + 1, query.s, windows_.s());
    note(kToolSurface, query.t, windows_.t());
  }
}

/// Points are made from any tile, so without all of them the coarse pieces are felt: off by what lies over these.
void DepthStage::note_lack_of_layers(std::size_t i) noexcept {
  FieldDepth& field = fields_[i];
  field.lacks_heights = true;
  const auto relief_m = [](const penetration::FeltSurface& felt, std::span<const std::uint32_t> triangles) {
    double most_m = 0;
    for (const std::uint32_t k : triangles) most_m = std::max({most_m, -felt.relief(k).low_m, felt.relief(k).high_m});
    return most_m;
  };
  field.outline_off_m = relief_m(*tracker_.object_of(tracker_.tracks()[i]).felt, field.triangles_s) +
                        relief_m(tracker_.tool_felt(), field.triangles_t);
}

/// A back end that finds a contact's extent may not look where heights lack.
bool DepthStage::wants_window(std::uint32_t object) const noexcept {
  return (may_lack_heights(object) || !traits_.finds_extent) && !is_plain(tracker_.objects()[object]);
}

bool DepthStage::is_plain(const TrackedObject& object) const noexcept {
  return !ablated(Mechanism::kClosedForms) && !object.is_textured && options_.soft_width_m > 0 &&
         traits_.may_substitute;
}

bool DepthStage::may_be_searched(std::size_t i, penetration::Query& query) noexcept {
  if (wants_window(tracker_.tracks()[i].object) && !fit_window(query)) return false;
  note_lack(i, query);
  return true;
}

/// One after the other where a budget is kept, so that a costly one is noticed; all at once where that takes less time.
void DepthStage::search(const Pose& X_WT, StageTimes& times) noexcept {
  const bool is_one_by_one = scheduler_.has_budget() && !traits_.batches;
  const std::uint64_t searches_before = back_end_->searches();
  asked_ = 0;
  std::size_t answered = 0;
  const auto evaluate = [&] {
    back_end_->evaluate({&queries_[answered], asked_ - answered}, {&answers_[answered], asked_ - answered});
    answered = asked_;
  };
  for (DepthJob& job : scheduler_.by_urgency()) {
    FieldDepth& field = fields_[job.i];
    if (!scheduler_.takes(job, asked_, back_end_->searches() - searches_before)) {
      field.depth = scheduler_.extrapolated(job);
      const HeightLack lack = scheduler_.lack(job.query.contact);  // of the heights that it was searched with
      field.lacks_heights = lack.lacks, field.outline_off_m = lack.off_m;
    } else if (!may_be_searched(job.i, job.query)) {
      scheduler_.keep(job.query, {}, {});
    } else {
      asked_by_[asked_] = job.i;
      queries_[asked_++] = job.query;
      if (is_one_by_one) evaluate();
    }
  }
  if (answered < asked_) evaluate();
  for (std::size_t q = 0; q < asked_; ++q) {
    FieldDepth& field = fields_[asked_by_[q]];
    field.depth = answers_[q];
    scheduler_.keep(queries_[q], answers_[q], {field.lacks_heights, field.outline_off_m});
    // What was extrapolated is not judged: its second derivative is of a width that it may not have any more.
    if (queries_[q].estimates_hessian) judge(asked_by_[q], X_WT, times);
  }
}

void DepthStage::find(const Pose& X_WT, double dt_s, bool wants_curvature, StageTimes& times) noexcept {
  times.closed_forms = times.hessians = times.floors = times.point_contacts = times.points = 0;
  times.widest_m = 0;
  scheduler_.begin_answer();
  const std::span<const Track> tracks = tracker_.tracks();
  for (const Track& track : tracks)
    if (track.predecessor != 0 && !ablated(Mechanism::kWidthNames)) widths_.rename(track.predecessor, track.id);
  widths_.begin_answer(dt_s);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    const TrackedObject& object = tracker_.object_of(track);
    FieldDepth& field = fields_[i] = {};
    field.soft_width_m = widths_.width_m(track.id);
    field.layers = points_[track.object].fallback->share_by_layers(
        track.cluster, object.pairs, spatial::transform_point(spatial::inverse(object.X_WO), X_WT.p));
    if (field.layers.share >= 1 && !may_lack_heights(track.object)) continue;
    penetration::Query query = make_query(i, X_WT);
    query.wants_hessian = wants_curvature && traits_.has_hessian;
    if (field.layers.share > 0 && may_lack_heights(track.object)) {
      note_lack_of_layers(i);
    } else if (is_plain(object)) {
      field.depth = plane_depth_.evaluate(query);
      ++times.closed_forms;
    } else {
      query.estimates_hessian = traits_.has_hessian && widths_.wants_judging(track.id);
      scheduler_.add(i, query);
    }
  }
  search(X_WT, times);
  times.grids = static_cast<std::uint32_t>(asked_);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const penetration::Penetration& depth = fields_[i].depth;
    widths_.note(tracks[i].id, tracker_.object_of(tracks[i]).material.stiffness_N_per_m,
                 is_credible(depth) ? depth.depth_m : 0);
    times.widest_m = std::max(times.widest_m, fields_[i].soft_width_m);
  }
}

/// How wide the contact is next time, by what its Hessian, or the estimate of it, says of its stiffness.
void DepthStage::judge(std::size_t i, const Pose& X_WT, StageTimes& times) noexcept {
  const Track& track = tracker_.tracks()[i];
  const penetration::Penetration& depth = fields_[i].depth;
  if (!is_credible(depth)) return;
  ++times.hessians;
  const TrackedObject& object = tracker_.object_of(track);
  const Pose X_CT = spatial::inverse(object.X_WO * contact_frame(track.cluster)) * X_WT;
  const double arm_m = std::max(glm::distance(depth.p_CQ_C, X_CT.p), kLeastArm_m);
  widths_.judge(track.id, object.material.stiffness_N_per_m, depth.depth_m, depth.gradient, depth.hessian, arm_m);
}

OtherShares DepthStage::blend(Contact& contact, std::size_t i, const Pose& X_WT, bool is_drawn_on,
                              StageTimes& times) noexcept {
  const Track& track = tracker_.tracks()[i];
  const FieldDepth& field = fields_[i];
  PointFallback& points = *points_[track.object].fallback;
  const TrackedObject& object = tracker_.object_of(track);
  const double margin_m = kTipLossWidths * options_.soft_width_m + sunk_m(*object.felt, field.triangles_s) +
                          sunk_m(tracker_.tool_felt(), field.triangles_t);
  const bool is_height_field = is_credible(field.depth);
  const bool is_at_edge = !is_drawn_on && (!is_height_field || (field.depth.doubts & penetration::kSilhouette) != 0);
  const Pose X_ST = spatial::inverse(object.X_WO) * X_WT;
  std::optional<DepthSource> as_felt;
  const auto as_points = [&]() -> const DepthSource& {
    if (!as_felt) {
      as_felt = points.depth(track.cluster, X_ST, field.soft_width_m);
      if (field.soft_width_m > options_.soft_width_m)  // the width says where they push, and not how far
        as_felt->depth_m = points.depth(track.cluster, X_ST, options_.soft_width_m).depth_m;
      ++times.point_contacts;
      times.points += points.points();
    }
    return *as_felt;
  };
  OtherShares shares;
  PointShare layers = field.layers;
  const bool may_be_points = object.is_textured && points.has_points() && !may_lack_heights(track.object);
  if (field.layers.share < 1 && is_height_field && may_be_points && points.has_layers()) {
    const auto coarse = coarse_depth(track.cluster, object.pairs, X_ST.p, options_.soft_width_m);
    const double rise_m = kWideGainWidths * options_.soft_width_m + risen_m(*object.felt, field.triangles_s) +
                          risen_m(tracker_.tool_felt(), field.triangles_t);
    layers = either(layers, share_by_ceiling(contact, coarse, rise_m, object.X_WO));
  }
  const bool is_well_above =
      is_height_field && contact.depth_m > track.cluster.depth_m - (is_at_edge ? 0 : margin_m) + kWellAbove_m;
  if (field.layers.share < 1 && !is_well_above) {
    const auto coarse = coarse_depth(track.cluster, object.pairs, X_ST.p, options_.soft_width_m);
    ++times.floors;
    bool is_known = is_height_field;
    // The fewest points stand where a tip touches: the floor is the least there, too.
    if (may_be_points) {
      const PointShare share = share_by_floor(contact, is_height_field, coarse, margin_m, object.X_WO);
      if (points.has_layers() && coarse.depth_m < options_.tolerance_m) {
        // Among layers coarse pieces that cross each other say little: points, or that there are none, say it all.
        layers = either(layers, share);
      } else if (share.share > 0 && std::isfinite(as_points().depth_m)) {
        mix_in(contact, share, as_points(), options_.tolerance_m, object.X_WO);
        shares.points = share.share;
        is_known = true;
      }
    }
    const double floor_m = least_depth_m(coarse, margin_m, options_.soft_width_m, is_at_edge);
    shares.coarse = keep_above(contact, coarse, floor_m, options_.soft_width_m, object.X_WO, is_known);
    if (!is_known) shares.coarse = 1;
  }
  if (layers.share > 0) {
    mix_in(contact, layers, as_points(), options_.tolerance_m, object.X_WO);
    shares.coarse *= 1 - layers.share;
    shares.points = 1 - (1 - shares.points) * (1 - layers.share);
  }
  return shares;
}

std::span<const SurfaceTile> DepthStage::tiles_needed(const Pose& X_WT, double margin_m, double soft_width_m) {
  needed_.clear();
  const std::span<const Track> tracks = tracker_.tracks();
  std::array<std::size_t, kMaxContacts> order;
  std::iota(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(tracks.size()), std::size_t{0});
  std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(tracks.size()),
            [&](std::size_t a, std::size_t b) { return tracks[a].cluster.depth_m > tracks[b].cluster.depth_m; });
  for (const std::size_t i : std::span(order).first(tracks.size())) {
    fields_[i].soft_width_m = std::max(options_.soft_width_m, soft_width_m);
    penetration::Query query = make_query(i, X_WT);
    if (!fit_window(query)) continue;
    query.window = {query.window.low - margin_m, query.window.high + margin_m};
    const auto note = [this](std::uint32_t surface) {
      return [this, surface](std::uint32_t tile) { needed_.push_back({surface, tile}); };
    };
    visit_tiles_under(windows_.s(), query.window, note(tracks[i].object + 1));
    visit_tiles_under(windows_.t(), query.window, note(kToolSurface));
  }
  return needed_;
}

}  // namespace farfeel::contact
