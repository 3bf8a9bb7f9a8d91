#include "slave_sim/session/operators.h"

#include "transport/keys/key_folder.h"
#include "transport/net/arrival_clock.h"

namespace farfeel::slave_sim {
tl::expected<Operators, transport::Error> Operators::open(const std::string& folder, const transport::Address& listen) {
  const auto refused = [](const std::string& why) {
    return tl::unexpected(transport::Error{transport::ErrorKind::kRefused, why});
  };
  const auto keys = transport::KeyFolder::open_for(folder, listen.is_loopback());
  if (!keys) return refused(keys.error().message);
  const auto own = keys->identity();
  if (!own) return refused(own.error().message);
  auto list = keys->trusted(transport::Role::kOperator);
  if (!list) return refused(list.error().message);
  return Operators(*own, *std::move(list), folder.empty() && listen.is_loopback());
}

std::optional<transport::Operator> Operators::find(const transport::Key32& key) const {
  const auto found = list_.find(key, transport::wall_clock_ns());
  if (found.entry == nullptr) return std::nullopt;
  const transport::Roles roles = is_for_the_occasion_ ? transport::Roles{true, true, true} : found.entry->roles;
  return transport::Operator{
      found.entry->name, found.entry->psk_or_zeros(),  found.standing == transport::TrustList::Standing::kExpired,
      roles.operates,    roles.watches || roles.edits, roles.edits};
}

std::optional<std::string> Operators::look() {
  list_.refresh();
  if (list_.trouble() == told_) return std::nullopt;
  told_ = list_.trouble();
  return told_;
}

}  // namespace farfeel::slave_sim
