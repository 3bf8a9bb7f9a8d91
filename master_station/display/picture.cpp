#include "master_station/display/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "master_station/display/offscreen_gl.h"
#include "master_station/display/shaders.h"
#include "master_station/display/solid.h"

namespace farfeel::master_station {
namespace {

constexpr int kShadowSize = 2048;
constexpr float kShadowSoftness = 8.0F / kShadowSize;  // of the shadow map, beyond what the ground's shader looks at
constexpr int kLargestPicture = 8192;
const glm::vec3 kTowardsLight = glm::normalize(glm::vec3(-0.45F, -0.55F, 1.0F));
const glm::vec3 kArrowColour_sRGB(0.86F, 0.16F, 0.22F);
const glm::vec3 kPointColour_sRGB(1.0F, 0.80F, 0.25F);
constexpr double kLongestArrow = 0.2;    // of the picture's height
constexpr double kArrowRadius = 0.0055;  // of the picture's height

glm::vec3 linear(const glm::vec3& sRGB) {
  return glm::pow(sRGB, glm::vec3(2.2F));
}

tl::unexpected<DisplayError> failure(std::string message) {
  return tl::unexpected(DisplayError{std::move(message)});
}

// A solid on the graphics side.
struct Loaded {
  GLuint vertices = 0, buffer = 0;
  GLsizei corners = 0;
  glm::vec3 colour{0};
};

// Everything a picture needs on the graphics side; what it made is freed with the context.
class Painter {
 public:
  explicit Painter(const GL& gl) : gl_(gl) {}

  [[nodiscard]] tl::expected<void, DisplayError> prepare() {
    for (const auto& [program, vertex, fragment] : {std::tuple(&body_, kBodyVertexShader, kBodyFragmentShader),
                                                    std::tuple(&depth_, kBodyVertexShader, kDepthFragmentShader),
                                                    std::tuple(&ground_, kGroundVertexShader, kGroundFragmentShader),
                                                    std::tuple(&smooth_, kSmoothVertexShader, kSmoothFragmentShader)}) {
      auto linked = link(vertex, fragment);
      if (!linked) return tl::unexpected(linked.error());
      *program = *linked;
    }
    gl_.GenVertexArrays(1, &nothing_);
    return make_shadow_map();
  }

  [[nodiscard]] Loaded load(const Solid& solid, const glm::vec3& colour_sRGB) {
    Loaded loaded;
    loaded.corners = static_cast<GLsizei>(solid.size());
    loaded.colour = linear(colour_sRGB);
    gl_.GenVertexArrays(1, &loaded.vertices);
    gl_.BindVertexArray(loaded.vertices);
    gl_.GenBuffers(1, &loaded.buffer);
    gl_.BindBuffer(GL_ARRAY_BUFFER, loaded.buffer);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(solid.size() * sizeof(Corner)), solid.data(),
                   GL_STATIC_DRAW);
    gl_.EnableVertexAttribArray(0);
    gl_.EnableVertexAttribArray(1);
    gl_.EnableVertexAttribArray(2);
    gl_.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), nullptr);
    gl_.VertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), reinterpret_cast<void*>(sizeof(glm::vec3)));
    gl_.VertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(Corner),
                            reinterpret_cast<void*>(offsetof(Corner, tint_sRGB)));
    return loaded;
  }

  void unload(Loaded& loaded) {
    gl_.DeleteVertexArrays(1, &loaded.vertices);
    gl_.DeleteBuffers(1, &loaded.buffer);
  }

  // The depth seen from the light, over a ball about the origin.
  void cast_shadows(const std::vector<Loaded>& bodies, const glm::vec3& half_size) {
    const float radius_m = glm::length(half_size);
    const float reach = 1.35F * radius_m;
    const glm::mat4 view = glm::lookAt(4.0F * radius_m * kTowardsLight, glm::vec3(0), glm::vec3(0, 1, 0));
    light_from_world_ = glm::ortho(-reach, reach, -reach, reach, radius_m, 7.0F * radius_m) * view;
    shade_low_ = glm::vec2(1);
    shade_high_ = glm::vec2(0);
    for (int i = 0; i < 8; ++i) {
      const glm::vec3 corner((i & 1) ? half_size.x : -half_size.x, (i & 2) ? half_size.y : -half_size.y,
                             (i & 4) ? half_size.z : -half_size.z);
      const glm::vec2 at = 0.5F * glm::vec2(light_from_world_ * glm::vec4(corner, 1)) + 0.5F;
      shade_low_ = glm::min(shade_low_, at - kShadowSoftness);
      shade_high_ = glm::max(shade_high_, at + kShadowSoftness);
    }
    shadow_texel_m_ = 2 * reach / kShadowSize;
    gl_.BindFramebuffer(GL_FRAMEBUFFER, shadow_framebuffer_);
    gl_.Viewport(0, 0, kShadowSize, kShadowSize);
    gl_.Enable(GL_DEPTH_TEST);
    gl_.Clear(GL_DEPTH_BUFFER_BIT);
    gl_.UseProgram(depth_);
    set(depth_, "clip_from_world", light_from_world_);
    gl_.Enable(GL_POLYGON_OFFSET_FILL);
    gl_.PolygonOffset(1.5F, 4.0F);
    for (const Loaded& body : bodies) draw(body);
    gl_.Disable(GL_POLYGON_OFFSET_FILL);
  }

  struct View {
    glm::mat4 clip_from_world;
    glm::vec3 eye;
    float ground_z, cell_m, radius_m;
  };

  // Into the framebuffer that is bound.
  void paint(const View& view, const std::vector<Loaded>& bodies, const std::vector<Loaded>& marks) {
    gl_.Enable(GL_FRAMEBUFFER_SRGB);
    gl_.ClearColor(0.8F, 0.83F, 0.87F, 1);
    gl_.DepthMask(GL_TRUE);
    gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl_.ActiveTexture(GL_TEXTURE0);
    gl_.BindTexture(GL_TEXTURE_2D, shadow_map_);

    // Depth first: a full-resolution mesh has several triangles a pixel, and only what is seen should be shaded.
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthFunc(GL_LEQUAL);
    gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl_.UseProgram(depth_);
    set(depth_, "clip_from_world", view.clip_from_world);
    for (const Loaded& body : bodies) draw(body);
    gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);

    gl_.UseProgram(ground_);
    set(ground_, "world_from_clip", glm::inverse(view.clip_from_world));
    set(ground_, "light_from_world", light_from_world_);
    set(ground_, "shade_low", shade_low_);
    set(ground_, "shade_high", shade_high_);
    set(ground_, "ground_z", view.ground_z);
    set(ground_, "cell", view.cell_m);
    set(ground_, "radius", view.radius_m);
    gl_.BindVertexArray(nothing_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);

    gl_.UseProgram(body_);
    set(body_, "clip_from_world", view.clip_from_world);
    set(body_, "light_from_world", light_from_world_);
    set(body_, "eye", view.eye);
    set(body_, "towards_light", kTowardsLight);
    set(body_, "lifted", 2.5F * shadow_texel_m_);
    shade(1.0F, 0.22F);
    draw_coloured(bodies);

    // What the bodies hide of the marks shines through, under what is in plain sight.
    gl_.Enable(GL_BLEND);
    gl_.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    gl_.DepthFunc(GL_GREATER);
    gl_.DepthMask(GL_FALSE);
    shade(0.42F, 0.0F);
    draw_coloured(marks);
    gl_.Disable(GL_BLEND);
    gl_.DepthFunc(GL_LESS);
    gl_.DepthMask(GL_TRUE);
    shade(1.0F, 0.3F);
    draw_coloured(marks);
  }

  // A drawn picture into the framebuffer that is bound.
  void smooth_edges(GLuint picture) {
    gl_.Disable(GL_DEPTH_TEST);
    gl_.BindTexture(GL_TEXTURE_2D, picture);
    gl_.UseProgram(smooth_);
    gl_.BindVertexArray(nothing_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  }

 private:
  void draw_coloured(const std::vector<Loaded>& shapes) {
    for (const Loaded& shape : shapes) {
      set(body_, "colour", shape.colour);
      draw(shape);
    }
  }
  void draw(const Loaded& loaded) {
    gl_.BindVertexArray(loaded.vertices);
    gl_.DrawArrays(GL_TRIANGLES, 0, loaded.corners);
  }
  void shade(float opacity, float gloss) {
    set(body_, "opacity", opacity);
    set(body_, "gloss", gloss);
  }

  void set(GLuint program, const char* name, float value) {
    gl_.Uniform1f(gl_.GetUniformLocation(program, name), value);
  }
  void set(GLuint program, const char* name, const glm::vec2& value) {
    gl_.Uniform2fv(gl_.GetUniformLocation(program, name), 1, glm::value_ptr(value));
  }
  void set(GLuint program, const char* name, const glm::vec3& value) {
    gl_.Uniform3fv(gl_.GetUniformLocation(program, name), 1, glm::value_ptr(value));
  }
  void set(GLuint program, const char* name, const glm::mat4& value) {
    gl_.UniformMatrix4fv(gl_.GetUniformLocation(program, name), 1, GL_FALSE, glm::value_ptr(value));
  }

  [[nodiscard]] tl::expected<GLuint, DisplayError> link(const char* vertex, const char* fragment) {
    const GLuint program = gl_.CreateProgram();
    for (const auto& [kind, source] : {std::pair(GL_VERTEX_SHADER, vertex), std::pair(GL_FRAGMENT_SHADER, fragment)}) {
      const GLuint shader = gl_.CreateShader(static_cast<GLenum>(kind));
      gl_.ShaderSource(shader, 1, &source, nullptr);
      gl_.CompileShader(shader);
      gl_.AttachShader(program, shader);
      gl_.DeleteShader(shader);
    }
    gl_.LinkProgram(program);
    GLint is_linked = 0;
    gl_.GetProgramiv(program, GL_LINK_STATUS, &is_linked);
    if (is_linked != 0) return program;
    std::string log(2000, '\0');
    GLsizei length = 0;
    gl_.GetProgramInfoLog(program, static_cast<GLsizei>(log.size()), &length, log.data());
    return failure(
        fmt::format("the picture's shaders do not link: {}", log.substr(0, static_cast<std::size_t>(length))));
  }

  [[nodiscard]] tl::expected<void, DisplayError> make_shadow_map() {
    gl_.GenTextures(1, &shadow_map_);
    gl_.BindTexture(GL_TEXTURE_2D, shadow_map_);
    gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT16, kShadowSize, kShadowSize, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                   nullptr);
    for (const auto& [parameter, value] :
         {std::pair(GL_TEXTURE_MIN_FILTER, GL_LINEAR), std::pair(GL_TEXTURE_MAG_FILTER, GL_LINEAR),
          std::pair(GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE), std::pair(GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE),
          std::pair(GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE), std::pair(GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL)})
      gl_.TexParameteri(GL_TEXTURE_2D, static_cast<GLenum>(parameter), value);
    gl_.GenFramebuffers(1, &shadow_framebuffer_);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, shadow_framebuffer_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadow_map_, 0);
    gl_.DrawBuffer(GL_NONE);
    gl_.ReadBuffer(GL_NONE);
    if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      return failure("OpenGL refuses a framebuffer for shadows");
    return {};
  }

  const GL& gl_;
  GLuint body_ = 0, depth_ = 0, ground_ = 0, smooth_ = 0, nothing_ = 0, shadow_map_ = 0, shadow_framebuffer_ = 0;
  glm::mat4 light_from_world_{1};
  glm::vec2 shade_low_{0}, shade_high_{1};  // where the bodies are on the shadow map
  float shadow_texel_m_ = 0;
};

// A framebuffer to draw into, and one to read from: the same with its edges smoothed.
struct Canvas {
  GLuint drawn = 0, picture = 0, read = 0;

  [[nodiscard]] static tl::expected<Canvas, DisplayError> make(const GL& gl, int width, int height) {
    Canvas canvas;
    const auto framebuffer = [&](GLuint& name, GLuint& texture) {
      gl.GenTextures(1, &texture);
      gl.BindTexture(GL_TEXTURE_2D, texture);
      gl.TexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
      for (const auto& [parameter, value] :
           {std::pair(GL_TEXTURE_MIN_FILTER, GL_LINEAR), std::pair(GL_TEXTURE_MAG_FILTER, GL_LINEAR),
            std::pair(GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE), std::pair(GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE)})
        gl.TexParameteri(GL_TEXTURE_2D, static_cast<GLenum>(parameter), value);
      gl.GenFramebuffers(1, &name);
      gl.BindFramebuffer(GL_FRAMEBUFFER, name);
      gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    };
    GLuint smoothed = 0, depth = 0;
    framebuffer(canvas.read, smoothed);
    const bool can_be_read = gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    framebuffer(canvas.drawn, canvas.picture);
    gl.GenRenderbuffers(1, &depth);
    gl.BindRenderbuffer(GL_RENDERBUFFER, depth);
    gl.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    if (!can_be_read || gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      return failure(fmt::format("OpenGL refuses a framebuffer of {} x {} pixels", width, height));
    return canvas;
  }

  [[nodiscard]] Image taken(const GL& gl, int width, int height) const {
    gl.BindFramebuffer(GL_FRAMEBUFFER, read);
    const auto row = static_cast<std::size_t>(width) * 4;
    Image image{width, height, std::vector<std::uint8_t>(row * static_cast<std::size_t>(height))};
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
    for (int y = 0; y < height / 2; ++y)  // OpenGL's rows begin at the bottom
      std::swap_ranges(image.rgba.begin() + static_cast<std::ptrdiff_t>(row) * y,
                       image.rgba.begin() + static_cast<std::ptrdiff_t>(row) * (y + 1),
                       image.rgba.begin() + static_cast<std::ptrdiff_t>(row) * (height - 1 - y));
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    return image;
  }
};

}  // namespace

geometry::Box box_around(const Still& still) {
  geometry::Box box_W;
  for (const Body& body : still.bodies)
    for (const glm::dvec3& p_O : body.mesh_O->positions_O) box_W.include(transform_point(body.X_WO, p_O));
  return box_W;
}

tl::expected<std::vector<Image>, DisplayError> draw(const Still& still, const std::vector<Camera>& cameras, int width,
                                                    int height) {
  if (width < 1 || height < 1 || width > kLargestPicture || height > kLargestPicture)
    return failure(fmt::format("a picture of {} x {} pixels is outside 1 to {}", width, height, kLargestPicture));
  auto context = OffscreenContext::create();
  if (!context) return tl::unexpected(context.error());
  const GL& gl = context->gl();
  Painter painter(gl);
  if (const auto prepared = painter.prepare(); !prepared) return tl::unexpected(prepared.error());
  const auto canvas = Canvas::make(gl, width, height);
  if (!canvas) return tl::unexpected(canvas.error());

  // Floats are only used about the scene's middle.
  const geometry::Box everything_W = box_around(still);
  const glm::dvec3 origin_W = everything_W.is_empty() ? glm::dvec3(0) : everything_W.centre();
  const glm::vec3 half_size_m(everything_W.is_empty() ? glm::dvec3(0.06) : 0.5 * everything_W.size());
  const auto radius_m = static_cast<double>(glm::length(half_size_m));

  std::vector<Loaded> bodies;
  for (const Body& body : still.bodies)
    bodies.push_back(painter.load(solid_of(*body.mesh_O, body.X_WO, origin_W, body.colours_sRGB),
                                  body.colours_sRGB.empty() ? body.colour_sRGB : glm::vec3(1)));
  painter.cast_shadows(bodies, half_size_m);

  double largest_N = 0;
  for (const ForceArrow& arrow : still.arrows) largest_N = std::max(largest_N, glm::length(arrow.force_N));

  std::vector<Image> images;
  for (const Camera& camera : cameras) {
    const double distance = glm::length(camera.target_W - camera.eye_W);
    const double picture_height_m = 2 * distance * std::tan(camera.field_of_view_rad / 2);
    const double m_per_N = still.arrow_m_per_N > 0 ? still.arrow_m_per_N
                           : largest_N > 0         ? kLongestArrow * picture_height_m / largest_N
                                                   : 0;
    Solid arrows, points;
    for (const ForceArrow& arrow : still.arrows) {
      const glm::dvec3 foot = arrow.p_WC_W - origin_W;
      append_arrow(arrows, foot, foot + m_per_N * arrow.force_N, kArrowRadius * picture_height_m);
      append_ball(points, foot, 1.6 * kArrowRadius * picture_height_m);
    }
    std::vector<Loaded> marks = {painter.load(arrows, kArrowColour_sRGB), painter.load(points, kPointColour_sRGB)};

    const glm::dvec3 eye = camera.eye_W - origin_W;
    const double nearest = std::max(0.05 * distance, glm::length(eye) - 2 * radius_m);
    const glm::dmat4 view = glm::lookAt(eye, camera.target_W - origin_W, glm::dvec3(0, 0, 1));
    const glm::dmat4 projection = glm::perspective(camera.field_of_view_rad, static_cast<double>(width) / height,
                                                   nearest, glm::length(eye) + 12 * radius_m);
    const double cell_m = std::pow(10, std::floor(std::log10(0.5 * radius_m)));
    const double ground_z = everything_W.is_empty() ? 0 : everything_W.low.z - origin_W.z;
    gl.BindFramebuffer(GL_FRAMEBUFFER, canvas->drawn);
    gl.Viewport(0, 0, width, height);
    painter.paint({glm::mat4(projection * view), glm::vec3(eye), static_cast<float>(ground_z),
                   static_cast<float>(cell_m), static_cast<float>(radius_m)},
                  bodies, marks);
    for (Loaded& mark : marks) painter.unload(mark);
    gl.BindFramebuffer(GL_FRAMEBUFFER, canvas->read);
    painter.smooth_edges(canvas->picture);
    images.push_back(canvas->taken(gl, width, height));
  }
  if (const GLenum error = gl.GetError(); error != GL_NO_ERROR)
    return failure(fmt::format("OpenGL failed with 0x{:x} on {}", error, context->renderer()));
  return images;
}

tl::expected<std::string, DisplayError> offscreen_renderer() {
  auto context = OffscreenContext::create();
  if (!context) return tl::unexpected(context.error());
  return context->renderer();
}

}  // namespace farfeel::master_station
