// Two bulk lanes and a haptic lane of 1 kHz over one simulated link, in simulated time: events, not steps.
//
//   slave: BulkLane ─┐                                              ┌─ BulkLane :master
//          answers ──┴─> [FIFO, rate] ─> delay, loss, order, MTU ──>┴─ round trips
//          poses   <──── delay, loss, order, MTU <─ [FIFO, rate] ──── poses
//
// Each end is a thread that wakes when something arrived or is due, as late as its wake-ups are.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "transport/bulk/bulk_lane.h"
#include "transport/link/impairment.h"

namespace farfeel::transport {

struct LabLink {
  LinkSpec path;                  ///< its rate and queue stand for a bottleneck in front of the rest
  std::size_t mtu_bytes = 1'500;  ///< of datagrams, headers not counted; longer ones vanish
};

struct LabOptions {
  LabLink link;
  std::size_t pose_bytes = 61 + 28, answer_bytes = 300 + 28;  ///< of the haptic lane, on the wire
  bool has_haptic = true;
  std::int64_t late_ns = 20'000;  ///< a wake-up's mean lateness, exponential
  double slice_share = 0;         ///< of wake-ups that come a scheduler's slice late,
  std::int64_t slice_ns = 4'000'000;
  double receipt_loss = 0;  ///< of what the master sends on the bulk lane
  std::uint64_t seed = 1;
  BulkOptions slave, master;
  std::uint64_t scene_bytes = 4 * kMaxObjectBytes;
};

class BulkLab {
 public:
  enum End : std::size_t { kSlave, kMaster };

  explicit BulkLab(const LabOptions&);
  /// Runs until then. What arrives is handed to on_object and on_body.
  void run_until(std::int64_t end_ns);
  void set_link(const LabLink&);
  void set_cut(bool is_cut) { is_cut_ = is_cut; }  ///< nothing gets through, either way
  /// A new session: what is under way is lost. restart_master: the master forgets all, as a new process does.
  void new_session(bool has_new_slave, bool has_new_master);

  [[nodiscard]] BulkLane& lane(End end) { return *ends_[end].lane; }
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  /// Round trips of the haptic lane since the last call [ns], sorted.
  [[nodiscard]] std::vector<std::int64_t> take_round_trips();

  std::function<void(ReceivedObject)> on_object;
  std::function<void(const BulkLane::Body&)> on_body;
  std::function<bool(End from, std::vector<std::byte>&)> on_wire;  ///< false: lost; may change it
  std::shared_ptr<ByteBudget> scene;
  std::size_t answer_bytes;  ///< may change under way

 private:
  struct Datagram {
    End to{};
    std::int64_t haptic_ns = -1;  // when its pose left; -1: bulk
    std::vector<std::byte> bytes;
  };
  struct Node {
    std::unique_ptr<BulkLane> lane;
    std::vector<std::pair<std::int64_t, std::vector<std::byte>>> waiting;  // arrival, message
    std::int64_t wake_ns = kNever_ns;
    std::uint64_t haptic_bytes = 0;
  };
  struct Way {
    std::unique_ptr<Impairment> impairment;
    std::int64_t free_ns = 0;
  };
  void send(End from, Datagram, std::size_t wire_bytes);
  void wake(End);
  void wake_by(End, std::int64_t at_ns);
  [[nodiscard]] double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  [[nodiscard]] std::int64_t lateness_ns();

  LabOptions options_;
  std::mt19937_64 random_;
  std::array<Node, 2> ends_;
  std::array<Way, 2> ways_;  // from that end
  std::multimap<std::int64_t, Datagram> under_way_;
  std::int64_t now_ns_ = 1'000'000'000, pose_ns_ = 1'000'000'000;
  bool is_cut_ = false;
  std::vector<std::int64_t> round_trips_;
  std::uint64_t sessions_ = 0;
};

[[nodiscard]] inline std::shared_ptr<const Object> random_object(std::size_t size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::byte> bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return make_object(std::move(bytes));
}

[[nodiscard]] inline double quantile_ms(const std::vector<std::int64_t>& sorted_ns, double q) {
  if (sorted_ns.empty()) return 0;
  const auto at = static_cast<std::size_t>(q * static_cast<double>(sorted_ns.size() - 1));
  return 1e-6 * static_cast<double>(sorted_ns[at]);
}

}  // namespace farfeel::transport
