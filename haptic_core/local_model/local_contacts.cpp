#include "haptic_core/local_model/local_contacts.h"

#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"
#include "haptic_core/local_model/felt_contact.h"
#include "haptic_core/local_model/felt_once.h"

namespace farfeel::local_model {
namespace {

contact_service::ContactService service_of(const TileCache& cache) {
  const std::vector<contact_service::TouchableObject> all = cache.touchable();
  const contact_service::FeltScene& scene = cache.scene();
  return {std::span(all).subspan(1), all.front(),
          contact_service::ContactOptions{.tolerance_m = scene.tolerance_m,
                                          .grid_samples = scene.grid_samples,
                                          .soft_width_m = scene.soft_width_m,
                                          .most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m,
                                          .heights = &cache,
                                          .most_searches = kSearchesATick}};
}

/// Whether heights are not at hand.
bool is_by_outline(const contact::Contact& contact) {
  return (contact.doubts & contact::kFeltByOutline) != 0;
}

contact_service::ToolPose gone_on(contact_service::ToolPose tool, double for_s) {
  tool.time_ns += std::llround(1e9 * for_s);
  tool.X_WT = spatial::integrate(tool.X_WT, tool.V_WT_W, for_s);
  return tool;
}

/// The remote's contact, taken along with its object and the tool to where they are now.
contact::Contact taken_along(const contact::ContactSet& remote, std::uint32_t i, const motion::MovingObjects& moving,
                             const spatial::Pose& X_WT) {
  ReceivedContact told = received(remote.contacts[i], remote.X_WT);
  if (const motion::Moved* moved = moving.find(remote.contacts[i].object))
    told = carried(told, moving.way_since(*moved, 1e-9 * static_cast<double>(remote.pose_time_ns)));
  const FeltContact::Sample sample = felt_contact(told).sample(X_WT);
  contact::Contact here = told.contact;
  here.depth_m = sample.depth_m;
  here.gradient = sample.gradient;
  here.p_WC_W = X_WT.p + sample.p_ToC_W;
  return here;
}

}  // namespace

void drop_absent(contact::ContactSet& told, const motion::MovingObjects& now) noexcept {
  const auto is_absent = [&](const contact::Contact& contact) {
    const motion::Moved* const moved = now.find(contact.object);
    return moved != nullptr && !moved->is_there;
  };
  if (now.moved().empty()) return;
  const auto end = std::remove_if(told.contacts.begin(), told.contacts.begin() + told.count, is_absent);
  told.count = static_cast<std::uint32_t>(end - told.contacts.begin());
}

StandIns stand_ins(const contact::ContactSet& ours, const std::array<bool, contact::kMaxContacts>& lacks,
                   const contact::ContactSet& remote) noexcept {
  StandIns chosen;
  chosen.fill(kNobody);
  if (ablated(Mechanism::kStandIns)) return chosen;
  std::array<double, contact::kMaxContacts> chosen_m{};
  std::array<bool, contact::kMaxContacts> is_far{};
  const auto ours_at = [&](std::uint32_t i) { return placed(ours.contacts[i], ours.X_WT); };
  const auto looks_alike = [&](std::uint32_t r, std::uint32_t i) {
    return looks_like(placed(remote.contacts[r], remote.X_WT), ours_at(i));
  };
  for (std::uint32_t r = 0; r < remote.count; ++r) {
    const glm::dvec3 p_T = placed(remote.contacts[r], remote.X_WT).p_T;
    std::uint32_t nearest = kNobody;
    double nearest_m = kSamePlace_m;
    for (std::uint32_t i = 0; i < ours.count; ++i) {
      if (!looks_alike(r, i)) continue;
      if (const double apart_m = glm::distance(p_T, ours_at(i).p_T); apart_m < nearest_m)
        nearest_m = apart_m, nearest = i;
    }
    is_far[r] = nearest == kNobody;
    if (nearest == kNobody || !lacks[nearest]) continue;
    if (chosen[nearest] == kNobody || nearest_m < chosen_m[nearest]) chosen[nearest] = r, chosen_m[nearest] = nearest_m;
  }
  // Where coarse faces lie flat on each other the point of a contact may be any of theirs, however far.
  for (std::uint32_t i = 0; i < ours.count; ++i) {
    for (std::uint32_t r = 0; lacks[i] && chosen[i] == kNobody && r < remote.count; ++r) {
      if (is_far[r] && looks_alike(r, i)) chosen[i] = r, is_far[r] = false;
    }
  }
  return chosen;
}

LocalContacts::LocalContacts(TileCache& cache) : cache_(cache), service_(service_of(cache)) {}

void LocalContacts::hear(const contact::ContactSet& set) noexcept {
  remote_ = set;
  is_remote_new_ = has_remote_ = true;
}

const TickContacts& LocalContacts::ahead_of(const contact_service::ToolPose& tool, double ahead_s) noexcept {
  return at(gone_on(tool, ahead_s));
}

const TickContacts& LocalContacts::beside_remote_ahead_of(const contact_service::ToolPose& tool,
                                                          double ahead_s) noexcept {
  return beside_remote(gone_on(tool, ahead_s));
}

const contact_service::Answer& LocalContacts::find(const contact_service::ToolPose& tool) noexcept {
  cache_.take_arrived(kTilesATick);
  contact_service::ToolPose asked = tool;
  asked.wants_wrench = false;  // the local model has its own friction
  const contact_service::Answer& found = service_.answer(asked);
  times_ = found.times;
  drop_absent(remote_, *found.moving);
  if (is_remote_new_) tick_.remote_age_s = 1e-9 * static_cast<double>(tool.time_ns - remote_.pose_time_ns);
  tick_.set.pose_sequence = found.pose_sequence;
  tick_.set.pose_time_ns = found.pose_time_ns;
  tick_.set.X_WT = found.X_WT;
  tick_.set.pairs_near = found.pairs_near;
  tick_.set.count = tick_.from_tiles = tick_.from_remote = tick_.lacking = 0;
  tick_.told = nullptr;
  return found;
}

void LocalContacts::feel(const contact::Contact& contact, Source source, double off_m) noexcept {
  const std::uint32_t i = tick_.set.count++;
  tick_.set.contacts[i] = contact;
  tick_.source[i] = source;
  tick_.off_m[i] = off_m;
}

const TickContacts& LocalContacts::at(const contact_service::ToolPose& tool) noexcept {
  const contact_service::Answer& found = find(tool);
  std::array<bool, contact::kMaxContacts> lacks{};
  for (std::uint32_t i = 0; i < found.count; ++i) {
    lacks[i] = is_by_outline(found.contacts[i]);
  }
  const StandIns chosen = stand_ins(found, lacks, remote_);
  for (std::uint32_t i = 0; i < found.count; ++i) {
    contact::Contact contact = found.contacts[i];
    tick_.lacking += lacks[i];
    if (!lacks[i]) {
      ++tick_.from_tiles;
      feel(contact, Source::kTiles, 0);
      continue;
    }
    if (chosen[i] != kNobody) {
      contact::Contact told = taken_along(remote_, chosen[i], *found.moving, tool.X_WT);
      contact.depth_m = depth_within_m(placed(contact, tool.X_WT, contact.outline_off_m), told.depth_m);
      if (contact.depth_m == told.depth_m) {
        told.id = contact.id;
        ++tick_.from_remote;
        feel(told, is_remote_new_ ? Source::kNewRemote : Source::kOldRemote, 0);
        continue;
      }
    }
    feel(contact, Source::kOutline, contact.outline_off_m);
  }
  is_remote_new_ = false;
  return tick_;
}

const TickContacts& LocalContacts::beside_remote(const contact_service::ToolPose& tool) noexcept {
  const contact_service::Answer& found = find(tool);
  for (std::uint32_t i = 0; i < found.count; ++i) {
    contact::Contact contact = found.contacts[i];
    contact.id.kind = contact::ContactKind::kFoundBeside;
    tick_.lacking += is_by_outline(contact);
    feel(contact, is_by_outline(contact) ? Source::kOutline : Source::kTiles, contact.outline_off_m);
  }
  tick_.told = has_remote_ ? &remote_ : nullptr;
  tick_.is_told_new = is_remote_new_;
  is_remote_new_ = false;
  return tick_;
}

}  // namespace farfeel::local_model
