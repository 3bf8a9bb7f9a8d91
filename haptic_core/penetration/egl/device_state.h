// What a Device keeps, and what its own thread does with it, turn by turn: what is asked for outside of frames
// (uploads), a dispatch of what has been submitted, the oldest dispatch if its fence has passed. When there is nothing
// to do it watches for a while, then sleeps.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "haptic_core/penetration/egl/device.h"
#include "haptic_core/penetration/egl/programs.h"

namespace farfeel::penetration::egl {

using Clock = std::chrono::steady_clock;

[[nodiscard]] inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One turn of watching for something that another thread does.
inline void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

/// Frames that went with one dispatch.
struct Dispatch {
  std::array<Frame*, kFramesARing * 64> frames{};
  std::size_t count = 0;
  std::uint32_t place = 0;  // of its directory and queries
  GLsync fence = nullptr;
  Clock::time_point began;
};

class Device::State {
 public:
  explicit State(const DeviceOptions& options)
      : options_(options), frames_(std::size_t{kFramesARing} * options.clients), taken_(options.clients, false) {}
  ~State() {
    thread_.request_stop();
    ring_bell();
  }

  tl::expected<void, headless_gl::Failure> start();
  /// On the device's thread, before its next dispatch; waits for it. False once the device is lost.
  bool ask(const std::function<void()>& what);
  void ring_bell() noexcept;

  std::string open();
  void run(const std::stop_token&);
  bool answer_asked();
  bool dispatch_submitted();
  bool collect();
  void upload_tiles(const Frame&);
  void finish(Dispatch&, Frame::State);
  [[nodiscard]] bool is_healthy();
  void lose(const std::string& why);
  void abandon();

  DeviceOptions options_;
  DeviceInfo info_;
  std::vector<Frame> frames_;
  std::mutex mutex_;  // of what is asked outside of frames
  std::vector<bool> taken_;
  std::map<const FeltSurface*, std::weak_ptr<const SurfacePlace>> held_;
  std::vector<std::function<void()>> asked_;
  std::atomic<bool> has_asked_{false}, is_lost_{false};
  std::atomic<std::uint32_t> bell_{0};
  std::atomic<std::uint64_t> dispatches_{0}, answered_frames_{0}, contacts_{0};

  // The device's thread's own.
  std::optional<headless_gl::HeadlessContext> context_;
  Gl gl_;
  std::unique_ptr<HeightStore> heights_;
  Programs programs_;
  Buffers buffers_;
  std::array<std::array<GLuint, 3>, kDispatchesInFlight> clocks_{};
  std::deque<Dispatch> in_flight_;
  std::uint32_t next_place_ = 0;
  std::size_t next_frame_ = 0;  // to look at first: no client is always last
  int empty_answers_ = 0, unchecked_ = 0;

  std::jthread thread_;  // last: it uses everything above
};

}  // namespace farfeel::penetration::egl
