// Who greets: this machine's keys, and the key of the slave that it means.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "transport/error.h"
#include "transport/lane/lane_initiator.h"
#include "transport/net/address.h"

namespace farfeel::master_station {

/// folder: of keys; empty: the user's, or for a slave on this machine one that is made for the occasion. slave_name: as
/// the folder's list of slaves has it; empty where the list has one alone.
[[nodiscard]] tl::expected<transport::Greeter, transport::Error> greeter_of_keys(
    const std::string& folder, const std::string& slave_name, const std::vector<transport::Address>& slave);

}  // namespace farfeel::master_station
