// The process that takes force off a device whose owner died or hangs.
//
// It holds a duplicate of the device's descriptor, so what the owner claimed stays claimed, and it knows one message:
// zero force. It looks every kLook_ns whether the owner still beats. It allocates nothing, opens nothing, and outlives
// its owner by kAfter_ns.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/link/link_memory.h"

namespace farfeel::devices {

/// How long an owner may be silent: half of the 20 ms in which force is to be zero; an owner beats every millisecond,
/// and an ordinary kernel wakes it 4 ms late at most (measured under load, SCHED_FIFO).
inline constexpr std::int64_t kOwnerSilent_ns = 10'000'000;

/// Runs until the owner has ended. Sends zero force each time the owner falls silent, and counts it in the memory.
/// Returns what the process is to return.
[[nodiscard]] int keep(LinkMemory& memory, const ZeroForce& zero, pid_t owner) noexcept;

/// Sends it once. False: the device did not take it.
bool send(const ZeroForce& zero) noexcept;

/// A keeper as a process of its own: this program, started anew with the two descriptors. It is told to end, and waited
/// for, when this goes.
class Keeper {
 public:
  /// link_fd is of the memory.
  [[nodiscard]] static tl::expected<Keeper, std::string> start(int link_fd, const ZeroForce& zero);
  Keeper(Keeper&& other) noexcept : pid_(other.pid_) { other.pid_ = -1; }
  Keeper& operator=(Keeper&&) = delete;
  ~Keeper();

  [[nodiscard]] bool has_ended() noexcept;  ///< one system call; does not wait
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }

 private:
  explicit Keeper(pid_t pid) : pid_(pid) {}
  pid_t pid_ = -1;
};

/// In main: whether this process was started to be a keeper; then runs it and gives the exit status.
[[nodiscard]] std::optional<int> keep_if_asked(std::span<char* const> arguments);

}  // namespace farfeel::devices
