#include "transport/net/wait_set.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include "transport/net/arrival_clock.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

}  // namespace

tl::expected<WakeEvent, Error> WakeEvent::open() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0)
    return tl::unexpected(Error{ErrorKind::kSocket, std::string("cannot make an event to wake a thread: ") +
                                                        std::strerror(errno) +
                                                        ". Raise the limit of open files (ulimit -n)."});
  return WakeEvent(descriptor);
}

WakeEvent::WakeEvent(WakeEvent&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

WakeEvent& WakeEvent::operator=(WakeEvent&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

WakeEvent::~WakeEvent() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void WakeEvent::signal() const noexcept {
  const std::uint64_t one = 1;
  // It fails only where 2^64 signals already wait, and then the thread wakes anyway.
  [[maybe_unused]] const ssize_t written = ::write(descriptor_, &one, sizeof one);
}

void WakeEvent::clear() const noexcept {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t taken = ::read(descriptor_, &count, sizeof count);
}

void WaitSet::add(int socket_descriptor) noexcept {
  assert(size_ < kMost);
  if (socket_descriptor < 0 || size_ == kMost) return;
  events_[size_] = nullptr;
  polled_[size_++] = {socket_descriptor, POLLIN, 0};
}

void WaitSet::add(const WakeEvent& event) noexcept {
  const std::size_t at = size_;
  add(event.descriptor());
  if (size_ > at) events_[at] = &event;
}

bool WaitSet::wait_until(std::int64_t until_ns) noexcept {
  const std::int64_t left = until_ns - monotonic_ns();
  const timespec timeout{left > 0 ? left / kNsPerSecond : 0, left > 0 ? left % kNsPerSecond : 0};
  if (ppoll(polled_.data(), size_, &timeout, nullptr) <= 0) return false;
  for (std::size_t i = 0; i < size_; ++i)
    if (events_[i] != nullptr && polled_[i].revents != 0) events_[i]->clear();
  return true;
}

}  // namespace farfeel::transport
