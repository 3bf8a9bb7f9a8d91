// An OpenGL context without a window, loaded at run time.
#pragma once

#define GL_GLEXT_PROTOTYPES 1  // for the functions' types; none is linked
#include <GL/glcorearb.h>

#include <string>
#include <tl/expected.hpp>

#include "haptic_core/headless_gl/headless_context.h"
#include "master_station/display/picture.h"

namespace farfeel::master_station {

// The functions of OpenGL 3.3 that a picture needs, fetched through EGL by these very names.
// clang-format off
#define FARFEEL_GL_FUNCTIONS(F)                                                                                       \
  F(GetString) F(GetError) F(GetIntegerv) F(Enable) F(Disable) F(Viewport) F(Clear) F(ClearColor) F(ColorMask)        \
  F(DepthFunc) F(DepthMask) F(BlendFunc) F(PolygonOffset) F(ReadPixels) F(PixelStorei) F(DrawArrays) F(GenBuffers)    \
  F(BindBuffer) F(BufferData) F(DeleteBuffers) F(GenVertexArrays) F(BindVertexArray) F(DeleteVertexArrays)            \
  F(EnableVertexAttribArray) F(VertexAttribPointer) F(CreateShader) F(ShaderSource) F(CompileShader) F(AttachShader)  \
  F(DeleteShader) F(CreateProgram) F(LinkProgram) F(GetProgramiv) F(GetProgramInfoLog) F(UseProgram)                  \
  F(GetUniformLocation) F(Uniform1f) F(Uniform2fv) F(Uniform3fv) F(UniformMatrix4fv) F(GenTextures) F(BindTexture)                  \
  F(ActiveTexture) F(TexImage2D) F(TexParameteri) F(GenFramebuffers) F(BindFramebuffer) F(FramebufferTexture2D)       \
  F(FramebufferRenderbuffer) F(CheckFramebufferStatus) F(DrawBuffer) F(ReadBuffer)                 \
  F(GenRenderbuffers) F(BindRenderbuffer) F(RenderbufferStorage)
// clang-format on

/// OpenGL's functions with the prefix left off: gl.DrawArrays.
struct GL {
#define FARFEEL_DECLARE(name) decltype(&gl##name) name = nullptr;
  FARFEEL_GL_FUNCTIONS(FARFEEL_DECLARE)
#undef FARFEEL_DECLARE
};

/// A current OpenGL 3.3 core context with the functions above, bound to the thread that made it, gone with this object.
class OffscreenContext {
 public:
  [[nodiscard]] static tl::expected<OffscreenContext, DisplayError> create();

  [[nodiscard]] const GL& gl() const { return gl_; }
  [[nodiscard]] std::string renderer() const;

 private:
  explicit OffscreenContext(headless_gl::HeadlessContext context) : context_(std::move(context)) {}
  headless_gl::HeadlessContext context_;
  GL gl_;
};

}  // namespace farfeel::master_station
