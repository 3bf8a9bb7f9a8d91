// Which height tiles a master gets, and when: those that its contacts need now, then those that they will need where
// the tool is going, then those around it. Time is an argument; no sockets, no threads.
//
// A tile is sent once a version; what is not acknowledged in time, and still needed, is sent again.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/session/editable_surfaces.h"

namespace farfeel::slave_sim {

struct TileFeedOptions {
  double bytes_per_s = 500e3;  ///< datagrams' payloads, all contacts together
  /// In the long run no more than this a contact, after `burst_bytes`, which let a first contact be felt at once.
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

class TileFeed {
 public:
  /// tool, objects: prepared, and as the contact service that answers knows them. They must outlive the feed. Where
  /// they may be edited they are the feed's own, and in `edits`.
  TileFeed(std::span<const contact_service::TouchableObject> objects, const contact_service::TouchableObject& tool,
           const contact_service::ContactOptions&, const TileFeedOptions& = {}, EditableSurfaces* edits = nullptr);

  /// A surface has changed: its tile is needed again, where it is needed at all. Without `edits`, without effect.
  void edit(const SurfaceEdit&);

  /// A new master: nothing has arrived there, and it has not asked for tiles: until it acknowledges, be it nothing,
  /// none are sent.
  void restart();
  /// The newest pose that the master told of, and how wide the widest soft maximum is in its contacts, which its loop
  /// widens as the slave does. Looks at what is needed at most fifty times a second.
  void aim(const contact_service::ToolPose&, double widest_m, std::int64_t now_ns);
  /// The next message's payload that may leave now, if any; valid until the next call.
  [[nodiscard]] std::optional<std::span<const std::byte>> next(std::int64_t now_ns);
  /// Payload of a tile acknowledgement; anything else changes nothing.
  void on_acknowledge(std::span<const std::byte> payload, std::int64_t now_ns);
  /// When next() is worth asking again while there is a master.
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns) const;

  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t sent_tiles() const { return sent_tiles_; }
  [[nodiscard]] std::uint64_t resent_tiles() const { return resent_tiles_; }

 private:
  struct TileState {
    std::int64_t first_sent_ns = 0, sent_ns = 0;  // 0: never
    bool has_arrived = false;
  };
  [[nodiscard]] TileState& state(const contact_service::SurfaceTile& where) {
    return states_[where.surface][where.tile];
  }
  void want(const contact_service::ToolPose&, double margin_m, std::int64_t now_ns);
  void look_around(const contact_service::ToolPose&, double speed_m_s, std::int64_t now_ns);
  void note_around(std::uint32_t surface, const spatial::Pose& X_WO, const glm::dvec3& p_WC, const glm::dvec3& nhat_W);
  [[nodiscard]] bool is_due(const TileState&, std::int64_t now_ns) const;

  TileFeedOptions options_;
  std::vector<contact_service::TouchableObject> objects_;
  std::vector<const geometry::HapticSurface*> surfaces_;  // the tool's, then the objects'
  std::vector<std::vector<TilePlace>> places_;            // of their tiles
  EditableSurfaces* edits_;
  contact_service::ContactService scout_;
  std::vector<std::vector<TileState>> states_;
  struct Wanted {
    contact_service::SurfaceTile where;
    bool may_be_fine;  // where it costs little
  };
  std::vector<Wanted> wanted_;  // most urgent first
  std::size_t next_wanted_ = 0;
  std::vector<std::vector<std::byte>> parts_;  // of the tile at hand, still to be sent
  std::uint32_t parts_surface_ = 0;
  std::vector<std::byte> payload_;
  bool is_asked_ = false, is_slow_ = true;  // slow: at the last look
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
  double widest_m_ = 0;                         // of some time, and more
  double credit_bytes_ = 0, budget_bytes_ = 0;  // of the moment; of the long run
  std::uint32_t contacts_ = 1;                  // near, at the newest pose
  std::int64_t credited_ns_ = 0;
  std::int64_t round_trip_ns_ = 0;  // 0 until one is measured
  std::uint64_t sent_bytes_ = 0, sent_tiles_ = 0, resent_tiles_ = 0;
};

}  // namespace farfeel::slave_sim
