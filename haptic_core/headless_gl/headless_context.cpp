#include "haptic_core/headless_gl/headless_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <vector>

namespace farfeel::headless_gl {
namespace {

constexpr const char* kInstall =
    "install the graphics card's driver, or libegl1, libegl-mesa0 and libgl1-mesa-dri for OpenGL in software "
    "(deploy/install-packages run)";

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool holds(const std::string& text, std::string_view part) {
  return in_lower_case(text).find(in_lower_case(std::string(part))) != std::string::npos;
}

bool holds_entry(const std::filesystem::path& folder, std::string_view beginning) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename();
    if (name.starts_with(beginning) && std::isdigit(static_cast<unsigned char>(name[beginning.size()])) != 0)
      return true;
  }
  return false;
}

/// EGL's functions, from the one library that a process has of it.
struct Egl {
  decltype(&eglGetProcAddress) get = nullptr;
  decltype(&eglInitialize) initialize = nullptr;
  decltype(&eglBindAPI) bind_api = nullptr;
  decltype(&eglChooseConfig) choose_config = nullptr;
  decltype(&eglCreateContext) create_context = nullptr;
  decltype(&eglDestroyContext) destroy_context = nullptr;
  decltype(&eglMakeCurrent) make_current = nullptr;
  decltype(&eglGetError) get_error = nullptr;
  PFNEGLGETPLATFORMDISPLAYEXTPROC get_platform_display = nullptr;
  PFNEGLQUERYDEVICESEXTPROC query_devices = nullptr;             // may stay null
  PFNEGLQUERYDEVICESTRINGEXTPROC query_device_string = nullptr;  // may stay null

  /// Empty, or what is missing.
  std::string load() {
    void* library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library) return fmt::format("could not load libEGL.so.1 ({})", dlerror());
    const auto basic = [library](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
      return function != nullptr;
    };
    if (!basic(get, "eglGetProcAddress") || !basic(initialize, "eglInitialize") || !basic(bind_api, "eglBindAPI") ||
        !basic(choose_config, "eglChooseConfig") || !basic(create_context, "eglCreateContext") ||
        !basic(destroy_context, "eglDestroyContext") || !basic(make_current, "eglMakeCurrent") ||
        !basic(get_error, "eglGetError"))
      return "libEGL.so.1 lacks a basic function";
    const auto extension = [this](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(get(name));
      return function != nullptr;
    };
    if (!extension(get_platform_display, "eglGetPlatformDisplayEXT"))
      return "EGL has no platforms (eglGetPlatformDisplayEXT)";
    extension(query_devices, "eglQueryDevicesEXT");
    extension(query_device_string, "eglQueryDeviceStringEXT");
    return {};
  }

  struct Device {
    EGLDeviceEXT handle;
    std::string name;
    int rank;  ///< lower is tried first
  };
  /// Real devices first, and of those the ones whose drivers compute beside drawing.
  [[nodiscard]] std::vector<Device> devices() const {
    std::array<EGLDeviceEXT, 16> handles{};
    EGLint count = 0;
    if (!query_devices || !query_devices(static_cast<EGLint>(handles.size()), handles.data(), &count)) return {};
    std::vector<Device> found;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const char* text = query_device_string ? query_device_string(handles[i], EGL_EXTENSIONS) : nullptr;
      const std::string extensions = text ? text : "";
      const int rank = holds(extensions, "software") ? 2 : holds(extensions, "cuda") ? 0 : 1;
      found.push_back({handles[i], fmt::format("EGL device {}", i), rank});
    }
    std::stable_sort(found.begin(), found.end(), [](const Device& a, const Device& b) { return a.rank < b.rank; });
    return found;
  }
};

}  // namespace

bool has_graphics_device() {
  return holds_entry("/dev/dri", "renderD") || holds_entry("/dev", "nvidia");
}

struct HeadlessContext::State {
  Egl egl;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  std::string platform, vendor, renderer, version;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { leave(); }

  void leave() {
    if (context != EGL_NO_CONTEXT) {
      egl.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      egl.destroy_context(display, context);
    }
    context = EGL_NO_CONTEXT;
    display = EGL_NO_DISPLAY;
  }

  [[nodiscard]] EGLContext new_context(EGLConfig config, const Wanted& wanted, bool is_robust) const {
    std::vector<EGLint> attributes = {EGL_CONTEXT_MAJOR_VERSION,       wanted.major,
                                      EGL_CONTEXT_MINOR_VERSION,       wanted.minor,
                                      EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
    if (is_robust) {
      attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET});
    }
    attributes.push_back(EGL_NONE);
    return egl.create_context(display, config, EGL_NO_CONTEXT, attributes.data());
  }

  /// Empty when the display now has a current context as wanted, else what failed.
  std::string try_platform(EGLenum which, void* device, const std::string& name, const Wanted& wanted) {
    display = egl.get_platform_display(which, device, nullptr);
    if (display == EGL_NO_DISPLAY) return "has no display";
    const auto failed = [this](const char* what) {
      const EGLint error = egl.get_error();
      leave();
      return fmt::format("{} (0x{:x})", what, error);
    };
    EGLint major = 0, minor = 0;
    if (!egl.initialize(display, &major, &minor)) return failed("does not initialise");
    if (!egl.bind_api(EGL_OPENGL_API)) return failed("has no OpenGL");
    const std::array<EGLint, 5> config_wanted = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint found = 0;
    if (!egl.choose_config(display, config_wanted.data(), &config, 1, &found) || found < 1)
      return failed("has no configuration");
    if (wanted.is_robust) context = new_context(config, wanted, true);
    if (context == EGL_NO_CONTEXT) context = new_context(config, wanted, false);
    if (context == EGL_NO_CONTEXT) {
      return failed(fmt::format("makes no OpenGL {}.{} core context", wanted.major, wanted.minor).c_str());
    }
    if (!egl.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context))
      return failed("has no context without a surface");
    const auto get_string = reinterpret_cast<PFNGLGETSTRINGPROC>(egl.get("glGetString"));
    const auto text = [get_string](GLenum what) {
      const GLubyte* value = get_string ? get_string(what) : nullptr;
      return value ? std::string(reinterpret_cast<const char*>(value)) : std::string("unknown");
    };
    vendor = text(GL_VENDOR), renderer = text(GL_RENDERER), version = text(GL_VERSION);
    if (!wanted.vendor.empty() && !holds(vendor, wanted.vendor) && !holds(renderer, wanted.vendor)) {
      leave();
      return fmt::format("is {} {}, and {} was asked for", vendor, renderer, wanted.vendor);
    }
    platform = name;
    return {};
  }
};

HeadlessContext::HeadlessContext(std::unique_ptr<State> state) : state_(std::move(state)) {}
HeadlessContext::HeadlessContext(HeadlessContext&&) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&&) noexcept = default;
HeadlessContext::~HeadlessContext() = default;

tl::expected<HeadlessContext, Failure> HeadlessContext::create(const Wanted& wanted) {
  auto state = std::make_unique<State>();
  if (const std::string missing = state->egl.load(); !missing.empty())
    return tl::unexpected(Failure{fmt::format("{}; {}", missing, kInstall)});
  std::string tries;
  for (const Egl::Device& device : state->egl.devices()) {
    const std::string failure = state->try_platform(EGL_PLATFORM_DEVICE_EXT, device.handle, device.name, wanted);
    if (failure.empty()) return HeadlessContext(std::move(state));
    tries += fmt::format("{} {}; ", device.name, failure);
  }
  const std::string failure =
      state->try_platform(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, "EGL surfaceless", wanted);
  if (failure.empty()) return HeadlessContext(std::move(state));
  return tl::unexpected(Failure{fmt::format("no OpenGL {}.{} through EGL: {}the surfaceless platform {}; {}",
                                            wanted.major, wanted.minor, tries, failure, kInstall)});
}

HeadlessContext::Function HeadlessContext::function(const char* name) const {
  return state_->egl.get(name);
}

bool HeadlessContext::make_current(bool is_current) const {
  return state_->egl.make_current(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE,
                                  is_current ? state_->context : EGL_NO_CONTEXT) == EGL_TRUE;
}

const std::string& HeadlessContext::platform() const {
  return state_->platform;
}
const std::string& HeadlessContext::vendor() const {
  return state_->vendor;
}
const std::string& HeadlessContext::renderer() const {
  return state_->renderer;
}
const std::string& HeadlessContext::version() const {
  return state_->version;
}

bool HeadlessContext::is_software() const {
  return holds(state_->renderer, "llvmpipe") || holds(state_->renderer, "softpipe") ||
         holds(state_->renderer, "swrast") || holds(state_->renderer, "swiftshader");
}

}  // namespace farfeel::headless_gl
