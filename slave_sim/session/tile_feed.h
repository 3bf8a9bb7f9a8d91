// Which height tiles a master gets, and when: those that its contacts need now, then those that they will need where
// the tool is going, then those around it. Time is an argument; no sockets, no threads.
//
// A source of the bulk lane, whose pacer says when a part may leave. A tile is sent once a version; if a datagram with
// a part of it is lost and it is still needed, it is sent again.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/session/editable_surfaces.h"
#include "transport/bulk/bulk_source.h"

namespace farfeel::slave_sim {

struct TileFeedOptions {
  /// Of parts, in the long run no more than this a contact, after `burst_bytes`, which let a first contact be felt at
  /// once. The pacer may give less.
  double bytes_per_s_a_contact = 130e3, burst_bytes = 200e3;
  bool is_exact = false;   ///< heights are sent as they are; else as near as codecs::nearness() has it, and finer
                           ///< within codecs::kWorthBytes a tile while a quarter of the burst is left
  double margin_s = 0.1;   ///< looked ahead by this and two round trips
  double margin_m = 1e-3;  ///< around what a contact needs
};

/// A tile's middle, and the outward direction of its chart.
struct TilePlace {
  glm::dvec3 p_O{0}, nhat_O{0};
};

class TileFeed final : public transport::BulkSource {
 public:
  /// tool, objects: prepared, and as the contact service that answers knows them. They must outlive the feed. Where
  /// they may be edited they are the feed's own, and in `edits`.
  TileFeed(std::span<const contact_service::TouchableObject> objects, const contact_service::TouchableObject& tool,
           const contact_service::ContactOptions&, const TileFeedOptions& = {}, EditableSurfaces* edits = nullptr);

  /// A surface has changed: its tile is needed again, where it is needed at all. Without `edits`, without effect.
  void edit(const SurfaceEdit&);

  /// An object has another course.
  void set_out(const motion::ObjectCourse& told) { scout_.set_out(told); }
  /// Tiles are due that were not at the last look: the next aim() looks, however soon it comes.
  void hurry() { aimed_ns_ = 0; }

  /// A new master, or a new session: nothing has arrived there, and it has not asked for tiles: until it does, none are
  /// sent.
  void restart();
  /// Payload of a tile request; anything else changes nothing. A greater round than before begins anew.
  void on_request(std::span<const std::byte> payload);
  /// Payload of what the master tells that it holds, before its first request; anything else changes nothing. A tile
  /// that is just as it would be sent is not sent again, but said to be so.
  void on_held(std::span<const std::byte> payload);
  /// The newest pose that the master told of, and how wide the widest soft maximum is in its contacts, which its loop
  /// widens as the slave does; how long the way there and back is, 0 if unknown. Looks at what is needed every kAim_ns
  /// at most.
  void aim(const contact_service::ToolPose&, double widest_m, std::int64_t round_trip_ns, std::int64_t now_ns);
  static constexpr std::int64_t kAim_ns = 20'000'000;

  [[nodiscard]] std::optional<std::uint8_t> urgency(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Item> next(std::span<std::byte> to, std::int64_t now_ns) override;
  void on_arrived(std::uint64_t tag, std::int64_t now_ns) override;
  void on_lost(std::uint64_t tag, std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns) const override;

  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t sent_tiles() const { return sent_tiles_; }
  [[nodiscard]] std::uint64_t resent_tiles() const { return resent_tiles_; }
  [[nodiscard]] std::uint64_t held_tiles() const { return held_tiles_; }  ///< that were only said to be the same

 private:
  struct TileState {
    std::uint32_t sending = 0;  // its newest one, if that is not lost; 0: it is to be sent where it is needed
    bool was_sent = false;      // in this version
    std::uint32_t held = 0;     // hash of what the master has of it from before; 0: nothing, as far as it has told
  };
  struct Wanted {
    contact_service::SurfaceTile where;
    bool may_be_fine;  // where it costs little
  };
  [[nodiscard]] std::size_t index_of(const contact_service::SurfaceTile& where) const {
    return first_tile_[where.surface] + where.tile;
  }
  [[nodiscard]] bool is_due(const contact_service::SurfaceTile& where) const {
    return states_[index_of(where)].sending == 0;
  }
  void forget_all();
  contact_service::TilesNeeded want(const contact_service::ToolPose&, double margin_m);
  void look_around(const contact_service::ToolPose&, double speed_m_s, std::int64_t now_ns);
  bool find_next();
  [[nodiscard]] std::vector<std::vector<std::byte>> parts_of(const Wanted&, std::uint32_t held) const;
  void earn(std::int64_t now_ns);
  void note_around(std::uint32_t surface, const spatial::Pose& X_WO, const glm::dvec3& p_WC, const glm::dvec3& nhat_W);

  TileFeedOptions options_;
  std::vector<contact_service::TouchableObject> objects_;
  std::vector<const geometry::HapticSurface*> surfaces_;  // the tool's, then the objects'
  std::vector<std::vector<TilePlace>> places_;            // of their tiles
  EditableSurfaces* edits_;
  contact_service::ContactService scout_;
  std::vector<std::size_t> first_tile_;  // of each surface, among all tiles
  std::vector<TileState> states_;        // of all tiles
  std::vector<Wanted> wanted_;           // most urgent first
  std::size_t next_wanted_ = 0;
  std::vector<std::vector<std::byte>> parts_;  // of the tile at hand, still to be sent
  std::uint32_t parts_surface_ = 0;
  std::uint64_t parts_tag_ = 0;
  std::uint32_t sendings_ = 0;
  std::uint32_t round_ = 0;  // of the newest request; 0: none
  bool is_slow_ = true;      // at the last look
  struct Around {
    struct Tile {
      contact_service::SurfaceTile where;
      double apart_m;  // of its middle from the nearest contact's point
    };
    glm::dvec3 p_WT{0};
    std::int64_t looked_ns = 0;
    double far_m = 0;
    std::vector<Tile> tiles;  // nearest first
  };
  Around around_;
  std::int64_t aimed_ns_ = 0;
  double widest_m_ = 0;  // of some time, and more
  double budget_bytes_ = 0;
  std::uint32_t contacts_ = 1;  // near, at the newest pose
  std::int64_t earned_ns_ = 0;  // up to then
  std::int64_t round_trip_ns_ = 0;
  std::uint64_t sent_bytes_ = 0, sent_tiles_ = 0, resent_tiles_ = 0, held_tiles_ = 0;
};

}  // namespace farfeel::slave_sim
