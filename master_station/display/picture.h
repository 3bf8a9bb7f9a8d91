// A picture of the scene, drawn offscreen: bodies, a ground, contact points and force arrows.
//
// OpenGL is loaded when the first picture is asked for, and only then. EGL needs no display and no graphics card:
// Debian's Mesa draws in software. Never call this from a thread with real-time priority: Mesa's workers would inherit
// it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/spatial/spatial.h"
#include "master_station/display/camera.h"

namespace farfeel::master_station {

struct DisplayError {
  std::string message;  ///< what was tried, what was wrong, what to do
};

struct Body {
  const geometry::TriangleMesh* mesh_O = nullptr;  ///< not owned; alive while a picture is drawn
  spatial::Pose X_WO;
  glm::vec3 colour_sRGB{0.7F};
  std::span<const std::array<std::uint8_t, 3>> colours_sRGB = {};  ///< one a vertex, in place of the one; or none
};

struct ForceArrow {
  glm::dvec3 p_WC_W;   ///< its foot: where the force acts [m]
  glm::dvec3 force_N;  ///< in W
};

struct Still {
  std::vector<Body> bodies;
  std::vector<ForceArrow> arrows;
  double arrow_m_per_N = 0;  ///< length of an arrow; 0: the longest one takes a fifth of the picture's height
};

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  ///< rows from the top, opaque
};

/// The box around everything drawn: what camera_for() is to see.
[[nodiscard]] geometry::Box box_around(const Still&);

/// Draws one picture for every camera. Fails when EGL offers no OpenGL 3.3 anywhere; the message says what each try
/// said.
[[nodiscard]] tl::expected<std::vector<Image>, DisplayError> draw(const Still&, const std::vector<Camera>&, int width,
                                                                  int height);

/// What the first OpenGL found is: "Mesa, llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5". For `farfeel doctor`.
[[nodiscard]] tl::expected<std::string, DisplayError> offscreen_renderer();

/// An image as PNG.
[[nodiscard]] std::string png(const Image&);

}  // namespace farfeel::master_station
