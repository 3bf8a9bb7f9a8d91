// What is chosen, and that no GL library is in a process that needs none: its own map of memory tells.
#include "slave_sim/depths/chosen_depths.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "haptic_core/headless_gl/headless_context.h"

namespace farfeel::slave_sim {
namespace {

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
  EXPECT_FALSE(chosen->maker) << "simd";
  EXPECT_NE(chosen->reason.find("texture"), std::string::npos) << chosen->reason;
  EXPECT_EQ(gl_library(), "");
}

TEST(ChosenDepths, AMachineWithoutGraphicsLoadsNoGl) {
  if (headless_gl::has_graphics_device()) GTEST_SKIP() << "this machine has a graphics device";
  const auto chosen = choose_depths({});
  ASSERT_TRUE(chosen) << chosen.error();
  EXPECT_FALSE(chosen->maker) << "simd";
  EXPECT_NE(chosen->reason.find("no graphics device"), std::string::npos) << chosen->reason;
  EXPECT_EQ(gl_library(), "");
}

TEST(ChosenDepths, WhatTheProcessorDoesLoadsNoGl) {
  for (const char* name : {"simd", "reference"}) {
    const auto chosen = choose_depths({.name = name});
    ASSERT_TRUE(chosen) << chosen.error();
    EXPECT_EQ(chosen->maker != nullptr, name == std::string("reference"));
  }
  EXPECT_EQ(gl_library(), "");
}

TEST(ChosenDepths, AMachineWithGraphicsIsMeasured) {
  if (!headless_gl::has_graphics_device()) GTEST_SKIP() << "no graphics device here";
  const auto chosen = choose_depths({});
  ASSERT_TRUE(chosen) << chosen.error();
  EXPECT_FALSE(chosen->reason.empty());
}

// The words after "there are": each of them is a choice, here or on a machine that has more.
TEST(ChosenDepths, OthersAreNoChoiceAndTheMessageNamesWhatIs) {
  const auto chosen = choose_depths({.name = "vulkan"});
  ASSERT_FALSE(chosen);
  EXPECT_NE(chosen.error().find("vulkan"), std::string::npos) << chosen.error();
  const std::string lead = "there are ";
  const std::size_t at = chosen.error().find(lead);
  ASSERT_NE(at, std::string::npos) << chosen.error();
  std::istringstream words(std::regex_replace(chosen.error().substr(at + lead.size()), std::regex(",| and "), " "));
  int count = 0;
  for (std::string name; words >> name; ++count) {
    const auto one = choose_depths({.name = name});
    EXPECT_TRUE(one || one.error().find(lead) == std::string::npos) << name << ": " << one.error();
  }
  EXPECT_EQ(count, 5);
}

/// And the map does tell: asked for by name, GL is there.
TEST(ChosenDepths, GlIsLoadedWhenAskedFor) {
  for (const char* name : {"egl", "historical"}) {
    const auto chosen = choose_depths({.name = name});
    if (!chosen) GTEST_SKIP() << chosen.error();
    ASSERT_TRUE(chosen->maker);
    EXPECT_NE(gl_library(), "");
    EXPECT_TRUE(chosen->maker({.coarse_triangles = 8}));
  }
}

}  // namespace
}  // namespace farfeel::slave_sim
