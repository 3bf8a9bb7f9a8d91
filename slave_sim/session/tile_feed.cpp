#include "slave_sim/session/tile_feed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/tile_messages.h"
#include "transport/control_messages.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::SurfaceTile;

// Among what is sent on the bulk lane: after the scene, without which nothing is felt.
constexpr std::uint8_t kUrgency = transport::kSceneUrgency + 1;
// Widths grow within milliseconds: what the widest was counts on for some time, and those to come may be wider.
constexpr double kWidthKept_s = 2, kWiderYet = 1.5;

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
  std::size_t tiles = 0;
  for (const geometry::HapticSurface* surface : surfaces_) {
    places_.push_back(places_of(*surface));
    first_tile_.push_back(std::exchange(tiles, tiles + surface->tiles.size()));
  }
  states_.resize(tiles);
  restart();
}

void TileFeed::restart() {
  forget_all();
  aimed_ns_ = earned_ns_ = round_trip_ns_ = 0;
  widest_m_ = 0;
  budget_bytes_ = options_.burst_bytes;
  contacts_ = 1;
  round_ = 0;
}

void TileFeed::forget_all() {
  states_.assign(states_.size(), {});
  wanted_.clear();
  next_wanted_ = 0;
  parts_.clear();
  around_ = {};
}

void TileFeed::on_request(std::span<const std::byte> payload) {
  const auto request = codecs::read_tile_request(payload);
  if (!request || request->round <= round_) return;
  if (round_ != 0) forget_all();
  round_ = request->round;
}

void TileFeed::on_held(std::span<const std::byte> payload) {
  const auto held = codecs::read_tiles_held(payload);
  if (!held || held->surface >= surfaces_.size()) return;
  const std::size_t tiles = surfaces_[held->surface]->tiles.size();
  for (std::uint32_t i = 0; i < held->count && std::size_t{held->first} + i < tiles; ++i)
    states_[index_of({held->surface, held->first + i})].held = held->hashes[i];
}

void TileFeed::edit(const SurfaceEdit& edit) {
  if (edits_ && edits_->apply(edit)) states_[index_of(edit.where)] = {};
}

void TileFeed::aim(const contact_service::ToolPose& tool, double widest_m, std::int64_t round_trip_ns,
                   std::int64_t now_ns) {
  if (round_ == 0) return;
  widest_m_ = std::max(widest_m_, widest_m);
  if (aimed_ns_ != 0 && now_ns - aimed_ns_ < kAim_ns) return;
  aimed_ns_ = now_ns;
  round_trip_ns_ = round_trip_ns;
  wanted_.clear();
  next_wanted_ = 0;
  const contact_service::TilesNeeded here = want(tool, options_.margin_m);
  contacts_ = std::max(1u, here.contacts);
  // An object may turn under a tool held still, and a tool on its spot.
  const double speed_m_s = std::max(glm::length(tool.V_WT_W.linear_m_s), here.fastest_m_s);
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
    (void)want(then(in_s), options_.margin_m + 0.5 * (way_m - kLook_m));
  }
  // What may be needed never takes what will be.
  widest_m_ *= std::exp(-1e-9 * kAim_ns / kWidthKept_s);
  if (wanted_.empty() && budget_bytes_ > kPlentyForAround * options_.burst_bytes)
    look_around(then(1e-9 * static_cast<double>(round_trip_ns_)), speed_m_s, now_ns);
}

contact_service::TilesNeeded TileFeed::want(const contact_service::ToolPose& tool, double margin_m) {
  scout_.restart();
  const contact_service::TilesNeeded needed = scout_.tiles_needed(tool, margin_m, kWiderYet * widest_m_);
  for (const SurfaceTile& where : needed.tiles) {
    if (is_due(where)) wanted_.push_back({where, is_slow_});
  }
  return needed;
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
    const contact_service::Answer& here = scout_.answer(tool);
    for (std::uint32_t i = 0; i < here.count; ++i) {
      const contact::Contact& contact = here.contacts[i];
      note_around(contact_service::kToolSurface, tool.X_WT, contact.p_WC_W, -contact.nhat_ST_W);
      const motion::Moved* const moved = here.moving->find(contact.object);
      const spatial::Pose X_WO = moved ? here.moving->X_WO(*moved) : objects_[contact.object].X_WO;
      note_around(contact.object + 1, X_WO, contact.p_WC_W, contact.nhat_ST_W);
    }
    std::sort(around_.tiles.begin(), around_.tiles.end(),
              [](const Around::Tile& a, const Around::Tile& b) { return a.apart_m < b.apart_m; });
  }
  for (const Around::Tile& tile : around_.tiles) {
    if (wanted_.size() == kMostWanted) return;
    if (is_due(tile.where)) wanted_.push_back({tile.where, tile.apart_m < kFineAround_m});
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

void TileFeed::earn(std::int64_t now_ns) {
  if (earned_ns_ == 0) earned_ns_ = now_ns;
  const double passed_s = 1e-9 * static_cast<double>(now_ns - earned_ns_);
  budget_bytes_ = std::min(budget_bytes_ + passed_s * contacts_ * options_.bytes_per_s_a_contact, options_.burst_bytes);
  earned_ns_ = now_ns;
}

/// Whether something is still to be sent of what was wanted at the last look.
bool TileFeed::find_next() {
  if (!parts_.empty()) return true;
  while (next_wanted_ < wanted_.size() && !is_due(wanted_[next_wanted_].where)) ++next_wanted_;  // needed twice
  return next_wanted_ < wanted_.size();
}

std::optional<std::uint8_t> TileFeed::urgency(std::int64_t now_ns) {
  earn(now_ns);
  return budget_bytes_ >= 0 && find_next() ? std::optional(kUrgency) : std::nullopt;
}

std::optional<transport::BulkSource::Item> TileFeed::next(std::span<std::byte> to, std::int64_t) {
  if (!find_next()) return std::nullopt;
  if (parts_.empty()) {
    const Wanted& wanted = wanted_[next_wanted_++];
    TileState& tile = states_[index_of(wanted.where)];
    ++(tile.was_sent ? resent_tiles_ : sent_tiles_);
    tile = {++sendings_, true, tile.held};
    parts_ = parts_of(wanted, tile.held);
    held_tiles_ += parts_.front().size() == codecs::kTilePartHeaderBytes;
    parts_surface_ = wanted.where.surface;
    parts_tag_ = std::uint64_t{index_of(wanted.where)} << 32 | tile.sending;
  }
  const std::size_t bytes = codecs::write(codecs::TileMessage{parts_surface_, parts_.back()}, to);
  if (bytes == 0) return std::nullopt;
  parts_.pop_back();
  budget_bytes_ -= static_cast<double>(bytes);
  sent_bytes_ += bytes;
  return Item{transport::BulkType::kTile, bytes, parts_tag_};
}

/// As it is sent, or that it is held just so.
std::vector<std::vector<std::byte>> TileFeed::parts_of(const Wanted& wanted, std::uint32_t held) const {
  const geometry::HapticSurface& surface = *surfaces_[wanted.where.surface];
  const std::uint32_t index = wanted.where.tile;
  const geometry::HeightTile& now = surface.tiles[index];
  const auto written = [&](std::size_t worth_bytes) {
    return codecs::encoded_tile(index, now, options_.is_exact ? codecs::kExactly : codecs::nearness(surface),
                                worth_bytes);
  };
  // It may have been sent either way: what is read of it is looked at, as the master does.
  for (const std::size_t worth_bytes : {std::size_t{0}, codecs::kWorthBytes}) {
    if (held == 0) break;
    codecs::TileAssembly read;
    for (const auto& part : written(worth_bytes)) (void)read.add(codecs::decoded_tile_part(part).value());
    if (codecs::hash_of(read.tile()) == held) return {codecs::encoded_same(index, now.version)};
  }
  const bool has_plenty = wanted.may_be_fine && budget_bytes_ > kPlentyForFine * options_.burst_bytes;
  return written(has_plenty ? codecs::kWorthBytes : 0);
}

/// What has arrived need not be sent again, and what is under way counts as arrived already.
void TileFeed::on_arrived(std::uint64_t, std::int64_t) {}

void TileFeed::on_lost(std::uint64_t tag, std::int64_t) {
  TileState& tile = states_[static_cast<std::size_t>(tag >> 32)];
  if (tile.sending == static_cast<std::uint32_t>(tag)) tile.sending = 0;
}

std::int64_t TileFeed::next_time_ns(std::int64_t now_ns) const {
  if (budget_bytes_ >= 0 || (parts_.empty() && next_wanted_ == wanted_.size())) return transport::kNever_ns;
  return now_ns + static_cast<std::int64_t>(-1e9 * budget_bytes_ / (contacts_ * options_.bytes_per_s_a_contact)) + 1;
}

}  // namespace farfeel::slave_sim
