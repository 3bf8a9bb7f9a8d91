// `farfeel doctor --to HOST`: what a link can do, by an ordinary sealed session over it with the simulated hand.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "deploy/front/child.h"
#include "deploy/front/doctor.h"

namespace farfeel::master_station {
struct SessionSummary;
}
namespace farfeel::transport {
struct LinkStatus;
}

namespace farfeel::front {

struct LinkWishes {
  std::string to;                           ///< HOST[:PORT]
  std::vector<std::string> to_master = {};  ///< further arguments of it: keys, the slave's name, a relay
  double seconds = 5;
};

/// Takes a session's time, and what it takes to begin one. An error where none began: why, and what to do.
[[nodiscard]] tl::expected<std::vector<Finding>, FrontError> examine_link(const LinkWishes&);

/// What a session's figures say of its link. mind: what the master said is the matter with it, a line each.
[[nodiscard]] std::vector<Finding> link_findings(const master_station::SessionSummary&, const transport::LinkStatus&,
                                                 const std::vector<std::string>& mind);

}  // namespace farfeel::front
