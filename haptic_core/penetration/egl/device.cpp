#include "haptic_core/penetration/egl/device.h"

#include <algorithm>

#include "haptic_core/penetration/egl/device_state.h"

namespace farfeel::penetration::egl {
namespace {

/// A client watches for its frame this long, then yields, then naps.
constexpr std::chrono::microseconds kSpin{50}, kYield{200}, kNap{20};

}  // namespace

Device::Device(std::unique_ptr<State> state) : state_(std::move(state)) {}
Device::~Device() = default;

tl::expected<std::shared_ptr<Device>, headless_gl::Failure> Device::open(const DeviceOptions& options) {
  DeviceOptions sound = options;
  sound.clients = std::clamp(options.clients, 1u, 64u);
  auto state = std::make_unique<State>(sound);
  if (auto started = state->start(); !started) return tl::unexpected(started.error());
  return std::shared_ptr<Device>(new Device(std::move(state)));
}

const DeviceInfo& Device::info() const {
  return state_->info_;
}
bool Device::is_lost() const noexcept {
  return state_->is_lost_.load(std::memory_order_relaxed);
}
Device::Counters Device::counters() const noexcept {
  return {state_->dispatches_, state_->answered_frames_, state_->contacts_};
}

std::span<Frame> Device::take_ring() {
  const std::scoped_lock lock(state_->mutex_);
  const auto free = std::find(state_->taken_.begin(), state_->taken_.end(), false);
  if (free == state_->taken_.end()) return {};
  *free = true;
  const auto i = static_cast<std::size_t>(free - state_->taken_.begin());
  return std::span(state_->frames_).subspan(i * kFramesARing, kFramesARing);
}

void Device::give_back(std::span<Frame> ring) {
  if (ring.empty()) return;
  for (Frame& frame : ring) {
    while (!is_lost() && (frame.state == Frame::kSubmitted || frame.state == Frame::kInFlight))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    frame.state = Frame::kFree;
  }
  const std::scoped_lock lock(state_->mutex_);
  state_->taken_[static_cast<std::size_t>(ring.data() - state_->frames_.data()) / kFramesARing] = false;
}

std::shared_ptr<const SurfacePlace> Device::hold(const FeltSurface& surface) {
  {
    const std::scoped_lock lock(state_->mutex_);
    if (auto held = state_->held_[&surface].lock()) return held;
  }
  SurfacePlace place;
  bool has_room = false;
  if (!state_->ask([&] { has_room = state_->heights_->add(surface, place); }) || !has_room) return nullptr;
  std::shared_ptr<const SurfacePlace> held(new SurfacePlace(place), [this](const SurfacePlace* gone) {
    state_->heights_->release(*gone);
    delete gone;
  });
  const std::scoped_lock lock(state_->mutex_);
  state_->held_[&surface] = held;
  return held;
}

void Device::submit(Frame& frame) noexcept {
  frame.submitted_at = Clock::now();
  frame.state.store(Frame::kSubmitted, std::memory_order_release);
  state_->ring_bell();
}

bool Device::wait(Frame& frame) const noexcept {
  const auto done = [&frame] {
    const std::uint32_t state = frame.state.load(std::memory_order_acquire);
    return state == Frame::kDone || state == Frame::kFailed;
  };
  while (!done()) {
    const auto waited = Clock::now() - frame.submitted_at;
    if (waited > std::chrono::duration<double>(state_->options_.patience_s) || is_lost()) break;
    if (waited < kSpin && !state_->info_.is_software) {
      pause();
    } else if (waited < kYield) {
      std::this_thread::yield();
    } else {
      std::this_thread::sleep_for(kNap);
    }
  }
  if (!done() || frame.state != Frame::kDone) return false;
  const double whole_us = 1e6 * seconds_since(frame.submitted_at);
  frame.times.readback_us = whole_us - frame.times.upload_us - frame.times.dispatch_us;
  return true;
}

}  // namespace farfeel::penetration::egl
