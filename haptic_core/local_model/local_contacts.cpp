#include "haptic_core/local_model/local_contacts.h"

#include "haptic_core/local_model/felt_contact.h"

namespace farfeel::local_model {
namespace {

constexpr std::uint32_t kTilesATick = 4;  // taking one over costs some microseconds
constexpr double kSamePlace_m = 0.02;     // a remote contact stands in for one of ours this near, in the tool
constexpr double kSameDirection = 0.5;    // cosine

contact_service::ContactService service_of(const TileCache& cache) {
  const std::vector<contact_service::TouchableObject> all = cache.touchable();
  const contact_service::FeltScene& scene = cache.scene();
  return {std::span(all).subspan(1), all.front(),
          contact_service::ContactOptions{.tolerance_m = scene.tolerance_m,
                                          .grid_samples = scene.grid_samples,
                                          .soft_width_m = scene.soft_width_m,
                                          .heights = &cache}};
}

}  // namespace

LocalContacts::LocalContacts(TileCache& cache) : cache_(cache), service_(service_of(cache)) {}

void LocalContacts::hear(const contact::ContactSet& set) noexcept {
  remote_ = set;
  is_remote_new_ = true;
}

/// Replaces a contact that could only be found as coarse. The remote's is taken along with the tool to where it is now.
bool LocalContacts::stand_in(contact::Contact& coarse, const spatial::Pose& X_WT) noexcept {
  const glm::dvec3 p_ToC_T = glm::conjugate(X_WT.R) * (coarse.p_WC_W - X_WT.p);
  std::uint32_t nearest = remote_.count;
  double nearest_m = kSamePlace_m;
  for (std::uint32_t i = 0; i < remote_.count; ++i) {
    const contact::Contact& there = remote_.contacts[i];
    if (is_used_[i] || there.object != coarse.object || glm::dot(there.nhat_ST_W, coarse.nhat_ST_W) < kSameDirection)
      continue;
    const glm::dvec3 p_T = glm::conjugate(remote_.X_WT.R) * (there.p_WC_W - remote_.X_WT.p);
    if (const double apart_m = glm::distance(p_T, p_ToC_T); apart_m < nearest_m) nearest_m = apart_m, nearest = i;
  }
  if (nearest == remote_.count) return false;
  is_used_[nearest] = true;
  const FeltContact felt = felt_contact(remote_.contacts[nearest], remote_.X_WT);
  const FeltContact::Sample sample = felt.sample(X_WT);
  const std::uint32_t id = coarse.id;
  coarse = felt.at_X0;
  coarse.id = id;
  coarse.depth_m = sample.depth_m;
  coarse.gradient = sample.gradient;
  coarse.p_WC_W = X_WT.p + sample.p_ToC_W;
  return true;
}

const TickContacts& LocalContacts::at(const contact_service::ToolPose& tool) noexcept {
  cache_.take_arrived(kTilesATick);
  is_used_.fill(false);
  const contact::ContactSet& found = service_.answer(tool);
  tick_.set.pose_sequence = found.pose_sequence;
  tick_.set.pose_time_ns = found.pose_time_ns;
  tick_.set.X_WT = found.X_WT;
  tick_.set.pairs_near = found.pairs_near;
  tick_.set.count = tick_.from_tiles = tick_.from_remote = 0;
  for (std::uint32_t i = 0; i < found.count; ++i) {
    contact::Contact contact = found.contacts[i];
    const bool is_lacking = service_.lacks_heights(contact.id);
    if (is_lacking && !stand_in(contact, tool.X_WT)) continue;
    ++(is_lacking ? tick_.from_remote : tick_.from_tiles);
    tick_.source[tick_.set.count] = !is_lacking      ? Source::kTiles
                                    : is_remote_new_ ? Source::kNewRemote
                                                     : Source::kOldRemote;
    tick_.set.contacts[tick_.set.count++] = contact;
  }
  is_remote_new_ = false;
  return tick_;
}

}  // namespace farfeel::local_model
