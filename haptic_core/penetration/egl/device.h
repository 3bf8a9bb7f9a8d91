// A graphics device that computes penetration depths, shared by all sessions of a process.
//
// One thread owns the context. Each client (a session's back end) writes its contacts into a ring of its own in mapped
// memory and marks it submitted; the device's thread takes everything submitted at that moment into one dispatch, puts
// a fence behind it, and marks it done when the fence has passed. Nobody holds a lock on the way, and a client that
// would have to wait too long walks away.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/headless_gl/headless_context.h"
#include "haptic_core/penetration/egl/frame_layout.h"
#include "haptic_core/penetration/egl/height_store.h"

namespace farfeel::penetration::egl {

struct DeviceOptions {
  std::string vendor{};       ///< only a device whose vendor's or renderer's name holds this; empty: any
  std::uint32_t group = 0;    ///< invocations a contact, a power of two from 64 to 1024; 0: what suits the device
  std::uint32_t clients = 4;  ///< at most, 1 to 64; each takes 6 MiB on the device and as much in mapped memory
  bool is_timed = false;      ///< frames tell how long the device took: a little slower
  double patience_s = 0;      ///< how long a client waits for a frame; 0: 5 ms on a real device, long on a software one
  double lost_after_s =
      0;  ///< a dispatch not back by then never comes; 0: 1 s on a real device, long on a software one
  /// So many dispatches in a row with a contact left unanswered mean that the device is lost; 0: any number is well, as
  /// on a software device, which gives up on what takes too many turns of a loop; negative: as suits the device.
  int most_empty = -1;
  std::function<void(Gl&)> amend{};                   ///< for tests: may replace functions before anything is called
  std::function<void(const std::string&)> on_loss{};  ///< told why, once, by the device's thread
};

struct DeviceInfo {
  std::string vendor, renderer, version, platform;
  bool is_software = false;
  std::uint32_t group = 0;
  double warmup_ms = 0;  ///< from no context to programs that have run
};

/// How long the parts of a frame took; the first two are the device's own clock, zero unless DeviceOptions::is_timed.
struct FrameTimes {
  double upload_us = 0, dispatch_us = 0;
  double readback_us = 0;  ///< from submission to being seen done, less the two above: submission, fence, reading
};

inline constexpr std::uint32_t kMostContactsAFrame = 256;

/// One place of a client's ring. The client fills it while kFree, the device answers it.
struct Frame {
  enum State : std::uint32_t { kFree, kSubmitted, kInFlight, kDone, kFailed };

  std::span<Word4> words;                          ///< mapped for writing
  std::span<const std::uint32_t> results;          ///< mapped for reading: kResultWords a contact
  std::uint32_t first_word = 0, first_result = 0;  ///< of these, as the shaders count

  // By the client.
  std::uint32_t used_words = 0, contacts = 0, stamp = 0;
  bool wants_hessian = false;
  std::array<std::uint32_t, kMostContactsAFrame> headers{};  ///< each contact's first word, as the shaders count
  std::vector<std::uint8_t> tile_bytes;                      ///< changed tiles, to be uploaded first
  std::vector<TileCopy> tile_copies;
  std::chrono::steady_clock::time_point submitted_at;

  // By the device.
  FrameTimes times;
  std::atomic<std::uint32_t> state{kFree};

  /// Whether the device wrote this contact's result for this very frame.
  [[nodiscard]] bool has_result(std::uint32_t contact) const {
    return results[std::size_t{contact} * kResultWords + kStampAt] == stamp;
  }
};

class Device {
 public:
  /// Opens, compiles and warms up: a second or so. From an ordinary thread: the device's threads inherit its priority.
  [[nodiscard]] static tl::expected<std::shared_ptr<Device>, headless_gl::Failure> open(const DeviceOptions&);
  ~Device();

  [[nodiscard]] const DeviceInfo& info() const;
  /// Nothing will be answered any more. Any thread, wait-free.
  [[nodiscard]] bool is_lost() const noexcept;

  struct Counters {
    std::uint64_t dispatches = 0, frames = 0, contacts = 0;
  };
  [[nodiscard]] Counters counters() const noexcept;

  // For back ends.
  /// A ring of frames, or null when all clients' places are taken.
  [[nodiscard]] std::span<Frame> take_ring();
  /// Waits until none of the ring's frames is in flight.
  void give_back(std::span<Frame> ring);
  /// Uploads a surface unless it is there already; null where it does not fit. Blocks; the surface must outlive the
  /// result, and is told apart by its address.
  [[nodiscard]] std::shared_ptr<const SurfacePlace> hold(const FeltSurface&);
  /// Wait-free, but for waking the device's thread if it sleeps.
  void submit(Frame&) noexcept;
  /// True when the frame is done; false when it failed or would not come in time: then it stays with the device.
  [[nodiscard]] bool wait(Frame&) const noexcept;

 private:
  class State;
  explicit Device(std::unique_ptr<State>);
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::penetration::egl
