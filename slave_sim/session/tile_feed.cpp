#include "slave_sim/session/tile_feed.h"

#include <algorithm>
#include <cmath>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/tile_messages.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::SurfaceTile;

constexpr std::int64_t kAim_ns = 10'000'000;
constexpr double kMostCredit_s = 0.02;                    // what may leave at once after a pause
constexpr std::int64_t kFirstRoundTrip_ns = 100'000'000;  // until one is measured
constexpr std::int64_t kTimeoutSlack_ns = 20'000'000;     // beyond five quarters of a round trip: jitter, scheduling
constexpr std::int64_t kMostTimeout_ns = 1'000'000'000;

constexpr double kLook_m = 3e-3;        // poses this far apart are looked at: less than a contact's width
constexpr double kMostAhead_m = 0.036;  // hands reverse
constexpr double kSlow_m_s = 0.02;      // slower, the tool dwells
constexpr int kMostAround = 120;        // looks around a dwelling tool: 16 mm
constexpr double kGoldenAngle_rad = 2.39996;

}  // namespace

TileFeed::TileFeed(std::span<const contact_service::TouchableObject> objects,
                   const contact_service::TouchableObject& tool, const contact_service::ContactOptions& service,
                   const TileFeedOptions& options, EditableSurfaces* edits)
    : options_(options), surfaces_{tool.felt}, edits_(edits), scout_(objects, tool, service) {
  for (const contact_service::TouchableObject& object : objects) surfaces_.push_back(object.felt);
  restart();
}

void TileFeed::restart() {
  states_.clear();
  for (const geometry::HapticSurface* surface : surfaces_) states_.emplace_back(surface->tiles.size());
  wanted_.clear();
  parts_.clear();
  next_wanted_ = 0;
  aimed_ns_ = credited_ns_ = round_trip_ns_ = 0;
  credit_bytes_ = 0;
  budget_bytes_ = options_.burst_bytes;
  contacts_ = 1;
  is_asked_ = false;
  around_ = 0;
}

void TileFeed::edit(const SurfaceEdit& edit) {
  if (edits_ && edits_->apply(edit)) state(edit.where) = {};
}

bool TileFeed::is_due(const TileState& tile, std::int64_t now_ns) const {
  if (tile.has_arrived) return false;
  const std::int64_t trip_ns = round_trip_ns_ > 0 ? round_trip_ns_ : kFirstRoundTrip_ns;
  return tile.sent_ns == 0 || now_ns - tile.sent_ns > std::min(5 * trip_ns / 4 + kTimeoutSlack_ns, kMostTimeout_ns);
}

void TileFeed::aim(const contact_service::ToolPose& tool, std::int64_t now_ns) {
  if (!is_asked_) return;
  if (aimed_ns_ != 0 && now_ns - aimed_ns_ < kAim_ns) return;
  aimed_ns_ = now_ns;
  wanted_.clear();
  next_wanted_ = 0;
  const double ahead_s = 2e-9 * static_cast<double>(round_trip_ns_) + options_.margin_s;  // one loss is made good
  const double speed_m_s = glm::length(tool.V_WT_W.linear_m_s), ahead_m = std::min(kMostAhead_m, speed_m_s * ahead_s);
  const int looks = std::max(2, static_cast<int>(std::ceil(ahead_m / kLook_m)));
  const double reach_s = speed_m_s * ahead_s > ahead_m ? ahead_m / speed_m_s : ahead_s;
  for (int look = 0; look <= looks; ++look) {
    contact_service::ToolPose then = tool;
    then.X_WT = spatial::integrate(tool.X_WT, tool.V_WT_W, reach_s * look / looks);
    then.time_ns += static_cast<std::int64_t>(1e9 * reach_s * look / looks);  // objects that move will have moved too
    want(then, now_ns);
    if (look == 0) contacts_ = std::max(1u, scout_.contacts_near());
  }
  // What may be needed never takes what will be.
  const bool has_plenty = budget_bytes_ > 0.5 * options_.burst_bytes;
  if (wanted_.empty() && speed_m_s < kSlow_m_s && has_plenty) look_around(tool, now_ns);
}

void TileFeed::want(const contact_service::ToolPose& tool, std::int64_t now_ns) {
  scout_.restart();
  for (const SurfaceTile& where : scout_.tiles_needed(tool, options_.margin_m)) {
    if (is_due(state(where), now_ns)) wanted_.push_back(where);
  }
}

/// A tool that dwells may go anywhere next: what lies around it is sent while nothing else is, along a sunflower's
/// spiral over the nearest contact's plane.
void TileFeed::look_around(const contact_service::ToolPose& tool, std::int64_t now_ns) {
  if (glm::distance(tool.X_WT.p, around_p_W_) > kLook_m) around_p_W_ = tool.X_WT.p, around_ = 0;
  if (around_ == kMostAround) return;
  scout_.restart();
  const contact::ContactSet& here = scout_.answer(tool);
  if (here.count == 0) return;
  const glm::dquat R_WC = spatial::frame_with_z(here.contacts[0].nhat_ST_W);
  while (wanted_.empty() && around_ < kMostAround) {
    ++around_;
    const double angle = kGoldenAngle_rad * around_, radius_m = 0.5 * kLook_m * std::sqrt(around_);
    contact_service::ToolPose beside = tool;
    beside.X_WT.p += R_WC * glm::dvec3(radius_m * std::cos(angle), radius_m * std::sin(angle), 0);
    want(beside, now_ns);
  }
}

std::optional<std::span<const std::byte>> TileFeed::next(std::int64_t now_ns) {
  if (credited_ns_ == 0) credited_ns_ = now_ns;
  const double passed_s = 1e-9 * static_cast<double>(now_ns - credited_ns_);
  credit_bytes_ = std::min(credit_bytes_ + passed_s * options_.bytes_per_s, kMostCredit_s * options_.bytes_per_s);
  budget_bytes_ = std::min(budget_bytes_ + passed_s * contacts_ * options_.bytes_per_s_a_contact, options_.burst_bytes);
  credited_ns_ = now_ns;
  if (credit_bytes_ < 0 || budget_bytes_ < 0) return std::nullopt;
  while (parts_.empty()) {
    if (next_wanted_ == wanted_.size()) return std::nullopt;
    const SurfaceTile where = wanted_[next_wanted_++];
    TileState& tile = state(where);
    if (!is_due(tile, now_ns)) continue;  // needed twice, or acknowledged meanwhile
    ++(tile.sent_ns != 0 ? resent_tiles_ : sent_tiles_);
    tile.sent_ns = now_ns;
    if (tile.first_sent_ns == 0) tile.first_sent_ns = now_ns;
    const geometry::HapticSurface& surface = *surfaces_[where.surface];
    parts_ = codecs::encoded_tile(where.tile, surface.tiles[where.tile],
                                  options_.is_exact ? codecs::kExactly : codecs::nearness(surface));
    parts_surface_ = where.surface;
  }
  payload_.resize(codecs::kTileHeadBytes + parts_.back().size());
  (void)codecs::write(codecs::TileMessage{parts_surface_, parts_.back()}, payload_);
  parts_.pop_back();
  credit_bytes_ -= static_cast<double>(payload_.size());
  budget_bytes_ -= static_cast<double>(payload_.size());
  sent_bytes_ += payload_.size();
  return payload_;
}

void TileFeed::on_acknowledge(std::span<const std::byte> payload, std::int64_t now_ns) {
  const auto message = codecs::read_tile_acknowledge(payload);
  if (!message) return;
  is_asked_ = true;
  for (std::uint32_t i = 0; i < message->count; ++i) {
    const codecs::TileName& name = message->tiles[i];
    if (name.surface >= states_.size() || name.tile >= states_[name.surface].size()) continue;
    TileState& tile = states_[name.surface][name.tile];
    if (tile.sent_ns == 0 || tile.has_arrived || name.version != surfaces_[name.surface]->tiles[name.tile].version)
      continue;
    tile.has_arrived = true;
    // Which sending of a repeated tile is acknowledged is unknown: the first, as long as nothing better is.
    if (tile.sent_ns != tile.first_sent_ns && round_trip_ns_ != 0) continue;
    const std::int64_t trip_ns = std::clamp<std::int64_t>(now_ns - tile.first_sent_ns, 1, kMostTimeout_ns);
    round_trip_ns_ = round_trip_ns_ == 0 ? trip_ns : (7 * round_trip_ns_ + trip_ns) / 8;
  }
}

std::int64_t TileFeed::next_time_ns(std::int64_t now_ns) const {
  const bool has_work = !parts_.empty() || next_wanted_ < wanted_.size();
  if (!has_work) return std::max(now_ns, aimed_ns_ + kAim_ns);
  const double wait_s = std::max(
      {0.0, -credit_bytes_ / options_.bytes_per_s, -budget_bytes_ / (contacts_ * options_.bytes_per_s_a_contact)});
  return std::min(std::max(now_ns, aimed_ns_ + kAim_ns), now_ns + static_cast<std::int64_t>(1e9 * wait_s) + 500'000);
}

}  // namespace farfeel::slave_sim
