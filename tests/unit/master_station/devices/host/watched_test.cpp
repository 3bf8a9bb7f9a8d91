#include "master_station/devices/host/watched.h"

#include <gtest/gtest.h>

#include <limits>

namespace farfeel::devices {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Watched, ABarGrowsFromTheMiddleAndEndsAtItsEnds) {
  EXPECT_EQ(bar(0), "[----------|----------]");
  EXPECT_EQ(bar(0.5), "[----------|#####-----]");
  EXPECT_EQ(bar(-0.3), "[-------###|----------]");
  EXPECT_EQ(bar(7), "[----------|##########]");
  EXPECT_EQ(bar(-1), "[##########|----------]");
  EXPECT_EQ(bar(kNan), bar(0));
}

TEST(Watched, APictureHasAsManyColumnsAndLinesWhateverIsInIt) {
  Watched empty, full;
  full.name = "falcon:1";
  full.sample.X_BD.p = {-0.0123, 1, kNan};
  full.sample.buttons = 0x80000005;
  full.sample.stage = Stage::kHoming;
  full.advice = "push the handle in and pull it out";
  EXPECT_EQ(picture(empty).size(), picture(full).size());
  for (const char* part : {"falcon:1", "-12.30", "0 2 31", "push the handle in"})
    EXPECT_NE(picture(full).find(part), std::string::npos) << picture(full);
  EXPECT_NE(line(full).find("position_mm=-12.30,1000.00,nan"), std::string::npos) << line(full);
  EXPECT_EQ(line(full).find('\n'), std::string::npos);
}

}  // namespace
}  // namespace farfeel::devices
