// What a slave of these tests feels and shows, so that a master can tell from any of it which slave told it, and when:
// every start of the slave has a number, its run.
#pragma once

#include <cstdint>
#include <memory>

#include "codecs/scene/scene_description.h"
#include "haptic_core/geometry/height_tile.h"
#include "slave_sim/session/contact_source.h"
#include "tests/support/analytic_remote.h"
#include "transport/lane/handshake_server.h"

namespace farfeel::end_to_end {

/// Runs repeat after so many; neighbours differ.
inline constexpr std::uint32_t kRunsTold = 8;
/// Of the plane that is felt in this run, above the plates that tiles are told of [m].
[[nodiscard]] constexpr double level_m(std::uint32_t run) {
  return 2e-3 + 25e-6 * static_cast<double>(run % kRunsTold);
}
/// The four corners of a small block that touch it.
[[nodiscard]] test_support::AnalyticWorld plane(std::uint32_t run);
/// A tile of that version, as that run tells it: every coefficient says which.
[[nodiscard]] geometry::HeightTile told_tile(std::uint32_t run, std::uint32_t version);

/// Some 100 kB; scenes of different numbers are different.
[[nodiscard]] codecs::SceneDescription scene_number(std::uint32_t number);

/// Contacts with the plane; each takes as long as asked for, computing.
class PlaneContacts final : public slave_sim::ContactSource {
 public:
  PlaneContacts(std::uint32_t run, std::int64_t takes_ns) : world_(plane(run)), takes_ns_(takes_ns) {}
  const contact_service::Answer& answer(const contact_service::ToolPose& pose) noexcept override;
  void restart() noexcept override {}

 private:
  test_support::AnalyticWorld world_;
  std::int64_t takes_ns_;
  contact_service::Answer set_;
};

/// Who the slave is, and the operator, in every process of these tests.
[[nodiscard]] transport::KeyPair slave_key();
[[nodiscard]] transport::KeyPair operator_key();
[[nodiscard]] std::optional<transport::Operator> allowed_operator(const transport::Key32&);

/// How a slave process is started.
struct SlaveStart {
  std::uint16_t port = 0;  ///< 0: a free one
  std::uint32_t run = 0, scene = 0;
  std::int64_t takes_ns = 20'000;  ///< to find contacts
  bool edits = true;               ///< tiles under the tool change fifty times a second
};
/// A slave's whole life, on real sockets: writes its port to the descriptor once it listens, and serves until it is
/// killed.
[[noreturn]] void serve(const SlaveStart&, int tell);

}  // namespace farfeel::end_to_end
