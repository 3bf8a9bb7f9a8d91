#include "codecs/device/space_mouse.h"

#include <gtest/gtest.h>

#include <array>
#include <initializer_list>
#include <random>
#include <vector>

#include "tests/support/devices/space_mouse_emulator.h"

using namespace farfeel::codecs;
using farfeel::test_support::SpaceMouseEmulator;
using farfeel::test_support::SpaceMouseReports;

namespace {

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> b;
  for (const int v : values) b.push_back(static_cast<std::byte>(v));
  return b;
}

SpaceMouseDecoder decoder_of(SpaceMouseReports reports) {
  return SpaceMouseDecoder(SpaceMouseEmulator(reports).report_descriptor());
}

// What the public tables say: ids; little-endian int16 of +-350; report 3's bits; y and z point the other way in B.
TEST(SpaceMouse, SplitReportsAreThoseOfTheTables) {
  for (const bool is_described : {true, false}) {
    SpaceMouseDecoder d = is_described ? decoder_of(SpaceMouseReports::kSplit) : SpaceMouseDecoder({});
    ASSERT_EQ(d.is_described(), is_described);
    EXPECT_TRUE(d.take(bytes({1, 0x5E, 0x01, 0xA2, 0xFE, 0xAF, 0x00})));  // 350, -350, 175
    EXPECT_EQ(d.reading().push, glm::dvec3(1, 1, -0.5));
    EXPECT_EQ(d.reading().turn, glm::dvec3(0));
    EXPECT_TRUE(d.take(bytes({2, 0x51, 0xFF, 0x23, 0x00, 0x00, 0x00})));  // -175, 35, 0
    EXPECT_EQ(d.reading().push, glm::dvec3(1, 1, -0.5)) << "the other half stays";
    EXPECT_EQ(d.reading().turn, glm::dvec3(-0.5, -0.1, 0));
    EXPECT_TRUE(d.take(bytes({3, 0x02, 0x00})));
    EXPECT_EQ(d.reading().buttons, 2U);
    EXPECT_TRUE(d.take(bytes({3, 0x00, 0x00})));
    EXPECT_EQ(d.reading().buttons, 0U);
  }
}

TEST(SpaceMouse, CombinedReportsAreThoseOfTheTables) {
  for (const bool is_described : {true, false}) {
    SpaceMouseDecoder d = is_described ? decoder_of(SpaceMouseReports::kCombined) : SpaceMouseDecoder({});
    ASSERT_EQ(d.is_described(), is_described);
    EXPECT_TRUE(d.take(bytes({1, 0x5E, 0x01, 0xA2, 0xFE, 0xAF, 0x00, 0x51, 0xFF, 0x23, 0x00, 0xA2, 0xFE})));
    EXPECT_EQ(d.reading().push, glm::dvec3(1, 1, -0.5));
    EXPECT_EQ(d.reading().turn, glm::dvec3(-0.5, -0.1, 1));
  }
}

TEST(SpaceMouse, TheLightsReportIsThatOfTheTables) {
  EXPECT_EQ(space_mouse_light(true), (std::array{std::byte{4}, std::byte{1}}));
  EXPECT_EQ(space_mouse_light(false), (std::array{std::byte{4}, std::byte{0}}));
}

TEST(SpaceMouse, IsKnownByIdsAndUsage) {
  EXPECT_EQ(space_mouse_title(0x256f, 0xc635, 1, 8), "SpaceMouse Compact");
  EXPECT_EQ(space_mouse_title(0x046d, 0xc626, 1, 8), "SpaceNavigator");
  EXPECT_EQ(space_mouse_title(0x256f, 0xc652, 1, 8), "3Dconnexion Universal Receiver");
  EXPECT_TRUE(space_mouse_title(0x256f, 0xc639, 1, 8)) << "a puck that came after the table";
  EXPECT_FALSE(space_mouse_title(0x256f, 0xc635, 1, 6)) << "its keyboard interface";
  EXPECT_FALSE(space_mouse_title(0x046d, 0xc077, 1, 2)) << "somebody's mouse";
  EXPECT_FALSE(space_mouse_title(0x1234, 0xc635, 1, 8)) << "another maker";
  for (const int mouse_or_keyboard :
       {0xc650, 0xc651, 0xc653, 0xc654, 0xc655, 0xc656, 0xc657, 0xc658, 0xc664, 0xc665, 0xc668}) {
    EXPECT_FALSE(space_mouse_title(0x256f, static_cast<std::uint16_t>(mouse_or_keyboard), 1, 8)) << mouse_or_keyboard;
  }
}

TEST(SpaceMouse, CutReportsChangeNothing) {
  for (const auto layout : {SpaceMouseReports::kSplit, SpaceMouseReports::kCombined}) {
    SpaceMouseEmulator device(layout);
    SpaceMouseDecoder decoder(device.report_descriptor());
    device.deflect({100, -50, 25, 10, 5, -350});
    device.press(1);
    std::array<std::byte, 64> report;
    int reports = 0;
    for (std::int64_t ns = 0; reports < 3; ns += 8'000'000) {
      while (const std::size_t size = device.give_input(report, ns)) {
        ++reports;
        const SpaceMouseReading before = decoder.reading();
        // The buttons' report ends in padding: what is cut off there holds nothing.
        const std::size_t last = report[0] == std::byte{3} ? 2 : size;
        for (std::size_t cut = 0; cut < last; ++cut) {
          EXPECT_FALSE(decoder.take(std::span(report).first(cut)));
          EXPECT_EQ(decoder.reading(), before);
        }
        EXPECT_TRUE(decoder.take(std::span(report).first(size)));
      }
    }
  }
}

TEST(SpaceMouse, AnyBytesStayWithinFullDeflection) {
  std::mt19937 random(7);
  const std::vector<std::byte> none;
  const SpaceMouseEmulator split(SpaceMouseReports::kSplit), combined(SpaceMouseReports::kCombined);
  for (const auto descriptor : {split.report_descriptor(), combined.report_descriptor(), std::span(none)}) {
    SpaceMouseDecoder decoder{std::span<const std::byte>(descriptor)};
    for (int i = 0; i < 20000; ++i) {
      std::vector<std::byte> report(random() % 16);
      for (std::byte& b : report) b = static_cast<std::byte>(random());
      if (!report.empty()) report[0] = static_cast<std::byte>(random() % 5);
      decoder.take(report);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_LE(std::abs(decoder.reading().push[axis]), 1);
        ASSERT_LE(std::abs(decoder.reading().turn[axis]), 1);
      }
    }
  }
}

}  // namespace
