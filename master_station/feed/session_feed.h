// What the master tells of its running session to whoever looks at it over the local socket: the scene once, then the
// newest tick and words. It drops and never waits; who reads slowly gets fewer ticks, each the newest, and the bins of
// those between.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/scene/scene_description.h"
#include "codecs/view/message_stream.h"
#include "codecs/view/view_messages.h"
#include "codecs/view/view_tick.h"
#include "master_station/feed/feed_socket.h"
#include "master_station/feed/shown_tiles.h"
#include "master_station/report/tick_sink.h"

namespace farfeel::master_station {

/// What no tick knows. Of the round trip as far as the wire tells; NaN where it does not.
struct BesideTicks {
  std::uint8_t fault = 0;
  double network_ms = std::numeric_limits<double>::quiet_NaN(), node_ms = network_ms;
  double view_yaw_rad = 0;                         ///< as the person turned the device's axes about z
  std::vector<motion::ObjectCourse> courses = {};  ///< the newest of each object that may change
};

class SessionFeed final : public TickSink {
 public:
  using Ask = std::function<codecs::ViewAnswer(codecs::ViewVerb)>;

  /// Listens at feed_path() of this process. What is asked for comes to `ask` on the recorder's thread. The tiles, if
  /// any, outlive it; before the loop runs.
  [[nodiscard]] static tl::expected<std::unique_ptr<SessionFeed>, std::string> open(const codecs::SceneDescription&,
                                                                                    const local_model::TileCache* tiles,
                                                                                    Ask ask);
  ~SessionFeed() override;

  // The recorder's thread.
  void add(const TickRecord&) override;
  void flush() override;

  /// Any thread but the haptic one.
  void tell(const codecs::ViewStatus&, const BesideTicks&);

 private:
  struct Client {
    FeedSocket socket;
    codecs::MessageStream asked{codecs::kMostViewRequestBytes};
    std::vector<std::byte> sending;  // what the socket has not taken yet, from `sent` on
    std::size_t sent = 0, parts_told = 0;
    std::uint64_t status_told = 0, presence_told = 0;
    bool has_tick = false;
    codecs::ViewTick waiting;       // the newest, with the bins of all that were not told
    std::vector<std::byte> answer;  // to what it asked last; empty once it is told
  };
  SessionFeed(std::string path, FeedSocket listening, const local_model::TileCache* tiles, Ask ask);
  void look_at_tiles();
  [[nodiscard]] bool serve(Client&);
  [[nodiscard]] bool find_next(Client&);
  [[nodiscard]] bool hear(Client&);

  std::string path_;
  FeedSocket listening_;
  Ask ask_;
  ShownTiles tiles_;
  int flushes_ = 0;  // since the tiles were looked at
  std::vector<std::byte> presence_;
  std::uint64_t presences_ = 0;
  std::vector<std::vector<std::byte>> parts_;  // of the scene, each with its length
  motion::MovingObjects moving_;
  std::vector<std::unique_ptr<Client>> clients_;
  codecs::ViewTick next_;  // since the last flush
  bool has_next_ = false;
  double newest_rtt_ms_ = std::numeric_limits<double>::quiet_NaN();
  std::int64_t answered_ns_ = 0;

  std::mutex mutex_;  // of what tell() gives
  std::vector<std::byte> status_;
  std::uint64_t statuses_ = 0;
  BesideTicks beside_;
};

}  // namespace farfeel::master_station
