#include "master_station/display/offscreen_gl.h"

#include <fmt/format.h>

namespace farfeel::master_station {

tl::expected<OffscreenContext, DisplayError> OffscreenContext::create() {
  auto headless = headless_gl::HeadlessContext::create({.major = 3, .minor = 3});
  if (!headless) return tl::unexpected(DisplayError{headless.error().message});
  OffscreenContext context(*std::move(headless));
#define FARFEEL_LOAD(name)                                                                                \
  context.gl_.name = reinterpret_cast<decltype(context.gl_.name)>(context.context_.function("gl" #name)); \
  if (!context.gl_.name) return tl::unexpected(DisplayError{fmt::format("{} lacks gl" #name, context.renderer())});
  FARFEEL_GL_FUNCTIONS(FARFEEL_LOAD)
#undef FARFEEL_LOAD
  return context;
}

std::string OffscreenContext::renderer() const {
  return fmt::format("{}, {}, OpenGL {}", context_.vendor(), context_.renderer(), context_.version());
}

}  // namespace farfeel::master_station
