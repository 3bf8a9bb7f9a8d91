#include "haptic_core/penetration/historical/historical.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <thread>
#include <vector>

#include "haptic_core/penetration/egl/frame_writer.h"
#include "haptic_core/penetration/egl/height_store.h"
#include "haptic_core/penetration/historical/shaders.h"
#include "haptic_core/penetration/reference/reference.h"

namespace farfeel::penetration::historical {
namespace {

using egl::Word4;
using headless_gl::Failure;

constexpr std::uint32_t kEvaluations = 11, kMostVertices = 1u << 16, kMostWords = 1u << 15;
constexpr double kNowhere = -1e29;

// clang-format off
#define FARFEEL_RASTER_FUNCTIONS(F)                                                                                   \
  F(CreateVertexArrays) F(BindVertexArray) F(VertexArrayVertexBuffer) F(VertexArrayAttribFormat)                       \
  F(VertexArrayAttribIFormat) F(VertexArrayAttribBinding) F(EnableVertexArrayAttrib) F(CreateTextures)                 \
  F(TextureStorage2D) F(TextureParameteri) F(BindTextureUnit) F(DeleteTextures) F(CreateFramebuffers)                  \
  F(NamedFramebufferTexture) F(NamedFramebufferDrawBuffer) F(NamedFramebufferReadBuffer) F(BindFramebuffer)            \
  F(CheckNamedFramebufferStatus) F(ClearNamedFramebufferfv) F(Viewport) F(Enable) F(Disable) F(DepthFunc)              \
  F(DepthMask) F(DrawArrays) F(ReadPixels) F(ProgramUniform1i) F(ProgramUniform1f) F(ProgramUniform2f)                 \
  F(ProgramUniform4f) F(DeleteFramebuffers)
// clang-format on
struct RasterGl : egl::Gl {
#define FARFEEL_DECLARE(name) decltype(&gl##name) name = nullptr;
  FARFEEL_RASTER_FUNCTIONS(FARFEEL_DECLARE)
#undef FARFEEL_DECLARE

  const char* load(const headless_gl::HeadlessContext& context) {
    if (const char* missing = egl::Gl::load(context)) return missing;
#define FARFEEL_LOAD(name)                                               \
  name = reinterpret_cast<decltype(name)>(context.function("gl" #name)); \
  if (!name) return "gl" #name;
    FARFEEL_RASTER_FUNCTIONS(FARFEEL_LOAD)
#undef FARFEEL_LOAD
    return nullptr;
  }
};

struct Vertex {
  float u, v, z;  ///< place in the window, 0 to 1; height
  std::uint32_t tile, chart;
};

/// A texture and the framebuffer that draws into it.
struct Target {
  GLuint texture = 0, framebuffer = 0;
};

/// Heights that the depth buffer tells apart.
struct Range {
  double low = 1e30, high = -1e30;
  void take(double a, double b) { low = std::min(low, a), high = std::max(high, b); }
  [[nodiscard]] double size() const { return std::max(high - low, 1e-6); }
};

class Historical final : public BackEnd {
 public:
  Historical(const Limits& limits, const DifferenceSteps& steps)
      : steps_(steps), reference_(make_reference(limits)), s_(limits), t_(limits) {
    vertices_.reserve(kMostVertices);
    words_.reserve(kMostWords);
  }
  /// Empty, or why it can't.
  std::string open(const std::string& vendor);
  [[nodiscard]] Traits traits() const noexcept override { return {}; }
  void prepare(const FeltSurface&) override;
  void evaluate(std::span<const Query>, std::span<Penetration>) noexcept override;

 private:
  [[nodiscard]] std::string link(GLuint& program, const std::string& vertex, const std::string& fragment);
  [[nodiscard]] Target target(GLenum format, GLenum attachment, std::uint32_t width, std::uint32_t height);
  void resize(std::uint32_t n);
  [[nodiscard]] bool add(const FacingPatch&, const FeltSurface&, const egl::SurfacePlace&, const Window&,
                         std::uint32_t tile, Range&);
  void draw(const Target&, std::uint32_t first, std::uint32_t count, std::uint32_t tiles, const Range&, const Window&,
            bool is_outermost);
  [[nodiscard]] bool answer(const Query&, Penetration&);

  DifferenceSteps steps_;
  std::unique_ptr<BackEnd> reference_;
  FacingPatch s_, t_;
  std::optional<headless_gl::HeadlessContext> context_;
  std::thread::id bound_to_;
  RasterGl gl_;
  std::unique_ptr<egl::HeightStore> heights_;
  std::map<const FeltSurface*, egl::SurfacePlace> places_;
  GLuint patch_ = 0, overlap_ = 0, reduce_ = 0, vertex_buffer_ = 0, word_buffer_ = 0, vertex_array_ = 0;
  std::uint32_t n_ = 0;
  Target s_target_, t_target_;
  std::vector<Target> levels_;  // overlap, then its halvings down to one pixel a tile
  std::vector<Vertex> vertices_;
  std::vector<Word4> words_;
};

std::string Historical::link(GLuint& program, const std::string& vertex, const std::string& fragment) {
  program = gl_.CreateProgram();
  for (const auto& [kind, source] : {std::pair{GL_VERTEX_SHADER, &vertex}, {GL_FRAGMENT_SHADER, &fragment}}) {
    const GLuint shader = gl_.CreateShader(static_cast<GLenum>(kind));
    const char* text = source->c_str();
    gl_.ShaderSource(shader, 1, &text, nullptr);
    gl_.CompileShader(shader);
    GLint is_good = 0;
    gl_.GetShaderiv(shader, GL_COMPILE_STATUS, &is_good);
    std::array<char, 1000> log{};
    if (!is_good) gl_.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    if (!is_good) return fmt::format("a shader does not compile: {}", log.data());
    gl_.AttachShader(program, shader);
    gl_.DeleteShader(shader);
  }
  gl_.LinkProgram(program);
  GLint is_good = 0;
  gl_.GetProgramiv(program, GL_LINK_STATUS, &is_good);
  return is_good ? "" : "a program does not link";
}

Target Historical::target(GLenum format, GLenum attachment, std::uint32_t width, std::uint32_t height) {
  Target made;
  gl_.CreateTextures(GL_TEXTURE_2D, 1, &made.texture);
  gl_.TextureStorage2D(made.texture, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  gl_.TextureParameteri(made.texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl_.TextureParameteri(made.texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl_.CreateFramebuffers(1, &made.framebuffer);
  gl_.NamedFramebufferTexture(made.framebuffer, attachment, made.texture, 0);
  if (attachment == GL_DEPTH_ATTACHMENT) {
    gl_.NamedFramebufferDrawBuffer(made.framebuffer, GL_NONE);
    gl_.NamedFramebufferReadBuffer(made.framebuffer, GL_NONE);
  }
  return made;
}

void Historical::resize(std::uint32_t n) {
  if (n == n_) return;
  n_ = n;
  levels_.push_back(s_target_), levels_.push_back(t_target_);
  for (Target& old : levels_) {
    gl_.DeleteFramebuffers(1, &old.framebuffer);
    gl_.DeleteTextures(1, &old.texture);
  }
  levels_.clear();
  s_target_ = target(GL_DEPTH_COMPONENT16, GL_DEPTH_ATTACHMENT, n, n);
  t_target_ = target(GL_DEPTH_COMPONENT16, GL_DEPTH_ATTACHMENT, kEvaluations * n, n);
  for (std::uint32_t side = n;; side = (side + 1) / 2) {
    levels_.push_back(target(GL_RGBA32F, GL_COLOR_ATTACHMENT0, kEvaluations * side, side));
    if (side == 1) break;
  }
}

std::string Historical::open(const std::string& vendor) {
  auto context = headless_gl::HeadlessContext::create({.major = 4, .minor = 5, .vendor = vendor});
  if (!context) return context.error().message;
  context_.emplace(*std::move(context));
  if (const char* missing = gl_.load(*context_)) return fmt::format("{} lacks {}", context_->renderer(), missing);
  for (const std::string& failure : {link(patch_, kPatchVertexShader, egl::heights_source() + kPatchFragmentShader),
                                     link(overlap_, kWholeVertexShader, kOverlapFragmentShader),
                                     link(reduce_, kWholeVertexShader, kReduceFragmentShader)}) {
    if (!failure.empty()) return fmt::format("{}: {}", context_->renderer(), failure);
  }
  heights_ = std::make_unique<egl::HeightStore>(gl_);
  gl_.CreateBuffers(1, &vertex_buffer_);
  gl_.NamedBufferStorage(vertex_buffer_, sizeof(Vertex) * kMostVertices, nullptr, GL_DYNAMIC_STORAGE_BIT);
  gl_.CreateBuffers(1, &word_buffer_);
  gl_.NamedBufferStorage(word_buffer_, sizeof(Word4) * kMostWords, nullptr, GL_DYNAMIC_STORAGE_BIT);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, egl::kFrameBinding, word_buffer_);
  gl_.CreateVertexArrays(1, &vertex_array_);
  gl_.VertexArrayVertexBuffer(vertex_array_, 0, vertex_buffer_, 0, sizeof(Vertex));
  gl_.VertexArrayAttribFormat(vertex_array_, 0, 3, GL_FLOAT, GL_FALSE, 0);
  gl_.VertexArrayAttribIFormat(vertex_array_, 1, 2, GL_UNSIGNED_INT, 3 * sizeof(float));
  for (const GLuint attribute : {0u, 1u}) {
    gl_.VertexArrayAttribBinding(vertex_array_, attribute, 0);
    gl_.EnableVertexArrayAttrib(vertex_array_, attribute);
  }
  gl_.BindVertexArray(vertex_array_);
  for (const GLenum plane : {0u, 1u, 2u, 3u}) gl_.Enable(GL_CLIP_DISTANCE0 + plane);
  const auto uniform = [this](GLuint program, const char* name, int value) {
    gl_.ProgramUniform1i(program, gl_.GetUniformLocation(program, name), value);
  };
  uniform(overlap_, "s_depth", 0), uniform(overlap_, "t_depth", 1), uniform(reduce_, "larger", 0);
  resize(50);
  if (gl_.CheckNamedFramebufferStatus(s_target_.framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE ||
      gl_.CheckNamedFramebufferStatus(levels_[0].framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE ||
      gl_.GetError() != GL_NO_ERROR)
    return fmt::format("{} draws neither 16-bit depth nor floats", context_->renderer());
  context_->make_current(false);
  return {};
}

void Historical::prepare(const FeltSurface& surface) {
  if (places_.contains(&surface) || !context_->make_current(true)) return;
  egl::SurfacePlace place;
  if (heights_->add(surface, place)) places_.emplace(&surface, place);
  context_->make_current(false);
}

/// The patch's triangles, drawn into one tile.
bool Historical::add(const FacingPatch& patch, const FeltSurface& felt, const egl::SurfacePlace& place,
                     const Window& window, std::uint32_t tile, Range& range) {
  const glm::dvec2 size = window.high - window.low;
  std::uint32_t last_chart = geometry::kNoChart, record = 0xFFFF'FFFF;
  for (const Facet& facet : patch.facets()) {
    if (vertices_.size() + 3 > kMostVertices || words_.size() + egl::kChartWords > kMostWords) return false;
    if (facet.chart && facet.chart_index != last_chart) {
      record = static_cast<std::uint32_t>(words_.size());
      const auto words = egl::chart_words(facet, felt, place.charts[facet.chart_index],
                                          {facet.reach_up_m, facet.reach_down_m, facet.most_drift_m});
      words_.insert(words_.end(), words.begin(), words.end());
    }
    if (!facet.chart) record = 0xFFFF'FFFF;
    last_chart = facet.chart_index;
    for (const glm::dvec3& corner : facet.corners_C) {
      const glm::dvec2 at = (glm::dvec2{corner} - window.low) / size;
      vertices_.push_back(
          {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(corner.z), tile, record});
    }
    const glm::dvec2 low = glm::max(facet.low, window.low), high = glm::min(facet.high, window.high);
    for (const glm::dvec2& corner : {low, high, glm::dvec2{low.x, high.y}, glm::dvec2{high.x, low.y}}) {
      const double z = facet.plane.x + facet.plane.y * corner.x + facet.plane.z * corner.y;
      range.take(z + facet.reach_down_m, z + facet.reach_up_m);
    }
  }
  return true;
}

void Historical::draw(const Target& target, std::uint32_t first, std::uint32_t count, std::uint32_t tiles,
                      const Range& range, const Window& window, bool is_outermost) {
  const float far = is_outermost ? 0.0f : 1.0f;
  gl_.DepthMask(GL_TRUE);
  gl_.ClearNamedFramebufferfv(target.framebuffer, GL_DEPTH, 0, &far);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  gl_.Viewport(0, 0, static_cast<GLsizei>(tiles * n_), static_cast<GLsizei>(n_));
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(is_outermost ? GL_GREATER : GL_LESS);
  gl_.UseProgram(patch_);
  const auto at = [this](const char* name) { return gl_.GetUniformLocation(patch_, name); };
  const glm::dvec2 size = window.high - window.low;
  const auto narrow = [](double x) { return static_cast<float>(x); };
  gl_.ProgramUniform1f(patch_, at("tiles"), static_cast<float>(tiles));
  gl_.ProgramUniform4f(patch_, at("window"), narrow(window.low.x), narrow(window.low.y), narrow(size.x),
                       narrow(size.y));
  gl_.ProgramUniform2f(patch_, at("range"), narrow(range.low), narrow(1 / range.size()));
  gl_.DrawArrays(GL_TRIANGLES, static_cast<GLint>(first), static_cast<GLsizei>(count));
}

bool Historical::answer(const Query& query, Penetration& answer) {
  const auto s_place = places_.find(query.s.surface), t_place = places_.find(query.t.surface);
  if (s_place == places_.end() || t_place == places_.end()) return false;
  if (query.s.surface->changes() != 0 || query.t.surface->changes() != 0) return false;  // edits came after its time
  const glm::dvec2 size = query.window.high - query.window.low;
  if (!(size.x > 0 && size.y > 0)) return false;
  resize(std::clamp(query.samples, 1u, kMaxSamples));
  vertices_.clear(), words_.clear();
  Range s_range, t_range;
  s_.project(query.s, Side::kOutermost, query.window);
  if (!add(s_, *query.s.surface, s_place->second, query.window, 0, s_range)) return false;
  const auto s_vertices = static_cast<std::uint32_t>(vertices_.size());
  const std::array<Query, kEvaluations> queries = queries_around(query, steps_);
  for (std::uint32_t k = 0; k < kEvaluations; ++k) {
    t_.project(queries[k].t, Side::kInnermost, query.window);
    if (!add(t_, *query.t.surface, t_place->second, query.window, k, t_range)) return false;
  }
  answer = {};
  if (s_vertices == 0 || vertices_.size() == s_vertices) return true;
  gl_.NamedBufferSubData(vertex_buffer_, 0, static_cast<GLsizeiptr>(sizeof(Vertex) * vertices_.size()),
                         vertices_.data());
  if (!words_.empty())
    gl_.NamedBufferSubData(word_buffer_, 0, static_cast<GLsizeiptr>(sizeof(Word4) * words_.size()), words_.data());

  const auto t_vertices = static_cast<std::uint32_t>(vertices_.size()) - s_vertices;
  draw(s_target_, 0, s_vertices, 1, s_range, query.window, true);
  draw(t_target_, s_vertices, t_vertices, kEvaluations, t_range, query.window, false);

  gl_.Disable(GL_DEPTH_TEST);
  gl_.UseProgram(overlap_);
  const auto narrow = [](double x) { return static_cast<float>(x); };
  const auto at = [this](GLuint program, const char* name) { return gl_.GetUniformLocation(program, name); };
  gl_.ProgramUniform4f(overlap_, at(overlap_, "ranges"), narrow(s_range.low), narrow(s_range.size()),
                       narrow(t_range.low), narrow(t_range.size()));
  gl_.ProgramUniform1f(overlap_, at(overlap_, "deepest"), narrow(std::min(query.deepest_m, 1e6)));
  gl_.ProgramUniform1i(overlap_, at(overlap_, "n"), static_cast<GLint>(n_));
  gl_.BindTextureUnit(0, s_target_.texture);
  gl_.BindTextureUnit(1, t_target_.texture);
  std::uint32_t side = n_;
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    if (level > 0) {
      gl_.UseProgram(reduce_);
      gl_.ProgramUniform1i(reduce_, at(reduce_, "n_larger"), static_cast<GLint>(side));
      side = (side + 1) / 2;
      gl_.ProgramUniform1i(reduce_, at(reduce_, "n"), static_cast<GLint>(side));
      gl_.BindTextureUnit(0, levels_[level - 1].texture);
    }
    gl_.BindFramebuffer(GL_FRAMEBUFFER, levels_[level].framebuffer);
    gl_.Viewport(0, 0, static_cast<GLsizei>(kEvaluations * side), static_cast<GLsizei>(side));
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  }
  std::array<std::array<float, 4>, kEvaluations> pixels{};
  gl_.ReadPixels(0, 0, kEvaluations, 1, GL_RGBA, GL_FLOAT, pixels.data());
  if (gl_.GetError() != GL_NO_ERROR) return false;
  std::array<Penetration, kEvaluations> answers;
  for (std::size_t k = 0; k < kEvaluations; ++k) {
    const auto [depth, index, z, one] = pixels[k];
    if (static_cast<double>(depth) < kNowhere) continue;
    const auto pixel = static_cast<std::uint32_t>(index);
    const glm::dvec2 share = (glm::dvec2{pixel % n_, pixel / n_} + 0.5) / static_cast<double>(n_);
    answers[k].depth_m = static_cast<double>(depth);
    answers[k].p_CQ_C = {query.window.low + size * share, static_cast<double>(z)};
    answers[k].doubts = 0;
  }
  answer = gradient_from(answers, steps_);
  return true;
}

void Historical::evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept {
  const bool is_bound = bound_to_ == std::this_thread::get_id() || context_->make_current(true);
  if (is_bound) bound_to_ = std::this_thread::get_id();
  for (std::size_t i = 0; i < queries.size(); ++i) {
    Query raw = queries[i];
    raw.soft_width_m = 0;
    raw.refines = raw.wants_hessian = false;
    if (!is_bound || !answer(raw, answers[i])) answers[i] = eleven_evaluations(*reference_, raw, steps_);
  }
}

/// The reference's grid, eleven times: what is left of the method where nothing draws.
class Grids final : public BackEnd {
 public:
  explicit Grids(const Limits& limits) : reference_(make_reference(limits)) {}
  [[nodiscard]] Traits traits() const noexcept override { return {}; }
  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      Query raw = queries[i];
      raw.soft_width_m = 0;
      raw.refines = raw.wants_hessian = false;
      answers[i] = eleven_evaluations(*reference_, raw, {});
    }
  }

 private:
  std::unique_ptr<BackEnd> reference_;
};

}  // namespace

tl::expected<std::unique_ptr<BackEnd>, Failure> make_historical(const Limits& limits, const DifferenceSteps& steps,
                                                                const std::string& vendor) {
  auto made = std::make_unique<Historical>(limits, steps);
  if (const std::string failure = made->open(vendor); !failure.empty()) return tl::unexpected(Failure{failure});
  return made;
}

BackEndMaker historical_maker() {
  return [](const Limits& limits) -> std::unique_ptr<BackEnd> {
    if (auto made = make_historical(limits)) return *std::move(made);
    return std::make_unique<Grids>(limits);
  };
}

}  // namespace farfeel::penetration::historical
