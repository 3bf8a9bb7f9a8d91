#include "slave_sim/bake/unit_of_length.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

namespace farfeel::slave_sim {
namespace {

geometry::TriangleMesh triangle(double size) {
  return {{{0, 0, 0}, {size, 0, 0}, {0, size / 2, 0}, {900, 900, 900}}, {{0, 1, 2}}};
}

TEST(UnitOfLengthTest, UnitsAreNamesOrMetres) {
  EXPECT_EQ(metres_per_unit("mm"), 0.001);
  EXPECT_EQ(metres_per_unit("in"), 0.0254);
  EXPECT_EQ(metres_per_unit("0.5"), 0.5);
  for (const char* none : {"", "mmm", "-1", "0", "nan", "1e10", "1 m"}) EXPECT_FALSE(metres_per_unit(none)) << none;
}

TEST(UnitOfLengthTest, AWrongUnitIsToldWithTheNearest) {
  for (const auto& [typed, near] : {std::pair{"mn", "; did you mean mm?"}, std::pair{"inn", "; did you mean in?"},
                                    std::pair{"xx", "metres"}, std::pair{"parsec", "metres"}}) {
    const std::string words = complaint_about_unit(typed);
    EXPECT_TRUE(words.ends_with(near)) << words;
  }
  EXPECT_EQ(complaint_about_unit("mm"), "");
}

TEST(UnitOfLengthTest, ALengthHasAUnit) {
  EXPECT_NEAR(length_m("50um").value(), 50e-6, 1e-18);
  EXPECT_NEAR(length_m("0.05 mm").value(), 50e-6, 1e-18);
  for (const char* none : {"", "um", "50", "-50um", "0mm", "nanmm", "infmm", "50 umm", "x50um"})
    EXPECT_FALSE(length_m(none)) << none;
}

TEST(UnitOfLengthTest, SizesAreToldInTheUnitThatFits) {
  EXPECT_EQ(words_of_size({0.06, 0.04, 0.0205}), "60 x 40 x 20.5 mm");
  EXPECT_EQ(words_of_size({5, 5, 2}), "5 x 5 x 2 m");
  EXPECT_EQ(words_of_size({5e-4, 1e-5, 2e-6}), "500 x 10 x 2 um");
}

TEST(UnitOfLengthTest, WhatNoHandHoldsHasItsUnitAskedFor) {
  const auto question = question_about_unit(triangle(5));
  ASSERT_TRUE(question);
  EXPECT_NE(question->find("5 x 2.5 x 0 m"), std::string::npos) << *question;
  EXPECT_NE(question->find("--unit mm (5 x 2.5 x 0 mm)"), std::string::npos) << *question;
  EXPECT_FALSE(question_about_unit(triangle(0.9))) << "corners that no triangle has do not count";
  EXPECT_FALSE(question_about_unit(triangle(std::nan(""))));
  EXPECT_FALSE(question_about_unit({}));
}

TEST(UnitOfLengthTest, UnitsThatMakeSenseAreNamedWithTheirSizes) {
  EXPECT_EQ(units_that_fit(0.25),
            "--unit m (250 mm across), --unit cm (2.5 mm across), --unit in (6.35 mm across), "
            "--unit ft (76.2 mm across)");
  EXPECT_EQ(units_that_fit(200), "--unit cm (2 m across), --unit mm (200 mm across), --unit in (5.08 m across)");
  EXPECT_NE(units_that_fit(1e30).find("metres as a number"), std::string::npos);
}

TEST(UnitOfLengthTest, CoarseStepsFarFromTheOriginAreTold) {
  const auto at = [](double far, double size) {
    geometry::TriangleMesh mesh = triangle(size);
    for (glm::dvec3& p : mesh.positions_O) p.x += far;
    return mesh;
  };
  const auto words = words_about_steps(at(4'500'000, 64));
  ASSERT_TRUE(words);
  EXPECT_NE(words->find("steps of up to 0.54 units"), std::string::npos) << *words;
  EXPECT_FALSE(words_about_steps(at(4'500'000.3, 64))) << "64-bit numbers";
  EXPECT_FALSE(words_about_steps(at(16, 64)));
  EXPECT_FALSE(words_about_steps({}));
}

}  // namespace
}  // namespace farfeel::slave_sim
