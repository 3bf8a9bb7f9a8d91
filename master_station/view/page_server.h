// Serves the page and a session's newest state to browsers on this machine: HTTP from memory and WebSocket, one thread.
//
// Closed to others: loopback alone, a Host and an Origin of this very address, and a random token that stands in the
// address' fragment, which browsers send to nobody, and is the first WebSocket message. A client that has two ticks
// which it has not said it took gets no third: the next is then the newest.
#pragma once

#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "master_station/view/newest_session.h"

namespace farfeel::master_station {

inline constexpr int kMostTicksInFlight = 2;

class PageServer {
 public:
  /// port 0: any that is free.
  [[nodiscard]] static tl::expected<std::unique_ptr<PageServer>, std::string> start(int port);
  ~PageServer();

  /// With the token.
  [[nodiscard]] std::string address() const;
  [[nodiscard]] int port() const;
  /// Before run(); must outlive this.
  void show(NewestSession& session);
  /// Any thread: the session has changed.
  void wake();
  /// Serves until something happened or wake() was called. Returns how many clients look.
  int serve();

 private:
  class State;
  explicit PageServer(std::unique_ptr<State>);
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::master_station
