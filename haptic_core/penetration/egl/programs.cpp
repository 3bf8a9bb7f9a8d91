#include "haptic_core/penetration/egl/programs.h"

#include <fmt/format.h>

#include "haptic_core/penetration/egl/device.h"

namespace farfeel::penetration::egl {
namespace {

std::string log_of(const auto& get_size, const auto& get_text) {
  GLint size = 0;
  get_size(&size);
  std::string text(static_cast<std::size_t>(std::max(size, 1)), '\0');
  get_text(size, text.data());
  return text.substr(0, text.find('\0'));
}

std::string compile_one(const Gl& gl, std::uint32_t group, bool with_hessian, Program& program) {
  const std::string source = search_source(group, with_hessian);
  const char* text = source.c_str();
  const GLuint shader = gl.CreateShader(GL_COMPUTE_SHADER);
  gl.ShaderSource(shader, 1, &text, nullptr);
  gl.CompileShader(shader);
  GLint is_good = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &is_good);
  if (!is_good) {
    return fmt::format("the search does not compile: {}",
                       log_of([&](GLint* size) { gl.GetShaderiv(shader, GL_INFO_LOG_LENGTH, size); },
                              [&](GLint size, char* to) { gl.GetShaderInfoLog(shader, size, nullptr, to); }));
  }
  program.name = gl.CreateProgram();
  gl.AttachShader(program.name, shader);
  gl.LinkProgram(program.name);
  gl.DeleteShader(shader);
  gl.GetProgramiv(program.name, GL_LINK_STATUS, &is_good);
  if (!is_good) {
    return fmt::format("the search does not link: {}",
                       log_of([&](GLint* size) { gl.GetProgramiv(program.name, GL_INFO_LOG_LENGTH, size); },
                              [&](GLint size, char* to) { gl.GetProgramInfoLog(program.name, size, nullptr, to); }));
  }
  program.directory = gl.GetUniformLocation(program.name, "directory");
  return {};
}

}  // namespace

std::string Programs::compile(const Gl& gl, std::uint32_t group) {
  const std::string failure = compile_one(gl, group, false, plain);
  return failure.empty() ? compile_one(gl, group, true, with_hessian) : failure;
}

std::string Buffers::create(const Gl& gl, std::uint32_t frames) {
  const auto words_bytes =
      static_cast<GLsizeiptr>(sizeof(Word4) * (kDirectoryWords + std::size_t{frames} * kWordsAFrame));
  const auto results_bytes = static_cast<GLsizeiptr>(std::size_t{4} * kResultWords * kMostContactsAFrame * frames);
  const auto workspace_bytes = GLsizeiptr{2 * 8} * kMostListedCells * kMostContactsADispatch;
  constexpr GLbitfield kWrites = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT,
                       kReads = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  gl.CreateBuffers(1, &staging);
  gl.NamedBufferStorage(staging, words_bytes, nullptr, kWrites);
  gl.CreateBuffers(1, &frame);
  gl.NamedBufferStorage(frame, words_bytes, nullptr, 0);
  gl.CreateBuffers(1, &results);
  gl.NamedBufferStorage(results, results_bytes, nullptr, kReads | GL_CLIENT_STORAGE_BIT);
  gl.CreateBuffers(1, &workspace);
  gl.NamedBufferStorage(workspace, workspace_bytes, nullptr, 0);
  words = static_cast<Word4*>(gl.MapNamedBufferRange(staging, 0, words_bytes, kWrites));
  results_at = static_cast<const std::uint32_t*>(gl.MapNamedBufferRange(results, 0, results_bytes, kReads));
  if (!words || !results_at || gl.GetError() != GL_NO_ERROR)
    return fmt::format("no room for {} MiB of buffers", (2 * words_bytes + results_bytes + workspace_bytes) >> 20);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kFrameBinding, frame);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kResultsBinding, results);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kWorkspaceBinding, workspace);
  return {};
}

}  // namespace farfeel::penetration::egl
