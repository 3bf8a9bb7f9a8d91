// A WebSocket client of the live view that draws nothing: as much of RFC 6455 as binary messages to and fro need.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "codecs/view/view_tick.h"

namespace farfeel::bench {

class ViewClient {
 public:
  /// address: as farfeel-view prints it, with the token. The session told it within some seconds, or it fails and says
  /// why in trouble().
  explicit ViewClient(const std::string& address);
  ~ViewClient();
  ViewClient(const ViewClient&) = delete;
  ViewClient& operator=(const ViewClient&) = delete;

  /// The next tick, waited for until then (CLOCK_MONOTONIC). It is told to have been taken.
  [[nodiscard]] std::optional<codecs::ViewTick> next(std::int64_t until_ns);
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  void send(std::span<const std::byte> message);
  [[nodiscard]] bool receive(std::int64_t until_ns);
  [[nodiscard]] std::optional<std::vector<std::byte>> message();

  int fd_ = -1;
  std::string trouble_;
  std::vector<std::byte> bytes_;
};

}  // namespace farfeel::bench
