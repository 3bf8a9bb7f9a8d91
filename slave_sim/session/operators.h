// Who may operate this slave: its own key, and the list of operators as it stands in the file now.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"
#include "transport/keys/trust_list.h"
#include "transport/lane/handshake_server.h"
#include "transport/net/address.h"

namespace farfeel::slave_sim {

/// One thread at a time.
class Operators {
 public:
  /// folder: of keys; empty: the user's, or where only this machine is listened to one that is made for the occasion.
  [[nodiscard]] static tl::expected<Operators, transport::Error> open(const std::string& folder,
                                                                      const transport::Address& listen);

  [[nodiscard]] std::optional<transport::Operator> find(const transport::Key32& key) const;
  /// Reads the list again if it changed. What is wrong with it, if that is new.
  [[nodiscard]] std::optional<std::string> look();

  [[nodiscard]] const transport::KeyPair& own() const { return own_; }
  [[nodiscard]] std::size_t count() const { return list_.entries().size(); }
  [[nodiscard]] const std::string& path() const { return list_.path(); }

 private:
  Operators(const transport::KeyPair& own, transport::TrustList list, bool is_for_the_occasion)
      : own_(own), list_(std::move(list)), is_for_the_occasion_(is_for_the_occasion) {}
  transport::KeyPair own_;
  transport::TrustList list_;
  bool is_for_the_occasion_;  // the keys are this user's on this machine, who may do everything
  std::string told_;
};

}  // namespace farfeel::slave_sim
