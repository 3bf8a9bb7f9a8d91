// A scene's felt surfaces at the operator's end: geometry and coarsest heights from the start, and the heights
// themselves tile by tile as they arrive.
//
// The thread that receives puts tiles in; the haptic thread takes a few of them over in every tick, between two
// looks at the surfaces. So no surface ever changes while it is read, and neither thread waits for the other.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/contact_service/felt_scene.h"
#include "haptic_core/realtime/spsc_queue.h"

namespace farfeel::local_model {

class TileCache final : public contact_service::HeightPresence {
 public:
  /// Takes all memory there will ever be. Precondition: the bodies' surfaces have no faults, and there is a tool.
  explicit TileCache(contact_service::FeltScene);

  enum class Put : std::uint8_t {
    kTaken,    ///< or known already, in this version or a newer one: it need not come again
    kFull,     ///< the haptic thread has not caught up: it must come again
    kUnknown,  ///< no tile of this scene
  };
  // The thread that receives. Wait-free.
  /// The remote was started anew: its versions count from the beginning, and what came from the old one is not believed
  /// to be current. It is felt on, flagged, until it comes again. False: the haptic thread has not caught up, try
  /// again; until then no tile of the new remote may be put.
  [[nodiscard]] bool begin_epoch() noexcept;
  /// Whether this scene has such a tile.
  [[nodiscard]] bool knows(const contact_service::SurfaceTile&) const noexcept;
  [[nodiscard]] Put put(const contact_service::SurfaceTile&, const geometry::HeightTile&) noexcept;
  /// The tile that was last put there, of a remote before this one too, is what this one has, in that version.
  [[nodiscard]] Put put_same(const contact_service::SurfaceTile&, std::uint32_t version) noexcept;

  // The haptic thread.
  /// Takes over up to `most` tiles that have arrived; returns how many. Realtime-safe.
  std::uint32_t take_arrived(std::uint32_t most) noexcept;
  [[nodiscard]] bool has(const contact_service::SurfaceTile&) const noexcept override;
  [[nodiscard]] double off_m(const contact_service::SurfaceTile&) const noexcept override;
  [[nodiscard]] bool has_all(std::uint32_t surface) const noexcept override { return lacking_[surface] == 0; }

  /// The bodies, ready to be asked about contacts: the tool, then the objects.
  [[nodiscard]] std::vector<contact_service::TouchableObject> touchable() const;
  [[nodiscard]] const contact_service::FeltScene& scene() const { return scene_; }
  [[nodiscard]] bool is_textured() const;

  /// Any thread: different tiles and versions taken by put() so far.
  [[nodiscard]] std::uint64_t tiles() const noexcept { return tiles_.load(std::memory_order_relaxed); }
  /// Any thread: the newest version of it that put() has taken, of the remote that runs now; none before any.
  /// Precondition: knows().
  [[nodiscard]] std::optional<std::uint32_t> given(const contact_service::SurfaceTile& where) const noexcept {
    const std::uint64_t newest = newest_given_[where.surface][where.tile].load(std::memory_order_relaxed);
    return newest > 0 ? std::optional(static_cast<std::uint32_t>(newest - 1)) : std::nullopt;
  }

 private:
  struct Arrived {
    enum class What : std::uint8_t { kTile, kSame, kEpoch };  // kSame: with the version alone; kEpoch: no tile
    contact_service::SurfaceTile where;
    geometry::HeightTile tile;
    What what = What::kTile;
  };

  [[nodiscard]] Put put(const Arrived&) noexcept;

  contact_service::FeltScene scene_;
  std::vector<std::unique_ptr<penetration::FeltSurface>> felt_;
  std::vector<std::vector<bool>> is_here_;  // the haptic thread's
  bool has_old_ = false;                    // the haptic thread's: tiles of a remote that is gone may stand in
  std::vector<std::size_t> lacking_;        // the haptic thread's: how many are not, of each surface
  std::vector<std::vector<std::atomic<std::uint64_t>>> newest_given_;  // version + 1, 0 before any; put() alone writes
  realtime::SpscQueue<Arrived> arrived_;
  std::atomic<std::uint64_t> tiles_{0};
};

}  // namespace farfeel::local_model
