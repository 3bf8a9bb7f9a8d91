// A side session from this end: greets the slave, and hands out what it tells. One thread, which calls look() all the
// time that the session is to live.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"
#include "transport/net/udp_socket.h"
#include "transport/session_client.h"

namespace farfeel::master_station {

class SideLink {
 public:
  struct Options {
    std::string slave;       ///< name or address, and port; empty: this machine
    std::string keys, name;  ///< as greeter_of_keys has them
    transport::SessionClient::Takes takes = transport::SessionClient::Takes::kNothing;
  };
  /// Finds the slave and opens a socket to it; nothing is sent yet.
  [[nodiscard]] static tl::expected<SideLink, transport::Error> open(const Options&);

  /// Receives, answers and sends what is due, and sleeps until something can have changed, for patience_s at most.
  /// take: what the slave tells, valid during the call.
  void look(double patience_s, const std::function<void(const transport::Message&)>& take);
  void send(transport::MessageType, std::span<const std::byte> payload);
  /// Says goodbye.
  void end();

  [[nodiscard]] const transport::SessionClient& client() const { return *client_; }
  [[nodiscard]] std::string trouble() const { return client_->trouble(transport::monotonic_ns()); }
  [[nodiscard]] bool is_heard() const { return client_->is_heard(transport::monotonic_ns()); }
  [[nodiscard]] const transport::Address& slave() const { return slave_; }

 private:
  SideLink(const transport::Address& slave, transport::UdpSocket socket, const transport::Greeter&,
           transport::SessionClient::Takes);

  transport::Address slave_;
  transport::UdpSocket socket_;
  std::unique_ptr<transport::SessionClient> client_;
};

}  // namespace farfeel::master_station
