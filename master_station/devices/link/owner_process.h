// The program farfeel-device, started by the station and sharing memory with it, and started again where it died.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/devices/link/link_memory.h"

namespace farfeel::devices {

/// Any one thread, not the haptic one.
class OwnerProcess {
 public:
  struct Options {
    std::string program;                 ///< empty: farfeel-device beside this program
    std::vector<std::string> arguments;  ///< after "serve": --device falcon ...
  };
  [[nodiscard]] static tl::expected<OwnerProcess, std::string> start(const Options&);
  OwnerProcess(OwnerProcess&&) noexcept = default;
  OwnerProcess& operator=(OwnerProcess&&) = delete;
  ~OwnerProcess();

  /// Every now and then: starts another where it died, kAgain_ns later at the soonest. Returns what happened, for a
  /// person; empty: nothing new.
  [[nodiscard]] std::string look(std::int64_t now_ns);

  [[nodiscard]] LinkMemory& memory() const noexcept { return link_->memory(); }
  /// What is opened, and what to do next.
  [[nodiscard]] OpenedDevice opened() const noexcept;
  [[nodiscard]] std::string advice() const;
  [[nodiscard]] Sample newest() const noexcept;
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }

  static constexpr std::int64_t kAgain_ns = 500'000'000;

 private:
  OwnerProcess(Options options, MappedLink link)
      : options_(std::move(options)), link_(std::make_unique<MappedLink>(std::move(link))) {}
  [[nodiscard]] tl::expected<void, std::string> spawn();

  Options options_;
  std::unique_ptr<MappedLink> link_;
  pid_t pid_ = -1;
  std::int64_t ended_ns_ = 0;
};

}  // namespace farfeel::devices
