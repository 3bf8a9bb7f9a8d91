// What is chosen, and that no GL library is in a process that needs none: its own map of memory tells.
#include "slave_sim/depths/chosen_depths.h"

#include <gtest/gtest.h>

#include <fstream>

#include "haptic_core/headless_gl/headless_context.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::DepthBackEnd;

/// The first line of this process's memory map that names a library of EGL, OpenGL or a graphics driver; or none.
std::string gl_library() {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    for (const char* library : {"libEGL", "libGL", "libOpenGL", "swrast", "_dri.so", "libgallium", "libnvidia"}) {
      if (line.find(library) != std::string::npos) return line;
    }
  }
  return {};
}

// Cases of this file run each in a process of its own under ctest, and in this order otherwise: what loads GL is last.
TEST(ChosenDepths, ASceneWithoutTextureLoadsNoGl) {
  const auto chosen = choose_depths({.name = "auto", .is_textured = false});
  ASSERT_TRUE(chosen) << chosen.error();
  EXPECT_EQ(chosen->back_end, DepthBackEnd::kSimd);
  EXPECT_NE(chosen->reason.find("texture"), std::string::npos) << chosen->reason;
  EXPECT_EQ(gl_library(), "");
}

TEST(ChosenDepths, AMachineWithoutGraphicsLoadsNoGl) {
  if (headless_gl::has_graphics_device()) GTEST_SKIP() << "this machine has a graphics device";
  const auto chosen = choose_depths({});
  ASSERT_TRUE(chosen) << chosen.error();
  EXPECT_EQ(chosen->back_end, DepthBackEnd::kSimd);
  EXPECT_NE(chosen->reason.find("no graphics device"), std::string::npos) << chosen->reason;
  EXPECT_EQ(gl_library(), "");
}

TEST(ChosenDepths, WhatTheProcessorDoesLoadsNoGl) {
  for (const char* name : {"simd", "reference"}) {
    const auto chosen = choose_depths({.name = name});
    ASSERT_TRUE(chosen) << chosen.error();
    EXPECT_EQ(chosen->back_end, name == std::string("simd") ? DepthBackEnd::kSimd : DepthBackEnd::kReference);
  }
  EXPECT_EQ(gl_library(), "");
}

TEST(ChosenDepths, AMachineWithGraphicsIsMeasured) {
  if (!headless_gl::has_graphics_device()) GTEST_SKIP() << "no graphics device here";
  const auto chosen = choose_depths({});
  ASSERT_TRUE(chosen) << chosen.error();
  EXPECT_FALSE(chosen->reason.empty());
}

TEST(ChosenDepths, OthersAreNoChoice) {
  const auto chosen = choose_depths({.name = "vulkan"});
  ASSERT_FALSE(chosen);
  EXPECT_NE(chosen.error().find("historical"), std::string::npos);
}

/// And the map does tell: asked for by name, GL is there.
TEST(ChosenDepths, GlIsLoadedWhenAskedFor) {
  for (const char* name : {"egl", "historical"}) {
    const auto chosen = choose_depths({.name = name});
    if (!chosen) GTEST_SKIP() << chosen.error();
    EXPECT_EQ(chosen->back_end, DepthBackEnd::kGiven);
    ASSERT_TRUE(chosen->maker);
    EXPECT_NE(gl_library(), "");
    EXPECT_TRUE(chosen->maker->make({.coarse_triangles = 8}));
  }
}

}  // namespace
}  // namespace farfeel::slave_sim
