// A living scene served by a real node, felt by a real master, with a real link between them: sockets and threads as in
// the programs, in one process, so that one clock times what passes from end to end.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "haptic_core/local_model/local_contacts.h"
#include "master_station/session/master_session.h"
#include "slave_sim/living/living_scene.h"
#include "slave_sim/living/served_world.h"
#include "transport/link/relay.h"

namespace farfeel::bench {

/// What a scene has beside the block that is edited: objects that stand far away, and triangles that are seen.
struct LivingSize {
  std::size_t objects = 1;            ///< in all
  std::size_t visible_triangles = 0;  ///< of the block, at least
};
/// A ridged block at the world's origin, its crest at z = 20 mm, and far objects of some 700 coarse triangles; whoever
/// asks may edit it. The tool is a ball of 6 mm.
[[nodiscard]] slave_sim::World living_world(const LivingSize&);

class LivingPair {
 public:
  /// The world must outlive it. Throws what cannot be had.
  LivingPair(slave_sim::World&, const transport::LinkSpec& link);
  ~LivingPair();
  LivingPair(const LivingPair&) = delete;
  LivingPair& operator=(const LivingPair&) = delete;

  /// From the first datagram to a scene that can be felt [ms].
  [[nodiscard]] double first_touch_ms() const { return first_touch_ms_; }
  [[nodiscard]] std::size_t scene_bytes() const { return master_->scene_bytes(); }
  [[nodiscard]] slave_sim::LivingScene& living() { return living_; }
  [[nodiscard]] slave_sim::SlaveSession& slave() { return *slave_; }
  [[nodiscard]] const local_model::TileCache& tiles() const { return *master_->tiles(); }
  [[nodiscard]] master_station::LinkReport report() { return master_->report(); }

  /// The node ends, and another one comes in its place, of the scene as it is now; beginning: as it was before all.
  void start_slave_anew(const slave_sim::World& beginning);

  struct Tick {
    std::int64_t at_ns = 0;
    double depth_m = 0;     ///< of the deepest contact
    bool is_whole = false;  ///< all heights are here
    double answer_age_ms = 0;
    double took_ms = 0;
  };
  /// One tick of the haptic thread with the tool held there; paced at 1 kHz.
  Tick tick(const glm::dvec3& p_WT);

 private:
  slave_sim::World beginning_;  // of a slave that was started anew
  slave_sim::LivingScene living_;
  std::unique_ptr<slave_sim::ServedWorld> served_;
  std::unique_ptr<slave_sim::SlaveSession> slave_;
  std::unique_ptr<transport::Relay> link_;
  std::atomic<bool> is_over_{false};
  std::jthread link_thread_;
  std::unique_ptr<master_station::MasterSession> master_;
  std::optional<local_model::LocalContacts> contacts_;
  double first_touch_ms_ = 0;
  std::int64_t began_ns_ = 0, next_ns_ = 0, answered_ns_ = 0;
  std::uint32_t sequence_ = 0;
};

}  // namespace farfeel::bench
