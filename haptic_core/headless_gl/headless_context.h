// An OpenGL context without a window or display server, through EGL. Nothing of EGL or OpenGL is linked: libEGL is
// opened by name in create(), so that a program which never calls it has no GL library in its memory.
#pragma once

#include <memory>
#include <string>
#include <tl/expected.hpp>

namespace farfeel::headless_gl {

struct Failure {
  std::string message;  ///< what was tried, what was wrong, what to do
};

struct Wanted {
  int major = 3, minor = 3;  ///< of an OpenGL core profile
  std::string vendor{};      ///< take only a device whose GL_VENDOR or GL_RENDERER holds this, in any case; empty: any
  /// The driver may say that the context is lost instead of ending the process, where it can.
  bool is_robust = false;
};

/// Whether this machine shows a graphics device (/dev/dri/renderD*, /dev/nvidia*): asks the file system, loads nothing.
[[nodiscard]] bool has_graphics_device();

/// A core-profile context. One thread at a time has it current; gone with this object. The driver stays loaded:
/// libraries of drivers do not unload well, and other contexts of the process may share their display.
class HeadlessContext {
 public:
  /// Current on the calling thread. Tries the device platform first, real devices before software ones, then Mesa's
  /// surfaceless platform. Worker threads that a software driver starts inherit the caller's scheduling: call it from
  /// an ordinary thread.
  [[nodiscard]] static tl::expected<HeadlessContext, Failure> create(const Wanted&);
  HeadlessContext(HeadlessContext&&) noexcept;
  HeadlessContext& operator=(HeadlessContext&&) noexcept;
  ~HeadlessContext();

  /// Of an OpenGL function by its full name; null where the driver has none.
  using Function = void (*)();
  [[nodiscard]] Function function(const char* name) const;

  /// Without (false) or with (true) the context current on the calling thread; false when the driver refuses.
  bool make_current(bool is_current) const;

  [[nodiscard]] const std::string& platform() const;  ///< "EGL device 0", "EGL surfaceless"
  [[nodiscard]] const std::string& vendor() const;
  [[nodiscard]] const std::string& renderer() const;
  [[nodiscard]] const std::string& version() const;
  /// The driver draws with the processor: right, and slow.
  [[nodiscard]] bool is_software() const;

 private:
  struct State;
  explicit HeadlessContext(std::unique_ptr<State>);
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::headless_gl
