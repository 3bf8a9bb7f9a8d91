#include "slave_sim/session/tile_feed.h"

#include <algorithm>
#include <cmath>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/tile_messages.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::SurfaceTile;

constexpr std::int64_t kAim_ns = 20'000'000;
constexpr double kMostCredit_s = 0.02;                    // what may leave at once after a pause
constexpr std::int64_t kFirstRoundTrip_ns = 100'000'000;  // until one is measured
// Widths grow within milliseconds: what the widest was counts on for some time, and those to come may be wider.
constexpr double kWidthKept_s = 2, kWiderYet = 1.5;
constexpr std::int64_t kTimeoutSlack_ns = 20'000'000;  // beyond five quarters of a round trip: jitter, scheduling
constexpr std::int64_t kMostTimeout_ns = 1'000'000'000;

// Ahead of the tool, poses this far apart are looked at, and farther ones sparser: each look takes in what lies up to
// half the way to the next, which also allows for turning.
constexpr double kLook_m = 3e-3;
constexpr double kSparser = 0.35;  // of the way ahead
constexpr double kMostAhead_m = 0.15;
// Around the contacts where it will be when what is sent now is there, as far as a hand may get before more can come.
// A tool that moves has told where to.
constexpr double kLeastAround_m = 0.016, kMostAround_m = 0.09, kBeside_m = 0.008;
/// Between a hand's start, or its turning back, and the tiles that were asked for by it lie a round trip, two looks,
/// the time until its speed tells where it is going, and the sending of what comes first.
constexpr std::int64_t kNotice_ns = 60'000'000;
constexpr double kSlow_m_s = 0.02;  // slower, the tool dwells
constexpr double kHand_m_s = 0.3;
constexpr std::int64_t kLongestAround_ns = 200'000'000;  // contacts come and go, objects move
constexpr double kSameSide = 0.2;                        // cosine between the contact's direction and a tile's
constexpr std::size_t kMostWanted = 64;                  // at a time, of those
// Shares of the burst that are left: what lies around is sent, and tiles are written as finely as is worth it: under a
// tool that moves no faster than that was reckoned for, and no farther around one than it gets in half a round trip.
constexpr double kPlentyForAround = 0.5, kPlentyForFine = 0.25;
constexpr double kFineSpeed_m_s = 0.1, kFineAround_m = 0.03;

/// Where each of a surface's tiles lies.
std::vector<TilePlace> places_of(const geometry::HapticSurface& surface) {
  std::vector<TilePlace> places(surface.tiles.size());
  for (const geometry::Chart& chart : surface.charts) {
    for (std::uint32_t i = 0; i < chart.tiles_across() * chart.tiles_down(); ++i) {
      const geometry::HeightTile& tile = surface.tiles[chart.first_tile + i];
      const glm::dvec2 middle = chart.texel_m * geometry::kTileTexels *
                                (glm::dvec2(i % chart.tiles_across(), i / chart.tiles_across()) + 0.5);
      const double height_m = surface.scale.height_m(tile.at(geometry::kTileSide / 2, geometry::kTileSide / 2));
      places[chart.first_tile + i] = {spatial::transform_point(chart.X_OH, glm::dvec3(middle, height_m)),
                                      spatial::rotate(chart.X_OH, {0, 0, 1})};
    }
  }
  return places;
}

}  // namespace

TileFeed::TileFeed(std::span<const contact_service::TouchableObject> objects,
                   const contact_service::TouchableObject& tool, const contact_service::ContactOptions& service,
                   const TileFeedOptions& options, EditableSurfaces* edits)
    : options_(options),
      objects_(objects.begin(), objects.end()),
      surfaces_{tool.felt},
      edits_(edits),
      scout_(objects, tool, service) {
  for (const contact_service::TouchableObject& object : objects) surfaces_.push_back(object.felt);
  for (const geometry::HapticSurface* surface : surfaces_) places_.push_back(places_of(*surface));
  restart();
}

void TileFeed::restart() {
  states_.clear();
  for (const geometry::HapticSurface* surface : surfaces_) states_.emplace_back(surface->tiles.size());
  wanted_.clear();
  parts_.clear();
  next_wanted_ = 0;
  aimed_ns_ = credited_ns_ = round_trip_ns_ = 0;
  widest_m_ = 0;
  credit_bytes_ = 0;
  budget_bytes_ = options_.burst_bytes;
  contacts_ = 1;
  is_asked_ = false;
  around_ = {};
}

void TileFeed::edit(const SurfaceEdit& edit) {
  if (edits_ && edits_->apply(edit)) state(edit.where) = {};
}

bool TileFeed::is_due(const TileState& tile, std::int64_t now_ns) const {
  if (tile.has_arrived) return false;
  const std::int64_t trip_ns = round_trip_ns_ > 0 ? round_trip_ns_ : kFirstRoundTrip_ns;
  return tile.sent_ns == 0 || now_ns - tile.sent_ns > std::min(5 * trip_ns / 4 + kTimeoutSlack_ns, kMostTimeout_ns);
}

void TileFeed::aim(const contact_service::ToolPose& tool, double widest_m, std::int64_t now_ns) {
  if (!is_asked_) return;
  widest_m_ = std::max(widest_m_, widest_m);
  if (aimed_ns_ != 0 && now_ns - aimed_ns_ < kAim_ns) return;
  aimed_ns_ = now_ns;
  wanted_.clear();
  next_wanted_ = 0;
  want(tool, options_.margin_m, now_ns);
  contacts_ = std::max(1u, scout_.contacts_near());
  // An object may turn under a tool held still, and a tool on its spot.
  const double speed_m_s = std::max(glm::length(tool.V_WT_W.linear_m_s), scout_.fastest_near_m_s(tool));
  is_slow_ = speed_m_s <= kFineSpeed_m_s;
  double ahead_s = 2e-9 * static_cast<double>(round_trip_ns_) + options_.margin_s;  // one loss is made good
  if (speed_m_s * ahead_s > kMostAhead_m) ahead_s = kMostAhead_m / speed_m_s;
  const auto then = [&tool](double in_s) {
    contact_service::ToolPose pose = tool;
    pose.X_WT = spatial::integrate(tool.X_WT, tool.V_WT_W, in_s);
    pose.time_ns += static_cast<std::int64_t>(1e9 * in_s);  // objects that move will have moved too
    return pose;
  };
  for (double in_s = 0; in_s < ahead_s;) {
    const double way_m = std::max(kLook_m, kSparser * speed_m_s * in_s);
    const double step_s = std::min(0.5 * ahead_s, way_m / std::max(speed_m_s, 1e-9));
    in_s = std::min(ahead_s, in_s + step_s);
    want(then(in_s), options_.margin_m + 0.5 * (way_m - kLook_m), now_ns);
  }
  // What may be needed never takes what will be.
  widest_m_ *= std::exp(-1e-9 * kAim_ns / kWidthKept_s);
  if (wanted_.empty() && budget_bytes_ > kPlentyForAround * options_.burst_bytes)
    look_around(then(1e-9 * static_cast<double>(round_trip_ns_)), speed_m_s, now_ns);
}

void TileFeed::want(const contact_service::ToolPose& tool, double margin_m, std::int64_t now_ns) {
  scout_.restart();
  for (const SurfaceTile& where : scout_.tiles_needed(tool, margin_m, kWiderYet * widest_m_)) {
    if (is_due(state(where), now_ns)) wanted_.push_back({where, is_slow_});
  }
}

/// A tool may go anywhere next: what lies around its contacts, on both sides, is sent while nothing else is.
void TileFeed::look_around(const contact_service::ToolPose& tool, double speed_m_s, std::int64_t now_ns) {
  const double reach_m = kHand_m_s * 1e-9 * static_cast<double>(round_trip_ns_ + kNotice_ns);
  const double far_m = speed_m_s < kSlow_m_s ? std::clamp(reach_m, kLeastAround_m, kMostAround_m) : kBeside_m;
  if (std::abs(far_m - around_.far_m) > kLook_m || glm::distance(tool.X_WT.p, around_.p_WT) > kLook_m ||
      now_ns - around_.looked_ns > kLongestAround_ns) {
    around_.p_WT = tool.X_WT.p, around_.far_m = far_m, around_.looked_ns = now_ns;
    around_.tiles.clear();
    scout_.restart();
    const contact::ContactSet& here = scout_.answer(tool);
    for (std::uint32_t i = 0; i < here.count; ++i) {
      const contact::Contact& contact = here.contacts[i];
      note_around(contact_service::kToolSurface, tool.X_WT, contact.p_WC_W, -contact.nhat_ST_W);
      const contact_service::TouchableObject& object = objects_[contact.object];
      const spatial::Pose X_WO =
          object.motion ? object.motion->at(1e-9 * static_cast<double>(tool.time_ns)).X_WO : object.X_WO;
      note_around(contact.object + 1, X_WO, contact.p_WC_W, contact.nhat_ST_W);
    }
    std::sort(around_.tiles.begin(), around_.tiles.end(),
              [](const Around::Tile& a, const Around::Tile& b) { return a.apart_m < b.apart_m; });
  }
  for (const Around::Tile& tile : around_.tiles) {
    if (wanted_.size() == kMostWanted) return;
    if (is_due(state(tile.where), now_ns)) wanted_.push_back({tile.where, tile.apart_m < kFineAround_m});
  }
}

void TileFeed::note_around(std::uint32_t surface, const spatial::Pose& X_WO, const glm::dvec3& p_WC,
                           const glm::dvec3& nhat_W) {
  const spatial::Pose X_OW = spatial::inverse(X_WO);
  const glm::dvec3 p_OC = spatial::transform_point(X_OW, p_WC), nhat_O = spatial::rotate(X_OW, nhat_W);
  for (std::uint32_t i = 0; i < places_[surface].size(); ++i) {
    const TilePlace& place = places_[surface][i];
    const double apart_m = glm::distance(place.p_O, p_OC);
    if (apart_m < around_.far_m && glm::dot(place.nhat_O, nhat_O) > kSameSide)
      around_.tiles.push_back({{surface, i}, apart_m});
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
    const auto [where, may_be_fine] = wanted_[next_wanted_++];
    TileState& tile = state(where);
    if (!is_due(tile, now_ns)) continue;  // needed twice, or acknowledged meanwhile
    ++(tile.sent_ns != 0 ? resent_tiles_ : sent_tiles_);
    tile.sent_ns = now_ns;
    if (tile.first_sent_ns == 0) tile.first_sent_ns = now_ns;
    const geometry::HapticSurface& surface = *surfaces_[where.surface];
    const bool has_plenty = may_be_fine && budget_bytes_ > kPlentyForFine * options_.burst_bytes;
    parts_ = codecs::encoded_tile(where.tile, surface.tiles[where.tile],
                                  options_.is_exact ? codecs::kExactly : codecs::nearness(surface),
                                  has_plenty ? codecs::kWorthBytes : 0);
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
