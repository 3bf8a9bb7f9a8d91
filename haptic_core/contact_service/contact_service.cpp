#include "haptic_core/contact_service/contact_service.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/depth/coarse_depth.h"
#include "haptic_core/contact/depth/contact_frame.h"
#include "haptic_core/contact/depth/depth_stage.h"
#include "haptic_core/contact/depth/duplicate_weights.h"
#include "haptic_core/contact/tracking/contact_tracker.h"
#include "haptic_core/contact/wrench/wrench_stage.h"
#include "haptic_core/contact_service/constants.h"
#include "haptic_core/contact_service/proxy.h"
#include "haptic_core/realtime/stopwatch.h"

namespace farfeel::contact_service {
namespace {

using contact::ContactSet;
using contact::Track;
using spatial::Pose;

std::size_t most_triangles(std::span<const TouchableObject> objects, const TouchableObject& tool) {
  std::size_t most = tool.felt->coarse.triangles.size();
  for (const TouchableObject& object : objects) most = std::max(most, object.felt->coarse.triangles.size());
  return most;
}

}  // namespace

/// The stages in their order. Each reads finished records of those before it and writes its own.
class ContactService::State {
 public:
  State(std::span<const TouchableObject> objects, const TouchableObject& tool, const ContactOptions& options)
      : options_(options),
        tracker_(objects, tool, options.tolerance_m),
        depths_(tracker_, {.coarse_triangles = most_triangles(objects, tool)}, options) {}

  const Answer& answer(const ToolPose& tool) noexcept;
  void restart() noexcept {
    has_answered_ = false;
    wrench_.restart();
    duplicates_.restart();
    depths_.restart();
    tracker_.restart();
    proxy_.restart();
  }
  [[nodiscard]] TilesNeeded tiles_needed(const ToolPose& tool, double margin_m, double soft_width_m) noexcept;
  void set_out(const motion::ObjectCourse& told) noexcept { tracker_.set_out(told); }

 private:
  void find_near(const ToolPose& tool, double dt_s) noexcept;
  void assemble(const ToolPose& tool, double dt_s) noexcept;
  [[nodiscard]] contact::Contact contact_of(std::size_t i, const ToolPose& tool) noexcept;
  [[nodiscard]] std::uint8_t doubts_apart(std::size_t i, double depth_m) const noexcept;
  [[nodiscard]] double fastest_near_m_s(const ToolPose& tool) const noexcept;

  ContactOptions options_;
  contact::ContactTracker tracker_;
  contact::DepthStage depths_;
  Proxy proxy_;
  Answer set_;
  contact::DuplicateWeights duplicates_{kSamePlace_m};
  contact::WrenchStage wrench_;
  bool has_answered_ = false;
};

double ContactService::State::fastest_near_m_s(const ToolPose& tool) const noexcept {
  double fastest_m_s = 0;
  for (const Track& track : tracker_.tracks()) {
    const glm::dvec3 p_WC = spatial::transform_point(tracker_.object_of(track).X_WO, track.cluster.p_S);
    const motion::Moved* const moved = tracker_.moving().find(track.object);
    const glm::dvec3 v_object_m_s = moved ? moved->twist_at(p_WC).linear_m_s : glm::dvec3(0);
    const glm::dvec3 v_tool_m_s = spatial::velocity_at(tool.V_WT_W, p_WC - tool.X_WT.p);
    fastest_m_s = std::max(fastest_m_s, glm::distance(v_tool_m_s, v_object_m_s));
  }
  return fastest_m_s;
}

TilesNeeded ContactService::State::tiles_needed(const ToolPose& tool, double margin_m, double soft_width_m) noexcept {
  tracker_.go_to(1e-9 * static_cast<double>(tool.time_ns));
  tracker_.find(tool.X_WT, kLongestStep_s, set_.times);
  return {.tiles = depths_.tiles_needed(tool.X_WT, margin_m, soft_width_m),
          .contacts = static_cast<std::uint32_t>(tracker_.tracks().size()),
          .fastest_m_s = fastest_near_m_s(tool)};
}

/// What is near the proxy, once that has gone as far towards the tool as it may.
void ContactService::State::find_near(const ToolPose& tool, double dt_s) noexcept {
  const double reach_m = kKnownShare * options_.tolerance_m;
  proxy_.set_out(tool.X_WT, dt_s, tracker_.moving());
  while (proxy_.go_on(reach_m)) {
    tracker_.find(proxy_.X_WP(), dt_s, set_.times);
    proxy_.begin_contacts();
    for (const Track& track : tracker_.tracks()) {
      const Pose& X_WO = tracker_.object_of(track).X_WO;
      proxy_.note(contact::contact_from(track.cluster, {}, X_WO, proxy_.X_WP().p),
                  tracker_.deepest_m(track) - track.cluster.depth_m);
    }
  }
  tracker_.find(proxy_.X_WP(), dt_s, set_.times);
}

/// Track number i as a contact, at the proxy.
contact::Contact ContactService::State::contact_of(std::size_t i, const ToolPose& tool) noexcept {
  const Track& track = tracker_.tracks()[i];
  const contact::TrackedObject& object = tracker_.object_of(track);
  const contact::FieldDepth& field = depths_.field(i);
  contact::Contact contact = contact::contact_from(track.cluster, field.depth, object.X_WO, proxy_.X_WP().p);
  const bool is_field = contact::is_credible(field.depth);
  contact::OtherShares shares{.coarse = is_field ? 0.0 : 1.0};
  const bool lacks_points = field.lacks_heights && field.layers.share > 0;
  if (options_.soft_width_m > 0 && !lacks_points)
    shares = depths_.blend(contact, i, proxy_.X_WP(), set_.p_PT_W != glm::dvec3(0), set_.times);
  if (tool.wants_curvature && is_field && shares.coarse + shares.points < kLittle && field.depth.hessian.allFinite()) {
    const Pose X_WC = object.X_WO * contact::contact_frame(track.cluster);
    contact.curvature = contact::Curvature::of(contact::turned(field.depth.hessian, X_WC.R));
  }
  contact.id = track.id;
  contact.object = track.object;
  contact.material = object.material;
  contact.lateral_range_m = object.is_textured ? kTexturedRange_m : options_.tolerance_m;
  if (shares.coarse > 0.5) contact.doubts |= contact::kFeltAsCoarse;
  if (field.lacks_heights) {
    contact.doubts |= contact::kFeltByOutline;
    contact.outline_off_m = field.outline_off_m;
  }
  return contact;
}

/// What may be doubted of track number i where it is apart. Of a gap that is known in two ways nothing, whatever the
/// search says of itself: an edge stays one, and heights that lack still do. Where height fields know that it is apart,
/// coarse pieces say how far at most, and no relief is missed.
std::uint8_t ContactService::State::doubts_apart(std::size_t i, double depth_m) const noexcept {
  constexpr unsigned kNoDoubtsOfDepth = unsigned{contact::kFeltByOutline} | unsigned{penetration::kSilhouette};
  const contact::TrackedObject& object = tracker_.object_of(tracker_.tracks()[i]);
  if (contact::confirms_gap(object.pairs, depth_m)) return kNoDoubtsOfDepth;
  constexpr unsigned kAll = unsigned{contact::kAllDoubts} | unsigned{contact::kFeltByOutline};
  return contact::is_credible(depths_.field(i).depth) ? kAll & ~unsigned{contact::kFeltAsCoarse} : kAll;
}

void ContactService::State::assemble(const ToolPose& tool, double dt_s) noexcept {
  set_.pose_sequence = tool.sequence;
  set_.pose_time_ns = tool.time_ns;
  const Pose from_X_WT = set_.X_WT;
  set_.X_WT = tool.X_WT;
  set_.pairs_near = tracker_.pairs();
  set_.moving = &tracker_.moving();
  set_.p_PT_W = proxy_.p_PT_W();
  proxy_.begin_contacts();
  const std::span<const Track> tracks = tracker_.tracks();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const contact::Contact at_proxy = contact_of(i, tool);
    proxy_.note(at_proxy, tracker_.deepest_m(tracks[i]) - std::max(at_proxy.depth_m, tracks[i].cluster.depth_m));
    set_.contacts[i] = proxy_.drawn_on(at_proxy);
    contact::Contact& told = set_.contacts[i];
    if (told.depth_m < 0 && told.doubts != 0) told.doubts &= doubts_apart(i, at_proxy.depth_m);
  }
  set_.count = static_cast<std::uint32_t>(tracks.size());
  duplicates_.fade(set_, from_X_WT, tracker_.moving(), dt_s);
  if (tool.wants_wrench) {
    wrench_.add(set_, tool.V_WT_W, from_X_WT, tracker_.moving());
  } else {
    set_.F_To_W = {};
    wrench_.restart();
  }
  set_.times.frictions = wrench_.frictions();
}

const Answer& ContactService::State::answer(const ToolPose& tool) noexcept {
  realtime::Stopwatch watch, whole;
  const double dt_s =
      has_answered_ ? std::clamp(1e-9 * static_cast<double>(tool.time_ns - set_.pose_time_ns), 0.0, kLongestStep_s)
                    : kLongestStep_s;
  has_answered_ = true;
  tracker_.go_to(1e-9 * static_cast<double>(tool.time_ns));
  find_near(tool, dt_s);
  watch.lap_us();
  depths_.find(proxy_.X_WP(), dt_s, tool.wants_curvature, set_.times);
  set_.times.penetration_us = watch.lap_us();
  assemble(tool, dt_s);
  set_.times.assembly_us = watch.lap_us();
  set_.times.total_us = whole.lap_us();
  return set_;
}

ContactService::ContactService(std::span<const TouchableObject> objects, const TouchableObject& tool,
                               const ContactOptions& options)
    : state_(std::make_unique<State>(objects, tool, options)) {}
ContactService::~ContactService() = default;
ContactService::ContactService(ContactService&&) noexcept = default;
ContactService& ContactService::operator=(ContactService&&) noexcept = default;

const Answer& ContactService::answer(const ToolPose& tool) noexcept {
  return state_->answer(tool);
}
TilesNeeded ContactService::tiles_needed(const ToolPose& tool, double margin_m, double soft_width_m) {
  return state_->tiles_needed(tool, margin_m, soft_width_m);
}
void ContactService::set_out(const motion::ObjectCourse& told) noexcept {
  state_->set_out(told);
}
void ContactService::restart() noexcept {
  state_->restart();
}

}  // namespace farfeel::contact_service
