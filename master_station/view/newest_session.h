// A master's session as it was told last over its local socket, kept up to date by a thread of its own.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "codecs/view/view_messages.h"
#include "codecs/view/view_tick.h"
#include "master_station/feed/feed_socket.h"
#include "master_station/view/recent_bins.h"

namespace farfeel::master_station {

class NewestSession {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;
  /// Of each kind that is told when it changes, the newest: status, presence of tiles, answer; null before any.
  using Newest = std::array<Bytes, 3>;
  static constexpr std::size_t kAnswer = 2;

  /// `changed` is called on the thread of its own, after every change.
  NewestSession(FeedSocket socket, std::function<void()> changed);

  // Any thread.
  [[nodiscard]] std::vector<Bytes> parts() const;  ///< of the scene, that are here
  [[nodiscard]] Newest newest() const;
  [[nodiscard]] codecs::ViewHistory history() const;
  /// The newest tick since this was asked last, with the bins of those between; for one caller.
  [[nodiscard]] std::optional<codecs::ViewTick> take_tick();
  /// The master has hung up, or says what nobody understands.
  [[nodiscard]] bool is_over() const;
  /// Asks the master for something; what its socket does not take at once is not asked.
  void ask(codecs::ViewVerb) const;

 private:
  void run(const std::stop_token&);
  void take(std::span<const std::byte> message);
  void keep(codecs::ViewTick);

  FeedSocket socket_;
  std::function<void()> changed_;
  mutable std::mutex mutex_;
  std::vector<Bytes> parts_;
  Newest newest_;
  std::optional<codecs::ViewTick> tick_;
  RecentBins recent_;
  bool is_over_ = false;
  std::jthread thread_;  // last: it ends before what it uses
};

}  // namespace farfeel::master_station
