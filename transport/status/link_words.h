// What is the matter with a session's link, in words for the operator: what is seen, with figures, and what to do.
#pragma once

#include <optional>
#include <string>

#include "transport/status/link_status.h"

namespace farfeel::transport {

/// Looks at a master's figures again and again, some times a second. One thread.
class LinkWords {
 public:
  /// felt_round_trip_ms: nothing is felt over a link that always takes longer.
  explicit LinkWords(double felt_round_trip_ms) : felt_round_trip_ms_(felt_round_trip_ms) {}

  /// What has not been said of this session; nothing mostly. now_s: of a clock that never goes back.
  [[nodiscard]] std::optional<std::string> look(const LinkStatus&, double now_s);

 private:
  struct Look {
    double at_s = 0;
    LinkStatus status;
  };

  double felt_round_trip_ms_;
  std::optional<Look> before_;  // the window's beginning
  bool is_far_said_ = false, is_narrow_said_ = false, is_lossy_said_ = false;
};

/// Why a scene does not come, from what came while it was waited for.
struct SceneWait {
  double seconds = 0, share = 0;  ///< waited; of the scene that is here, 0..1
  double greeting_ms = 0;         ///< the handshake's round trip
  std::uint64_t datagrams = 0;    ///< that came on the bulk lane
  std::size_t longest_bytes = 0;  ///< of those, without IP and UDP
  std::string trouble;            ///< of the session; empty while it is heard
};
[[nodiscard]] std::string why_no_scene(const SceneWait&);

}  // namespace farfeel::transport
