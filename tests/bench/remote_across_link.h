// The remote node at the far end of a link, in this process and in simulated time: the contact service, the tile feed,
// the link's own impairment. Every message is really encoded, and what arrives is really decoded.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/local_model/local_contacts.h"
#include "haptic_core/local_model/local_model.h"
#include "master_station/haptic_loop/remote.h"
#include "master_station/session/tile_receiver.h"
#include "slave_sim/session/tile_feed.h"
#include "tests/bench/felt_pair.h"
#include "transport/bulk/bulk_lane.h"
#include "transport/link/impairment.h"

namespace farfeel::bench {

/// One direction of the link: datagrams in the order in which they leave it.
class Lane {
 public:
  Lane(const transport::LinkSpec& spec, std::uint64_t seed) : link_(spec, seed) {}
  void send(std::int64_t now_ns, std::vector<std::byte> payload);
  /// Calls take(payload) for all that has arrived by now.
  template <typename Take>
  void deliver(std::int64_t now_ns, Take&& take) {
    for (; !due_.empty() && due_.front().at_ns <= now_ns; due_.pop_front()) {
      received_bytes_ += due_.front().payload.size();
      take(std::as_const(due_.front().payload));
    }
  }
  [[nodiscard]] std::uint64_t received_bytes() const { return received_bytes_; }  ///< payloads

 private:
  struct Datagram {
    std::int64_t at_ns;
    std::vector<std::byte> payload;
  };
  transport::Impairment link_;
  std::deque<Datagram> due_;
  std::uint64_t received_bytes_ = 0;
};

/// What a remote across a link does, for whoever records it.
class RemoteWatch {
 public:
  virtual ~RemoteWatch() = default;
  /// Payloads that reach the master, in their order, within poll().
  virtual void on_answer(std::span<const std::byte> payload) = 0;
  virtual void on_tile(std::span<const std::byte> payload) = 0;
  /// The far end has answered.
  virtual void on_answered(const contact_service::ToolPose& asked, const contact_service::Answer&) = 0;
};

/// Not for a real-time thread: it allocates, and the far end's work is done in poll().
class RemoteAcrossLink final : public master_station::Remote {
 public:
  struct Options {
    bool has_outline = false;    ///< the master feels by the outline what the remote has not told of yet
    bool has_tiles = false;      ///< and asks for height tiles, and feels them
    bool has_curvature = false;  ///< it asks for the depths' second derivatives, ahead of the tool
    bool knows_heights = false;  ///< it has every tile, exactly, before it begins: what the feed's delay and error cost
    slave_sim::TileFeedOptions feed{};
    std::int64_t answer_period_ns = 1'000'000;
    slave_sim::EditableSurfaces* edits = nullptr;  ///< of the bodies, where they may be edited
    RemoteWatch* watch = nullptr;
  };
  /// What a rung asks of the remote.
  [[nodiscard]] static Options options_of(local_model::Rung rung) {
    return {.has_outline = rung != local_model::Rung::kHeldWrench,
            .has_tiles = rung == local_model::Rung::kTiles,
            .has_curvature = rung == local_model::Rung::kQuadratic};
  }
  /// bodies: the tool, then the objects, prepared; what they point at must outlive it. The seed is the link's.
  RemoteAcrossLink(std::span<const contact_service::TouchableObject> bodies, const contact_service::ContactOptions&,
                   const transport::LinkSpec& link, const Options& options, std::uint64_t seed = 1);
  /// The pair must outlive it.
  RemoteAcrossLink(const FeltPair& pair, const contact::Material& material, const transport::LinkSpec& link,
                   const Options& options, std::uint64_t seed = 1);

  /// The master's time; before each tick.
  void at(std::int64_t now_ns) { now_ns_ = now_ns; }
  void send(const master_station::ToolState&) noexcept override;
  bool poll(contact::ContactSet& newest) noexcept override;
  /// A surface changes at the far end, now.
  void edit(const slave_sim::SurfaceEdit&);
  /// What rung 3 feels, and rungs 1 and 2 beside what the remote tells; null without an outline.
  [[nodiscard]] local_model::LocalContacts* contacts() { return contacts_ ? &*contacts_ : nullptr; }

  [[nodiscard]] std::size_t outline_bytes() const { return outline_bytes_; }
  // Received by the master so far, payloads:
  [[nodiscard]] std::uint64_t contact_bytes() const { return contacts_down_.received_bytes(); }
  [[nodiscard]] std::uint64_t tile_bytes() const { return tiles_down_.received_bytes(); }

 private:
  void live_far_end();
  void send_from(transport::BulkLane&, Lane&, std::int64_t now_ns);

  Options options_;
  contact_service::ContactService service_;
  std::optional<slave_sim::TileFeed> feed_;
  std::size_t outline_bytes_ = 0;
  std::unique_ptr<local_model::TileCache> cache_;
  std::optional<local_model::LocalContacts> contacts_;
  std::optional<master_station::TileReceiver> receiver_;
  transport::BulkLane bulk_there_, bulk_here_;
  Lane poses_up_, tiles_up_, contacts_down_, tiles_down_;
  std::int64_t now_ns_ = 0, far_ns_ = 0, requested_ns_ = -1'000'000'000;
  contact_service::ToolPose pose_there_;
  spatial::Pose asked_there_;  // of the pose message that pose_there_ is made of
  bool has_pose_ = false;
  std::uint32_t ahead_us_ = 0;
  codecs::PoseWriter poses_here_;
  codecs::AnswerReader answers_here_;
  codecs::AnswerWriter answers_there_;
};

}  // namespace farfeel::bench
