// A program started by this one, which never outlives it.
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

namespace farfeel::front {

struct FrontError {
  std::string message;  ///< what was tried, what was wrong, what to do
};

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool is_open() const { return number_ >= 0; }

 private:
  int number_;
};

/// The folder this program lies in, where its siblings are.
[[nodiscard]] std::string own_folder();
/// "farfeel-slave" beside this program; else an error that says how to get it.
[[nodiscard]] tl::expected<std::string, FrontError> sibling(const std::string& name);

/// In a process group of its own, so that Ctrl-C in the terminal reaches only the front, which ends its children in
/// order. If the front dies, however suddenly, the kernel sends each child SIGTERM.
class Child {
 public:
  enum class Output { kIsRead, kToLog };

  /// `log` takes standard error, and standard output too unless it is read by the front. With `has_ready`, the child
  /// gets
  /// --ready-fd N and is expected to write "ready PORT" there.
  [[nodiscard]] static tl::expected<Child, FrontError> start(const std::string& program,
                                                             std::vector<std::string> arguments, const std::string& log,
                                                             Output output, bool has_ready);
  Child(Child&&) noexcept;
  Child& operator=(Child&&) = delete;
  ~Child() { end(); }

  void end();  ///< SIGTERM, and SIGKILL if it is still there after a second

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] int ended_fd() const { return ended_.number(); }  ///< readable once the child has ended
  [[nodiscard]] int output_fd() const { return output_.number(); }

  /// Waits for "ready PORT"; an error when the child ends or `timeout_s` passes before that, or `stop_fd` is readable.
  /// `while_waiting`, if given, is called with the seconds waited so far, once a second.
  [[nodiscard]] tl::expected<int, FrontError> ready_port(double timeout_s, int stop_fd,
                                                         const std::function<void(int)>& while_waiting = {}) const;
  void signal(int number) const;
  /// The exit status as a shell counts it (128 + signal), once the child has ended; nothing while it runs.
  [[nodiscard]] std::optional<int> status();
  [[nodiscard]] const std::string& log() const { return log_; }  ///< where its words go
  /// "farfeel-slave was killed by signal 9 (Killed)", and the last lines of its log.
  [[nodiscard]] std::string obituary();

 private:
  Child() = default;
  std::string name_, log_;
  pid_t pid_ = -1;
  Descriptor ended_, output_, ready_;
  std::optional<int> wait_status_;
};

}  // namespace farfeel::front
