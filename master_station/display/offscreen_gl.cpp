#include "master_station/display/offscreen_gl.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <array>
#include <vector>

namespace farfeel::master_station {

struct OffscreenContext::Egl {
  void* library = nullptr;
  decltype(&eglGetProcAddress) get = nullptr;
  decltype(&eglInitialize) initialize = nullptr;
  decltype(&eglTerminate) terminate = nullptr;
  decltype(&eglBindAPI) bind_api = nullptr;
  decltype(&eglChooseConfig) choose_config = nullptr;
  decltype(&eglCreateContext) create_context = nullptr;
  decltype(&eglDestroyContext) destroy_context = nullptr;
  decltype(&eglMakeCurrent) make_current = nullptr;
  decltype(&eglGetError) get_error = nullptr;
  PFNEGLGETPLATFORMDISPLAYEXTPROC get_platform_display = nullptr;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  GL gl;

  Egl() = default;
  Egl(const Egl&) = delete;
  Egl& operator=(const Egl&) = delete;
  ~Egl() {
    leave();
    if (library) dlclose(library);
  }

  // Ends what a successful or half-way try left.
  void leave() {
    if (display == EGL_NO_DISPLAY) return;
    make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context != EGL_NO_CONTEXT) destroy_context(display, context);
    terminate(display);
    display = EGL_NO_DISPLAY;
    context = EGL_NO_CONTEXT;
  }

  template <typename Function>
  bool load(Function& function, const char* name) {
    function = reinterpret_cast<Function>(dlsym(library, name));
    return function != nullptr;
  }

  // Empty when the display now has a current OpenGL 3.3 context, else what failed.
  std::string try_platform(EGLenum platform, void* device) {
    display = get_platform_display(platform, device, nullptr);
    if (display == EGL_NO_DISPLAY) return "no display";
    const auto failed = [this](const char* what) {
      const EGLint error = get_error();
      leave();
      return fmt::format("{} (0x{:x})", what, error);
    };
    EGLint major = 0, minor = 0;
    if (!initialize(display, &major, &minor)) {
      const EGLint error = get_error();
      display = EGL_NO_DISPLAY;  // never initialised: nothing to leave
      return fmt::format("does not initialise (0x{:x})", error);
    }
    if (!bind_api(EGL_OPENGL_API)) return failed("has no OpenGL");
    const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint found = 0;
    if (!choose_config(display, wanted.data(), &config, 1, &found) || found < 1) return failed("has no configuration");
    const std::array<EGLint, 7> version = {
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context = create_context(display, config, EGL_NO_CONTEXT, version.data());
    if (context == EGL_NO_CONTEXT) return failed("makes no OpenGL 3.3 core context");
    if (!make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return failed("has no surfaceless context");
    if (const char* missing = load_gl()) {
      leave();
      return fmt::format("lacks {}", missing);
    }
    return {};
  }

  // The name of the first function that is missing, or null.
  const char* load_gl() {
#define FARFEEL_LOAD(name)                                        \
  gl.name = reinterpret_cast<decltype(gl.name)>(get("gl" #name)); \
  if (!gl.name) return "gl" #name;
    FARFEEL_GL_FUNCTIONS(FARFEEL_LOAD)
#undef FARFEEL_LOAD
    return nullptr;
  }
};

OffscreenContext::OffscreenContext(std::unique_ptr<Egl> egl) : egl_(std::move(egl)) {}
OffscreenContext::OffscreenContext(OffscreenContext&&) noexcept = default;
OffscreenContext& OffscreenContext::operator=(OffscreenContext&&) noexcept = default;
OffscreenContext::~OffscreenContext() = default;

tl::expected<OffscreenContext, DisplayError> OffscreenContext::create() {
  constexpr const char* kInstall = "install libegl1, libegl-mesa0 and libgl1-mesa-dri (deploy/install-packages run)";
  auto egl = std::make_unique<Egl>();
  egl->library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
  if (!egl->library)
    return tl::unexpected(DisplayError{fmt::format("could not load libEGL.so.1 ({}); {}", dlerror(), kInstall)});
  if (!egl->load(egl->get, "eglGetProcAddress") || !egl->load(egl->initialize, "eglInitialize") ||
      !egl->load(egl->terminate, "eglTerminate") || !egl->load(egl->bind_api, "eglBindAPI") ||
      !egl->load(egl->choose_config, "eglChooseConfig") || !egl->load(egl->create_context, "eglCreateContext") ||
      !egl->load(egl->destroy_context, "eglDestroyContext") || !egl->load(egl->make_current, "eglMakeCurrent") ||
      !egl->load(egl->get_error, "eglGetError"))
    return tl::unexpected(DisplayError{fmt::format("libEGL.so.1 lacks a basic function; {}", kInstall)});
  const auto extension = [&egl](auto& function, const char* name) {
    function = reinterpret_cast<std::decay_t<decltype(function)>>(egl->get(name));
    return function != nullptr;
  };
  if (!extension(egl->get_platform_display, "eglGetPlatformDisplayEXT"))
    return tl::unexpected(DisplayError{fmt::format("EGL has no platforms (eglGetPlatformDisplayEXT); {}", kInstall)});

  std::string tries;
  PFNEGLQUERYDEVICESEXTPROC query_devices = nullptr;
  if (extension(query_devices, "eglQueryDevicesEXT")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (!query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count)) count = 0;
    for (EGLint i = 0; i < count; ++i) {
      const std::string failure = egl->try_platform(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)]);
      if (failure.empty()) return OffscreenContext(std::move(egl));
      tries += fmt::format("device {} {}; ", i, failure);
    }
  }
  const std::string failure = egl->try_platform(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
  if (failure.empty()) return OffscreenContext(std::move(egl));
  return tl::unexpected(DisplayError{
      fmt::format("no OpenGL 3.3 through EGL: {}the surfaceless platform {}; {}", tries, failure, kInstall)});
}

const GL& OffscreenContext::gl() const {
  return egl_->gl;
}

std::string OffscreenContext::renderer() const {
  const auto text = [this](GLenum name) {
    const GLubyte* value = gl().GetString(name);
    return value ? std::string(reinterpret_cast<const char*>(value)) : std::string("unknown");
  };
  return fmt::format("{}, {}, OpenGL {}", text(GL_VENDOR), text(GL_RENDERER), text(GL_VERSION));
}

}  // namespace farfeel::master_station
