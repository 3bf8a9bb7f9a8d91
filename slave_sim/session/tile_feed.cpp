#include "slave_sim/session/tile_feed.h"

#include <algorithm>

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
  is_asked_ = false;
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
  for (const double share : {0.0, 0.5, 1.0}) {
    contact_service::ToolPose then = tool;
    then.X_WT = spatial::integrate(tool.X_WT, tool.V_WT_W, share * ahead_s);
    scout_.restart();
    for (const SurfaceTile& where : scout_.tiles_needed(then, options_.margin_m)) {
      if (is_due(state(where), now_ns)) wanted_.push_back(where);
    }
  }
}

std::optional<std::span<const std::byte>> TileFeed::next(std::int64_t now_ns) {
  if (credited_ns_ == 0) credited_ns_ = now_ns;
  credit_bytes_ = std::min(credit_bytes_ + 1e-9 * static_cast<double>(now_ns - credited_ns_) * options_.bytes_per_s,
                           kMostCredit_s * options_.bytes_per_s);
  credited_ns_ = now_ns;
  if (credit_bytes_ < 0) return std::nullopt;
  while (parts_.empty()) {
    if (next_wanted_ == wanted_.size()) return std::nullopt;
    const SurfaceTile where = wanted_[next_wanted_++];
    TileState& tile = state(where);
    if (!is_due(tile, now_ns)) continue;  // needed twice, or acknowledged meanwhile
    ++(tile.sent_ns != 0 ? resent_tiles_ : sent_tiles_);
    tile.sent_ns = now_ns;
    if (tile.first_sent_ns == 0) tile.first_sent_ns = now_ns;
    parts_ = codecs::encoded_tile(where.tile, surfaces_[where.surface]->tiles[where.tile]);
    parts_surface_ = where.surface;
  }
  payload_.resize(codecs::kTileHeadBytes + parts_.back().size());
  (void)codecs::write(codecs::TileMessage{parts_surface_, parts_.back()}, payload_);
  parts_.pop_back();
  credit_bytes_ -= static_cast<double>(payload_.size());
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
  const double wait_s = std::max(0.0, -credit_bytes_ / options_.bytes_per_s);
  return std::min(std::max(now_ns, aimed_ns_ + kAim_ns), now_ns + static_cast<std::int64_t>(1e9 * wait_s) + 500'000);
}

}  // namespace farfeel::slave_sim
