#include "haptic_core/contact_service/contact_service.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "haptic_core/contact/assembly.h"
#include "haptic_core/contact/coarse_depth.h"
#include "haptic_core/contact/friction_memory.h"
#include "haptic_core/contact/handover.h"
#include "haptic_core/contact/repeats.h"
#include "haptic_core/contact_service/depths.h"
#include "haptic_core/contact_service/near_contacts.h"
#include "haptic_core/contact_service/proxy.h"
#include "haptic_core/contact_service/stopwatch.h"

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
/// What a soft maximum loses against the exact depth where a tip touches, whose area is far below a0; steeper tips than
/// ten to one lose more. The coarse depth less this and the surfaces' relief is the least that is felt.
constexpr double kTipLossWidths = 10;
/// What it gains where much of a plane touches, at most: where height fields are deeper than the coarse depth by so
/// much and the surfaces' relief, they take one layer for another.
constexpr double kWideGainWidths = 5;
/// Depths this far above that floor need not know it: a cluster's depth follows its pairs at bounded speed.
constexpr double kWellAbove_m = 1e-3;
/// Where the coarse depth has more of a share than this, the grid's curvature says little about what is felt.
constexpr double kLittle = 0.1;
/// Where the coarse floor has more of a contact than this, what becomes of it is not the height fields' doing.
constexpr double kFlooredShare = 0.05;

/// Of the tolerance: a cluster's depth is the coarse pieces', and relief stands up to the rest of it above them.
constexpr double kKnownShare = 0.8;
std::size_t most_triangles(std::span<const TouchableObject> objects, const TouchableObject& tool) {
  std::size_t most = tool.felt->coarse.triangles.size();
  for (const TouchableObject& object : objects) most = std::max(most, object.felt->coarse.triangles.size());
  return most;
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
        near_(objects, tool, options.tolerance_m, !options.heights),
        depths_(near_, {.coarse_triangles = most_triangles(objects, tool)}, options) {}

  const ContactSet& answer(const ToolPose& tool) noexcept;
  void restart() noexcept {
    has_answered_ = false;
    friction_.restart();
    repeats_.restart();
    handover_.restart();
    depths_.restart();
    near_.restart();
    proxy_.restart();
  }
  [[nodiscard]] std::optional<double> outline_off_m(std::uint32_t contact_id) const noexcept;
  [[nodiscard]] std::span<const SurfaceTile> tiles_needed(const ToolPose& tool, double margin_m, double soft_width_m) {
    near_.go_to(1e-9 * static_cast<double>(tool.time_ns));
    near_.find(tool.X_WT, kLongestStep_s, times_);
    return depths_.tiles_needed(tool.X_WT, margin_m, soft_width_m);
  }
  [[nodiscard]] const StageTimes& times() const { return times_; }
  [[nodiscard]] const Proxy& proxy() const { return proxy_; }
  [[nodiscard]] std::uint32_t contacts_near() const { return static_cast<std::uint32_t>(near_.all().size()); }
  [[nodiscard]] double fastest_near_m_s(const ToolPose& tool) const noexcept;
  [[nodiscard]] const motion::MovingObjects& moving() const { return near_.moving(); }
  [[nodiscard]] const contact::DoubtCounts& doubts() const { return doubts_; }

 private:
  /// Shares of what is felt of a contact that are no height field's.
  struct StandIns {
    double coarse = 0, points = 0;
  };
  StandIns stand_in(contact::Contact&, const NearContact&, const Pose& X_WT) noexcept;
  void find_near(const ToolPose& tool, double dt_s) noexcept;
  void assemble(const ToolPose& tool, double dt_s) noexcept;

  ContactOptions options_;
  NearContacts near_;
  Depths depths_;
  Proxy proxy_;
  ContactSet set_;
  contact::FrictionMemory friction_;
  contact::Repeats repeats_{kSamePlace_m};
  contact::Handover handover_;
  std::array<contact::Making, kMaxContacts> makings_{};
  StageTimes times_;
  contact::DoubtCounts doubts_;
  bool has_answered_ = false;
};

/// Where the height fields are not to be believed: the coarse pieces' depth is the least that is felt, and points of
/// the displaced surfaces are felt in their place.
ContactService::State::StandIns ContactService::State::stand_in(contact::Contact& contact, const NearContact& near,
                                                                const Pose& X_WT) noexcept {
  const FeltObject& object = near_.object_of(near);
  const double margin_m = kTipLossWidths * options_.soft_width_m + sunk_m(*object.felt, near.triangles_s) +
                          sunk_m(near_.tool_felt(), near.triangles_t);
  const bool is_height_field = contact::is_credible(near.depth);
  const Pose X_ST = spatial::inverse(object.X_WO) * X_WT;
  std::optional<contact::CoarseDepth> points;
  const auto as_points = [&]() -> const contact::CoarseDepth& {
    if (!points) {
      points = object.as_points->depth(near.cluster, X_ST, near.soft_width_m);
      if (near.soft_width_m > options_.soft_width_m)  // the width says where they push, and not how far
        points->depth_m = object.as_points->depth(near.cluster, X_ST, options_.soft_width_m).depth_m;
      ++times_.point_contacts;
      times_.points += object.as_points->points();
    }
    return *points;
  };
  StandIns shares;
  contact::PointShare layers = near.layers;
  const bool may_be_points =
      object.is_textured && object.as_points->has_points() && !depths_.may_lack_heights(near.object);
  if (near.layers.share < 1 && is_height_field && may_be_points && object.as_points->has_layers()) {
    const auto coarse = contact::coarse_depth(near.cluster, object.pairs, X_ST.p, options_.soft_width_m);
    const double rise_m = kWideGainWidths * options_.soft_width_m + risen_m(*object.felt, near.triangles_s) +
                          risen_m(near_.tool_felt(), near.triangles_t);
    layers = contact::either(layers, contact::share_by_ceiling(contact, coarse, rise_m, object.X_WO));
  }
  const bool is_well_above = is_height_field && contact.depth_m > near.cluster.depth_m - margin_m + kWellAbove_m;
  if (near.layers.share < 1 && !is_well_above) {
    const auto coarse = contact::coarse_depth(near.cluster, object.pairs, X_ST.p, options_.soft_width_m);
    ++times_.floors;
    bool is_known = is_height_field;
    // The fewest points stand where a tip touches: the floor is the least there, too.
    if (may_be_points) {
      const contact::PointShare share =
          contact::share_by_floor(contact, is_height_field, coarse, margin_m, object.X_WO);
      if (object.as_points->has_layers() && coarse.depth_m < options_.tolerance_m) {
        // Among layers coarse pieces that cross each other say little: points, or that there are none, say it all.
        layers = contact::either(layers, share);
      } else if (share.share > 0 && std::isfinite(as_points().depth_m)) {
        contact::mix_in(contact, share, as_points(), options_.tolerance_m, object.X_WO);
        shares.points = share.share;
        is_known = true;
      }
    }
    shares.coarse = contact::keep_above(contact, coarse, margin_m, options_.soft_width_m, object.X_WO, is_known);
    if (!is_known) shares.coarse = 1;
  }
  if (layers.share > 0) {
    contact::mix_in(contact, layers, as_points(), options_.tolerance_m, object.X_WO);
    shares.coarse *= 1 - layers.share;
    shares.points = 1 - (1 - shares.points) * (1 - layers.share);
  }
  return shares;
}

std::optional<double> ContactService::State::outline_off_m(std::uint32_t contact_id) const noexcept {
  for (const NearContact& near : near_.all()) {
    if (near.id == contact_id && near.lacks_heights) return near.outline_off_m;
  }
  return std::nullopt;
}

double ContactService::State::fastest_near_m_s(const ToolPose& tool) const noexcept {
  double fastest_m_s = 0;
  for (const NearContact& near : near_.all()) {
    const glm::dvec3 p_WC = spatial::transform_point(near_.object_of(near).X_WO, near.cluster.p_S);
    const motion::Moved* const moved = near_.moving().find(near.object);
    const glm::dvec3 v_object_m_s = moved ? moved->twist_at(p_WC).linear_m_s : glm::dvec3(0);
    const glm::dvec3 v_tool_m_s = spatial::velocity_at(tool.V_WT_W, p_WC - tool.X_WT.p);
    fastest_m_s = std::max(fastest_m_s, glm::distance(v_tool_m_s, v_object_m_s));
  }
  return fastest_m_s;
}

/// What is near the proxy, once that has gone as far towards the tool as it may.
void ContactService::State::find_near(const ToolPose& tool, double dt_s) noexcept {
  const double reach_m = kKnownShare * options_.tolerance_m;
  proxy_.set_out(tool.X_WT, dt_s, near_.moving());
  while (proxy_.go_on(reach_m)) {
    near_.find(proxy_.X_WP(), dt_s, times_);
    proxy_.begin_contacts();
    for (const NearContact& near : near_.all()) {
      const Pose& X_WO = near_.object_of(near).X_WO;
      proxy_.note(contact::contact_from(near.cluster, {}, X_WO, proxy_.X_WP().p),
                  near_.deepest_m(near) - near.cluster.depth_m);
    }
  }
  near_.find(proxy_.X_WP(), dt_s, times_);
}

void ContactService::State::assemble(const ToolPose& tool, double dt_s) noexcept {
  set_.pose_sequence = tool.sequence;
  set_.pose_time_ns = tool.time_ns;
  const Pose from_X_WT = set_.X_WT;
  set_.X_WT = tool.X_WT;
  set_.pairs_near = near_.pairs();
  times_.floors = times_.point_contacts = times_.points = 0;
  times_.behind_m = glm::length(proxy_.p_PT_W());
  proxy_.begin_contacts();
  const Pose& X_WP = proxy_.X_WP();
  const std::span<const NearContact> all = near_.all();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const NearContact& near = all[i];
    const FeltObject& object = near_.object_of(near);
    contact::Contact& contact = set_.contacts[i];
    contact = contact::contact_from(near.cluster, near.depth, object.X_WO, X_WP.p);
    StandIns shares{.coarse = contact::is_credible(near.depth) ? 0.0 : 1.0};
    const bool lacks_points = near.lacks_heights && near.layers.share > 0;
    if (options_.soft_width_m > 0 && !lacks_points) shares = stand_in(contact, near, X_WP);
    const bool is_height_field = shares.points < 1 && contact::is_credible(near.depth);
    contact.curvature = {};
    if (tool.wants_curvature && shares.coarse + shares.points < kLittle && is_height_field &&
        near.depth.hessian.allFinite()) {
      const Pose X_WC = object.X_WO * contact::contact_frame(near.cluster);
      contact.curvature = contact::Curvature::of(contact::turned(near.depth.hessian, X_WC.R));
    }
    contact.id = near.id;
    contact.object = near.object;
    contact.material = object.material;
    contact.lateral_range_m = object.is_textured ? kTexturedRange_m : options_.tolerance_m;
    if (shares.coarse > 0.5) contact.doubts |= contact::kFeltAsCoarse;
    if (near.lacks_heights) contact.doubts |= contact::kFeltByOutline;
    proxy_.note(contact, near_.deepest_m(near) - std::max(contact.depth_m, near.cluster.depth_m));
    contact = proxy_.drawn_on(contact);
    makings_[i] = {.id = contact.id,
                   .made_from = pieces_of(near.cluster),
                   .is_provisional = near.lacks_heights,
                   .is_coarse = shares.coarse > kFlooredShare || (shares.points < 1 && !is_height_field),
                   .material = object.material};
  }
  set_.count = static_cast<std::uint32_t>(all.size());
  repeats_.fade(set_, from_X_WT, near_.moving(), dt_s);
  if (options_.hands_over) handover_.apply(set_, {makings_.data(), all.size()}, near_.moving(), dt_s);
  contact::sum_wrench(set_, tool.V_WT_W, near_.moving());
  friction_.add(set_, from_X_WT, near_.moving());
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
  near_.go_to(1e-9 * static_cast<double>(tool.time_ns));
  find_near(tool, dt_s);
  watch.lap_us();
  depths_.find(proxy_.X_WP(), dt_s, tool.wants_curvature, times_);
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
std::optional<double> ContactService::outline_off_m(std::uint32_t contact_id) const noexcept {
  return state_->outline_off_m(contact_id);
}
std::span<const SurfaceTile> ContactService::tiles_needed(const ToolPose& tool, double margin_m, double soft_width_m) {
  return state_->tiles_needed(tool, margin_m, soft_width_m);
}
std::uint32_t ContactService::contacts_near() const noexcept {
  return state_->contacts_near();
}
double ContactService::fastest_near_m_s(const ToolPose& tool) const noexcept {
  return state_->fastest_near_m_s(tool);
}
const motion::MovingObjects& ContactService::moving() const noexcept {
  return state_->moving();
}
void ContactService::restart() noexcept {
  state_->restart();
}
ToolPose ContactService::at_proxy(ToolPose tool) const noexcept {
  tool.X_WT.p -= state_->proxy().p_PT_W();
  return tool;
}
const StageTimes& ContactService::last_times() const noexcept {
  return state_->times();
}
const contact::DoubtCounts& ContactService::doubts() const noexcept {
  return state_->doubts();
}

}  // namespace farfeel::contact_service
