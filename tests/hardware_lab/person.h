// Programs that an ordinary person starts: user lab of the guest, who is in the group plugdev and has no privilege.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "master_station/devices/link/link_memory.h"

namespace farfeel::hardware_lab {

class PersonsProgram {
 public:
  /// What it prints goes to the file `log`; its keyboard is a terminal of its own.
  PersonsProgram(const std::vector<std::string>& command, const std::string& log);
  ~PersonsProgram();  ///< SIGTERM, and SIGKILL where that does not help
  PersonsProgram(const PersonsProgram&) = delete;
  PersonsProgram& operator=(const PersonsProgram&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] bool is_running();
  /// What it printed so far.
  [[nodiscard]] std::string printed() const;
  /// The space bar, as a keyboard types it: at once, and after half a second again and again while it is held.
  void hold_key(bool is_held);
  /// Asks it to end, and waits.
  void end();

 private:
  pid_t pid_ = -1;
  int keyboard_ = -1;  // the terminal's other end
  std::string log_;
  std::jthread key_;
};

/// The child of `parent` that runs this program; nothing: there is none.
[[nodiscard]] std::optional<pid_t> child_running(pid_t parent, const std::string& program);

/// Not root, no capability, and none to be had.
[[nodiscard]] bool is_unprivileged(pid_t);

/// The memory that a running farfeel-device shares with its station, to be looked at from outside.
[[nodiscard]] std::optional<devices::MappedLink> link_of(pid_t device);

}  // namespace farfeel::hardware_lab
