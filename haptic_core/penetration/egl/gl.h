// The functions of OpenGL 4.5 core that depths are computed with, fetched by these very names; none is linked.
#pragma once

#define GL_GLEXT_PROTOTYPES 1  // for the functions' types
#include <GL/glcorearb.h>

#include "haptic_core/headless_gl/headless_context.h"

namespace farfeel::penetration::egl {

// clang-format off
#define FARFEEL_GL45_FUNCTIONS(F)                                                                                      \
  F(GetError) F(GetIntegerv) F(GetInteger64v) F(GetGraphicsResetStatus) F(Flush) F(Finish)                             \
  F(CreateBuffers) F(DeleteBuffers) F(NamedBufferStorage) F(NamedBufferSubData) F(CopyNamedBufferSubData)              \
  F(MapNamedBufferRange) F(BindBufferBase) F(MemoryBarrier) F(DispatchCompute)                                         \
  F(CreateShader) F(ShaderSource) F(CompileShader) F(GetShaderiv) F(GetShaderInfoLog) F(DeleteShader)                  \
  F(CreateProgram) F(AttachShader) F(LinkProgram) F(GetProgramiv) F(GetProgramInfoLog) F(DeleteProgram) F(UseProgram)  \
  F(GetUniformLocation) F(ProgramUniform1ui)                                                                           \
  F(FenceSync) F(ClientWaitSync) F(DeleteSync) F(CreateQueries) F(DeleteQueries) F(QueryCounter) F(GetQueryObjectui64v)
// clang-format on

/// OpenGL's functions with the prefix left off: gl.DispatchCompute.
struct Gl {
#define FARFEEL_DECLARE(name) decltype(&gl##name) name = nullptr;
  FARFEEL_GL45_FUNCTIONS(FARFEEL_DECLARE)
#undef FARFEEL_DECLARE

  /// The name of the first function that the driver lacks, or null.
  const char* load(const headless_gl::HeadlessContext& context) {
#define FARFEEL_LOAD(name)                                               \
  name = reinterpret_cast<decltype(name)>(context.function("gl" #name)); \
  if (!name) return "gl" #name;
    FARFEEL_GL45_FUNCTIONS(FARFEEL_LOAD)
#undef FARFEEL_LOAD
    return nullptr;
  }
};

}  // namespace farfeel::penetration::egl
