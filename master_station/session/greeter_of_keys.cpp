#include "master_station/session/greeter_of_keys.h"

#include <algorithm>
#include <memory>

#include "transport/keys/key_folder.h"
#include "transport/lane/lane_keys.h"
#include "transport/net/arrival_clock.h"

namespace farfeel::master_station {
namespace {

tl::expected<transport::TrustEntry, std::string> chosen(const transport::TrustList& slaves, const std::string& name) {
  if (!name.empty()) {
    if (const transport::TrustEntry* entry = slaves.find_name(name)) return *entry;
    return tl::unexpected("no slave of the name '" + name + "' is trusted in " + slaves.path() +
                          ": 'farfeel key list' shows who is");
  }
  if (slaves.entries().size() == 1) return slaves.entries().front();
  if (slaves.entries().empty())
    return tl::unexpected("no slave is trusted in " + slaves.path() +
                          ": at the slave's machine run 'farfeel key show' and paste its line for operators here");
  return tl::unexpected(std::to_string(slaves.entries().size()) + " slaves are trusted in " + slaves.path() +
                        ": say which one is meant with --slave NAME");
}

}  // namespace

tl::expected<transport::Greeter, transport::Error> greeter_of_keys(const std::string& folder,
                                                                   const std::string& slave_name,
                                                                   const std::vector<transport::Address>& slave) {
  const auto refused = [](const std::string& why) {
    return tl::unexpected(transport::Error{transport::ErrorKind::kRefused, why});
  };
  const bool is_this_machine =
      std::all_of(slave.begin(), slave.end(), [](const transport::Address& address) { return address.is_loopback(); });
  const auto keys = transport::KeyFolder::open_for(folder, is_this_machine);
  if (!keys) return refused(keys.error().message);
  const auto own = keys->identity();
  if (!own) return refused(own.error().message);
  const auto slaves = keys->trusted(transport::Role::kSlave);
  if (!slaves) return refused(slaves.error().message);
  const auto entry = chosen(*slaves, slave_name);
  if (!entry) return refused(entry.error());
  if (entry->is_expired(transport::wall_clock_ns()))
    return refused("the trust in the slave '" + entry->name + "' has expired: trust it again with a later --expires");
  auto counter = keys->counter();
  if (!counter) return refused(counter.error().message);
  transport::Greeter greeter;
  greeter.own = *own;
  greeter.slave = entry->public_key;
  greeter.psk = entry->psk_or_zeros();
  greeter.master = transport::random_identity();
  greeter.next_counter = [kept = std::make_shared<transport::HandshakeCounter>(*std::move(counter))] {
    return kept->next(transport::wall_clock_ns());
  };
  greeter.wall_clock_ns = transport::wall_clock_ns;
  return greeter;
}

}  // namespace farfeel::master_station
