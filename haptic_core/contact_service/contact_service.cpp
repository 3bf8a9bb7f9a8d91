#include "haptic_core/contact_service/contact_service.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/assembly.h"
#include "haptic_core/contact/clustering.h"
#include "haptic_core/contact/coarse_depth.h"
#include "haptic_core/contact/crossed_sheets.h"
#include "haptic_core/contact/friction_memory.h"
#include "haptic_core/contact/handover.h"
#include "haptic_core/contact/plane_depth.h"
#include "haptic_core/contact/soft_widths.h"
#include "haptic_core/penetration/budgeted.h"
#include "haptic_core/penetration/reference.h"
#include "haptic_core/penetration/simd.h"
#include "haptic_core/penetration/window.h"

namespace farfeel::contact_service {
namespace {

using contact::Cluster;
using contact::ContactSet;
using contact::kMaxContacts;
using spatial::Pose;

/// A textured contact's linearisation holds for a fraction of a ridge; beyond it only says which way is out.
constexpr double kTexturedRange_m = 0.25e-3;
/// Contacts of two clusters nearer than this in place, and alike in direction, begin to be one contact.
constexpr double kSamePlace_m = 4e-3;
/// Time between two answers never counts as more: after a pause clusters may go where they like.
constexpr double kLongestStep_s = 0.1;
/// The window keeps this many soft widths of overlap below the peak; weights beyond are under 1e-6.
constexpr double kTailWidths = 14;
constexpr double kLeastTail_m = 20e-6;
/// What a soft maximum loses against the exact depth where a tip touches, whose area is far below a0; steeper tips than
/// ten to one lose more. The coarse depth less this and the surfaces' relief is the least that is felt.
constexpr double kTipLossWidths = 10;
/// Depths this far above that floor need not know it: a cluster's depth follows its pairs at bounded speed.
constexpr double kWellAbove_m = 1e-3;
/// Where the coarse depth has more of a share than this, the grid's curvature says little about what is felt.
constexpr double kLittle = 0.1;
/// A contact's arm from the tool's origin never counts as shorter when its stiffness against rotations is judged.
constexpr double kLeastArm_m = 10e-3;
/// Where the coarse floor has more of a contact than this, what becomes of it is not the height fields' doing.
constexpr double kFlooredShare = 0.05;

class Stopwatch {
 public:
  /// Microseconds since the last lap, or since construction.
  double lap_us() noexcept {
    const auto now = std::chrono::steady_clock::now();
    const double us = std::chrono::duration<double, std::micro>(now - last_).count();
    last_ = now;
    return us;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// What the service keeps for each scene object.
struct ObjectState {
  ObjectState(const TouchableObject& object, const TouchableObject& tool, const collision::HullTree& tool_tree)
      : X_WO(object.X_WO),
        material(contact::combined(object.material, tool.material)),
        own_felt(object.prepared ? nullptr : std::make_unique<penetration::FeltSurface>(*object.felt)),
        felt(object.prepared ? object.prepared : own_felt.get()),
        tree(std::make_unique<collision::HullTree>(collision::ConvexPieces(*object.felt))),
        proximity(*tree, tool_tree),
        crossed(*object.felt, *tree, *tool.felt, tool_tree) {}

  Pose X_WO;
  contact::Material material;
  std::unique_ptr<penetration::FeltSurface> own_felt;
  const penetration::FeltSurface* felt;
  std::unique_ptr<collision::HullTree> tree;  // behind a pointer: the query keeps its address
  collision::ProximityQuery proximity;
  contact::CrossedSheets crossed;
  std::span<const collision::ProximityPair> pairs;  // of the answer at hand
  contact::Clustering clustering;
};

/// One cluster on its way to being a contact.
struct Work {
  std::uint32_t object;
  Cluster cluster;
  double soft_width_m;
  penetration::Penetration depth;  // unknown where the patches share nothing
  bool lacks_heights = false;
};

std::size_t most_triangles(std::span<const TouchableObject> objects, const TouchableObject& tool) {
  std::size_t most = tool.felt->coarse.triangles.size();
  for (const TouchableObject& object : objects) most = std::max(most, object.felt->coarse.triangles.size());
  return most;
}

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

/// How far below the coarse surface the felt one may lie along its normal, at most [m].
double sunk_m(const penetration::FeltSurface& felt, std::span<const std::uint32_t> triangles) {
  double most_m = 0;
  for (const std::uint32_t i : triangles) most_m = std::max(most_m, -felt.relief(i).low_m);
  return most_m;
}

void gather(const penetration::FeltSurface& felt, const contact::PieceList& pieces, std::vector<std::uint32_t>& out) {
  out.clear();
  for (const std::uint32_t piece : pieces.view()) {
    const auto triangles = felt.triangles_of_piece(piece);
    out.insert(out.end(), triangles.begin(), triangles.end());  // within the capacity reserved for all triangles
  }
}

/// The same for the same pieces in whatever order, and hardly ever for others.
std::uint64_t pieces_of(const Cluster& cluster) {
  const auto mixed = [](std::uint64_t x) {  // the finaliser of SplitMix64
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return x ^ x >> 31;
  };
  std::uint64_t sum = 0;
  for (const std::uint32_t piece : cluster.pieces_s.view()) sum += mixed(2 * std::uint64_t{piece} + 2);
  for (const std::uint32_t piece : cluster.pieces_t.view()) sum += mixed(2 * std::uint64_t{piece} + 3);
  return sum;
}

}  // namespace

class ContactService::State {
 public:
  State(std::span<const TouchableObject> objects, const TouchableObject& tool, const ContactOptions& options)
      : options_(options),
        limits_{.coarse_triangles = most_triangles(objects, tool)},
        own_tool_felt_(tool.prepared ? nullptr : std::make_unique<penetration::FeltSurface>(*tool.felt)),
        tool_felt_(tool.prepared ? tool.prepared : own_tool_felt_.get()),
        tool_tree_(collision::ConvexPieces(*tool.felt)),
        windows_(limits_),
        plane_depth_(limits_),
        tiles_under_(limits_),
        back_end_(options.most_searches > 0
                      ? penetration::make_budgeted(make_back_end(options, limits_), options.most_searches)
                      : make_back_end(options, limits_)),
        widths_({.least_m = options.soft_width_m, .most_stiffness_N_per_m = options.most_stiffness_N_per_m}) {
    objects_.reserve(objects.size());
    back_end_->prepare(*tool_felt_);
    for (const TouchableObject& object : objects) {
      objects_.emplace_back(object, tool, tool_tree_);
      back_end_->prepare(*objects_.back().felt);
    }
    for (auto& triangles : triangles_s_) triangles.reserve(limits_.coarse_triangles);
    for (auto& triangles : triangles_t_) triangles.reserve(limits_.coarse_triangles);
  }

  const ContactSet& answer(const ToolPose& tool) noexcept;
  void restart() noexcept {
    has_answered_ = false;
    friction_.restart();
    widths_.restart();
    handover_.restart();
    for (ObjectState& object : objects_) object.clustering.restart();
  }
  [[nodiscard]] bool lacks_heights(std::uint32_t contact_id) const noexcept;
  [[nodiscard]] std::span<const SurfaceTile> tiles_needed(const Pose& X_WT, double margin_m);
  [[nodiscard]] const StageTimes& times() const { return times_; }
  [[nodiscard]] std::uint32_t contacts_near() const { return static_cast<std::uint32_t>(work_count_); }
  [[nodiscard]] const contact::DoubtCounts& doubts() const { return doubts_; }

 private:
  [[nodiscard]] std::uint32_t id_of(const Work& work) const {
    return work.cluster.id * static_cast<std::uint32_t>(objects_.size()) + work.object;
  }
  void find_clusters(const Pose& X_WT, double dt_s) noexcept;
  [[nodiscard]] std::optional<penetration::Query> query_for(std::size_t work, const Pose& X_WT,
                                                            bool wants_window) noexcept;
  [[nodiscard]] bool has_heights(std::uint32_t object, const penetration::Query&) noexcept;
  void ask_depths(const Pose& X_WT) noexcept;
  [[nodiscard]] bool wants_window(const ObjectState&) const noexcept;
  void soften(std::size_t work, const Pose& X_WT) noexcept;
  double keep_above_the_coarse(contact::Contact&, std::size_t i, const Pose& X_WT) noexcept;
  void assemble(const ToolPose& tool, double dt_s) noexcept;
  [[nodiscard]] bool is_textured(const ObjectState& object) const {
    return object.felt->haptic().is_textured() || tool_felt_->haptic().is_textured();
  }
  /// Whether contacts with this object need no grid. The slow back ends answer everything themselves.
  [[nodiscard]] bool is_plain(const ObjectState& object) const {
    return !is_textured(object) && options_.soft_width_m > 0 &&
           (options_.back_end == DepthBackEnd::kSimd || options_.back_end == DepthBackEnd::kGiven);
  }

  ContactOptions options_;
  penetration::Limits limits_;
  std::unique_ptr<penetration::FeltSurface> own_tool_felt_;
  const penetration::FeltSurface* tool_felt_;
  collision::HullTree tool_tree_;
  std::vector<ObjectState> objects_;
  penetration::WindowFinder windows_;
  contact::PlaneDepth plane_depth_;
  TilesUnder tiles_under_;
  std::unique_ptr<penetration::BackEnd> back_end_;

  std::array<std::vector<std::uint32_t>, kMaxContacts> triangles_s_, triangles_t_;
  std::array<Work, kMaxContacts> work_{};
  std::size_t work_count_ = 0;
  std::array<penetration::Query, kMaxContacts> queries_{};
  std::array<penetration::Penetration, kMaxContacts> answers_{};
  std::array<std::size_t, kMaxContacts> asked_by_{};  // index into work_ of each query

  std::vector<SurfaceTile> needed_;
  ContactSet set_;
  contact::FrictionMemory friction_;
  contact::SoftWidths widths_;
  contact::Handover handover_;
  std::array<contact::Making, kMaxContacts> makings_{};
  StageTimes times_;
  contact::DoubtCounts doubts_;
  bool has_answered_ = false;
  bool wants_curvature_ = false;  // of the answer at hand
};

void ContactService::State::find_clusters(const Pose& X_WT, double dt_s) noexcept {
  Stopwatch watch;
  work_count_ = 0;
  set_.pairs_near = 0;
  times_.proximity_us = times_.clusters_us = 0;
  for (std::uint32_t i = 0; i < objects_.size(); ++i) {
    ObjectState& object = objects_[i];
    const Pose X_OT = spatial::inverse(object.X_WO) * X_WT;
    object.pairs =
        object.crossed.mended(object.proximity.nearer_than(options_.tolerance_m, X_OT), options_.tolerance_m, X_OT);
    set_.pairs_near += static_cast<std::uint32_t>(object.pairs.size());
    times_.proximity_us += watch.lap_us();
    for (const Cluster& cluster : object.clustering.update(object.pairs, options_.tolerance_m, dt_s)) {
      if (work_count_ < kMaxContacts) work_[work_count_++] = {i, cluster, options_.soft_width_m, {}, false};
    }
    times_.clusters_us += watch.lap_us();
  }
}

std::optional<penetration::Query> ContactService::State::query_for(std::size_t i, const Pose& X_WT,
                                                                   bool wants_window) noexcept {
  const Work& work = work_[i];
  const ObjectState& object = objects_[work.object];
  gather(*object.felt, work.cluster.pieces_s, triangles_s_[i]);
  gather(*tool_felt_, work.cluster.pieces_t, triangles_t_[i]);
  const Pose X_CS = spatial::inverse(contact::contact_frame(work.cluster));
  penetration::Query query{.s = {object.felt, X_CS, triangles_s_[i]},
                           .t = {tool_felt_, X_CS * (spatial::inverse(object.X_WO) * X_WT), triangles_t_[i]},
                           .contact = id_of(work),
                           .window = penetration::kWholePlane,
                           .samples = options_.grid_samples,
                           .soft_width_m = work.soft_width_m,
                           .deepest_m = deepest_m(work.cluster)};
  if (!wants_window) return query;
  const double tail_m = std::max(kTailWidths * work.soft_width_m, kLeastTail_m);
  const auto window = windows_.fit(query.s, query.t, penetration::kWholePlane, tail_m, query.deepest_m);
  if (!window) return std::nullopt;
  query.window = *window;
  return query;
}

bool ContactService::State::has_heights(std::uint32_t object, const penetration::Query& query) noexcept {
  if (!options_.heights) return true;
  const auto has = [this](std::uint32_t surface) {
    return [this, surface](std::uint32_t tile) { return options_.heights->has({surface, tile}); };
  };
  return tiles_under_.all(query.s, penetration::Side::kOutermost, query.window, has(object + 1)) &&
         tiles_under_.all(query.t, penetration::Side::kInnermost, query.window, has(kToolSurface));
}

/// The fast back ends find a contact's extent by themselves, but may not look where heights lack.
bool ContactService::State::wants_window(const ObjectState& object) const noexcept {
  const bool finds_extent = options_.back_end == DepthBackEnd::kSimd ||
                            (options_.back_end == DepthBackEnd::kGiven && !options_.maker->wants_window());
  return (options_.heights || !finds_extent) && !is_plain(object);
}

void ContactService::State::ask_depths(const Pose& X_WT) noexcept {
  std::size_t asked = 0, judged_at = kMaxContacts;
  times_.closed_forms = times_.hessians = 0;
  times_.widened_J = times_.widest_m = 0;
  const std::uint32_t judged = widths_.next_to_judge();
  for (std::size_t i = 0; i < work_count_; ++i) {
    Work& work = work_[i];
    const ObjectState& object = objects_[work.object];
    work.soft_width_m = widths_.width_m(id_of(work));
    auto query = query_for(i, X_WT, wants_window(object));
    if (!query) continue;
    query->wants_hessian = wants_curvature_;
    if (judged > 0 && id_of(work) == judged) query->wants_hessian = true, judged_at = i;
    if (is_plain(object)) {
      work.depth = plane_depth_.evaluate(*query);
      ++times_.closed_forms;
      continue;
    }
    work.lacks_heights = !has_heights(work.object, *query);
    if (work.lacks_heights) continue;
    asked_by_[asked] = i;
    queries_[asked++] = *query;
  }
  times_.grids = static_cast<std::uint32_t>(asked);
  if (asked > 0) back_end_->evaluate({queries_.data(), asked}, {answers_.data(), asked});
  for (std::size_t q = 0; q < asked; ++q) work_[asked_by_[q]].depth = answers_[q];
  if (judged_at < work_count_) soften(judged_at, X_WT);
  for (std::size_t i = 0; i < work_count_; ++i) {
    const Work& work = work_[i];
    widths_.note(id_of(work), objects_[work.object].material.stiffness_N_per_m,
                 contact::is_credible(work.depth) ? work.depth.depth_m : 0);
    times_.widest_m = std::max(times_.widest_m, work.soft_width_m);
  }
  widths_.end_answer();
}

/// The contact was asked for with its Hessian: when it is too stiff, or wider than it need be, it is asked for again.
void ContactService::State::soften(std::size_t i, const Pose& X_WT) noexcept {
  Work& work = work_[i];
  const ObjectState& object = objects_[work.object];
  if (work.lacks_heights || !contact::is_credible(work.depth)) return;
  ++times_.hessians;
  const double k_N_per_m = object.material.stiffness_N_per_m, before_m = work.depth.depth_m;
  const Pose X_CT = spatial::inverse(object.X_WO * contact::contact_frame(work.cluster)) * X_WT;
  const double arm_m = std::max(glm::distance(work.depth.p_CQ_C, X_CT.p), kLeastArm_m);
  const double width_m =
      widths_.judge(id_of(work), k_N_per_m, before_m, work.depth.gradient, work.depth.hessian, arm_m);
  if (width_m == work.soft_width_m) return;
  work.soft_width_m = width_m;
  auto query = query_for(i, X_WT, wants_window(object));
  if (!query) return;
  query->wants_hessian = wants_curvature_;
  if (is_plain(object)) {
    work.depth = plane_depth_.evaluate(*query);
  } else {
    back_end_->evaluate({&*query, 1}, {&work.depth, 1});
  }
  const auto energy_J = [&](double depth_m) { return 0.5 * k_N_per_m * std::pow(std::max(depth_m, 0.0), 2); };
  times_.widened_J = energy_J(work.depth.depth_m) - energy_J(before_m);
}

/// Returns the coarse depth's share of what is felt.
double ContactService::State::keep_above_the_coarse(contact::Contact& contact, std::size_t i,
                                                    const Pose& X_WT) noexcept {
  const Work& work = work_[i];
  const ObjectState& object = objects_[work.object];
  const double margin_m =
      kTipLossWidths * work.soft_width_m + sunk_m(*object.felt, triangles_s_[i]) + sunk_m(*tool_felt_, triangles_t_[i]);
  const bool is_known = contact::is_credible(work.depth);
  if (is_known && contact.depth_m > work.cluster.depth_m - margin_m + kWellAbove_m) return 0;
  const auto coarse =
      contact::coarse_depth(work.cluster, object.pairs, spatial::transform_point(spatial::inverse(object.X_WO), X_WT.p),
                            options_.soft_width_m);
  ++times_.floors;
  return contact::keep_above(contact, coarse, margin_m, options_.soft_width_m, object.X_WO, is_known);
}

bool ContactService::State::lacks_heights(std::uint32_t contact_id) const noexcept {
  return std::any_of(work_.begin(), work_.begin() + static_cast<std::ptrdiff_t>(work_count_),
                     [&](const Work& work) { return work.lacks_heights && id_of(work) == contact_id; });
}

std::span<const SurfaceTile> ContactService::State::tiles_needed(const Pose& X_WT, double margin_m) {
  needed_.clear();
  find_clusters(X_WT, kLongestStep_s);
  const auto end = work_.begin() + static_cast<std::ptrdiff_t>(work_count_);
  std::sort(work_.begin(), end, [](const Work& a, const Work& b) { return a.cluster.depth_m > b.cluster.depth_m; });
  for (std::size_t i = 0; i < work_count_; ++i) {
    auto query = query_for(i, X_WT, true);
    if (!query) continue;
    query->window = {query->window.low - margin_m, query->window.high + margin_m};
    const auto note = [this](std::uint32_t surface) {
      return [this, surface](std::uint32_t tile) {
        needed_.push_back({surface, tile});
        return true;
      };
    };
    tiles_under_.all(query->s, penetration::Side::kOutermost, query->window, note(work_[i].object + 1));
    tiles_under_.all(query->t, penetration::Side::kInnermost, query->window, note(kToolSurface));
  }
  return needed_;
}

void ContactService::State::assemble(const ToolPose& tool, double dt_s) noexcept {
  set_.pose_sequence = tool.sequence;
  set_.pose_time_ns = tool.time_ns;
  const Pose from_X_WT = set_.X_WT;
  set_.X_WT = tool.X_WT;
  times_.floors = 0;
  for (std::size_t i = 0; i < work_count_; ++i) {
    const Work& work = work_[i];
    const ObjectState& object = objects_[work.object];
    contact::Contact& contact = set_.contacts[i];
    contact = contact::contact_from(work.cluster, work.depth, object.X_WO, tool.X_WT.p);
    double coarse_share = work.lacks_heights ? 1 : 0;
    if (options_.soft_width_m > 0 && !work.lacks_heights) coarse_share = keep_above_the_coarse(contact, i, tool.X_WT);
    contact.curvature = {};
    if (wants_curvature_ && coarse_share < kLittle && contact::is_credible(work.depth) &&
        work.depth.hessian.allFinite()) {
      const Pose X_WC = object.X_WO * contact::contact_frame(work.cluster);
      contact.curvature = contact::Curvature::of(contact::turned(work.depth.hessian, X_WC.R));
    }
    contact.id = id_of(work);
    contact.object = work.object;
    contact.material = object.material;
    contact.lateral_range_m = is_textured(object) ? kTexturedRange_m : options_.tolerance_m;
    if (coarse_share > 0.5 || !contact::is_credible(work.depth)) contact.doubts |= contact::kFeltAsCoarse;
    makings_[i] = {.id = contact.id,
                   .made_from = pieces_of(work.cluster),
                   .is_provisional = work.lacks_heights,
                   .is_coarse = coarse_share > kFlooredShare || !contact::is_credible(work.depth),
                   .material = object.material};
  }
  set_.count = contact::without_repeats({set_.contacts.data(), work_count_}, kSamePlace_m);
  if (options_.hands_over) handover_.apply(set_, {makings_.data(), work_count_}, dt_s);
  contact::sum_wrench(set_, tool.V_WT_W);
  friction_.add(set_, from_X_WT);
  times_.frictions = friction_.remembered();
  doubts_.add(set_);
  times_.handed = options_.hands_over ? handover_.handed() : 0;
  times_.made_J = options_.hands_over ? handover_.made_J() : 0;
}

const ContactSet& ContactService::State::answer(const ToolPose& tool) noexcept {
  Stopwatch watch, whole;
  const double dt_s =
      has_answered_ ? std::clamp(1e-9 * static_cast<double>(tool.time_ns - set_.pose_time_ns), 0.0, kLongestStep_s)
                    : kLongestStep_s;
  has_answered_ = true;
  wants_curvature_ = tool.wants_curvature;
  find_clusters(tool.X_WT, dt_s);
  widths_.begin_answer(dt_s);
  watch.lap_us();
  ask_depths(tool.X_WT);
  times_.penetration_us = watch.lap_us();
  assemble(tool, dt_s);
  times_.assembly_us = watch.lap_us();
  times_.total_us = whole.lap_us();
  return set_;
}

ContactService::ContactService(std::span<const TouchableObject> objects, const TouchableObject& tool,
                               const ContactOptions& options)
    : state_(std::make_unique<State>(objects, tool, options)) {}
ContactService::~ContactService() = default;
ContactService::ContactService(ContactService&&) noexcept = default;
ContactService& ContactService::operator=(ContactService&&) noexcept = default;

const ContactSet& ContactService::answer(const ToolPose& tool) noexcept {
  return state_->answer(tool);
}
bool ContactService::lacks_heights(std::uint32_t contact_id) const noexcept {
  return state_->lacks_heights(contact_id);
}
std::span<const SurfaceTile> ContactService::tiles_needed(const ToolPose& tool, double margin_m) {
  return state_->tiles_needed(tool.X_WT, margin_m);
}
std::uint32_t ContactService::contacts_near() const noexcept {
  return state_->contacts_near();
}
void ContactService::restart() noexcept {
  state_->restart();
}
const StageTimes& ContactService::last_times() const noexcept {
  return state_->times();
}
const contact::DoubtCounts& ContactService::doubts() const noexcept {
  return state_->doubts();
}

}  // namespace farfeel::contact_service
