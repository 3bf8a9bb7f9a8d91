// Textures that are hard to sum over, against an independent quadrature: asked afresh and slid to the pose.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "haptic_core/penetration/simd/simd.h"
#include "haptic_core/penetration/two_widths.h"
#include "tests/support/plate_patterns.h"
#include "tests/support/plate_truth.h"

namespace farfeel::penetration {
namespace {

using spatial::Pose;
using support::PlatePattern;
using support::PlateTruth;

constexpr double kPress_m = 0.15e-3, kStiffness_N_per_m = 4000;
constexpr double kRight_m = 0.5e-6, kRightShare = 0.005, kMostStep_N = 0.1;
constexpr Limits kLimits{.coarse_triangles = 16};

bool is_right(double depth_m, double truth_m) {
  return std::abs(depth_m - truth_m) <= std::max(kRight_m, kRightShare * std::abs(truth_m));
}
bool is_flagged(const Penetration& answer) {
  return (answer.doubts & kCoarseSteps) != 0;
}
glm::dvec3 force_N(const Penetration& answer) {
  return -kStiffness_N_per_m * answer.depth_m * glm::dvec3{answer.gradient[3], answer.gradient[4], answer.gradient[5]};
}

struct Case {
  const char* pattern;
  std::vector<double> widths_m;
};

class HardPatterns : public testing::TestWithParam<Case> {
 protected:
  /// C's axes are off S's, as a contact frame's are.
  const Pose X_CS_{{std::cos(0.277), 0, 0, std::sin(0.277)}, {0, 0, 0}};
  std::unique_ptr<PlatePattern> pattern_ = support::plate_pattern(GetParam().pattern);
  PlateTruth truth_{pattern_->s(), pattern_->t()};

  Pose pressed_pose() {
    std::mt19937 random(7);
    Pose X_ST = pattern_->random_pose(random);
    X_ST.p.z += truth_.hard_depth_m(X_ST) - kPress_m;
    return X_ST;
  }
  Penetration ask(BackEnd& back_end, const Pose& X_ST, double width_m, std::uint32_t contact) const {
    Query query = pattern_->query(X_CS_, X_ST, width_m, 50);
    query.contact = contact;
    Penetration answer;
    back_end.evaluate({&query, 1}, {&answer, 1});
    return answer;
  }
};

TEST_P(HardPatterns, DepthsAreRightOrFlaggedWhateverTheWayToThem) {
  const Pose X_ST = pressed_pose();
  for (const double width_m : GetParam().widths_m) {
    const PlateTruth::Soft truth = truth_.soft(X_ST, width_m);
    for (const InstructionSet set : {InstructionSet::kBest, InstructionSet::kPlain}) {
      const auto simd = make_simd(kLimits, set);
      const Penetration fresh = ask(*simd, X_ST, width_m, 1);
      Penetration slid;
      for (int k = 60; k >= 0; --k) {
        slid = ask(*simd, {X_ST.R, X_ST.p - k * 2e-6 * glm::dvec3{0.8, 0.6, 0}}, width_m, 2);
      }
      std::printf("%s, w = %.0f um: truth %.2f um, afresh %.2f%s, slid %.2f%s\n", GetParam().pattern, 1e6 * width_m,
                  1e6 * truth.depth_m, 1e6 * fresh.depth_m, is_flagged(fresh) ? " (flagged)" : "", 1e6 * slid.depth_m,
                  is_flagged(slid) ? " (flagged)" : "");
      EXPECT_TRUE(is_right(fresh.depth_m, truth.depth_m) || is_flagged(fresh));
      EXPECT_TRUE(is_right(slid.depth_m, truth.depth_m) || is_flagged(slid));
      EXPECT_TRUE(is_right(slid.depth_m, fresh.depth_m) || is_flagged(slid) || is_flagged(fresh));
      glm::dvec3 last_N = force_N(slid);
      for (int k = 1; k <= 20; ++k) {
        const glm::dvec3 now_N = force_N(ask(*simd, {X_ST.R, X_ST.p + k * 1e-6 * glm::dvec3{0.8, 0.6, 0}}, width_m, 2));
        EXPECT_LT(glm::distance(now_N, last_N), kMostStep_N) << "in 1 um";
        last_N = now_N;
      }
    }
  }
}

/// The wide one's direction, the narrow one's depth.
TEST_P(HardPatterns, TwoWidthsTakeTheDepthFromOneAndTheRestFromTheOther) {
  constexpr double kNarrow_m = 10e-6, kWide_m = 60e-6;
  const Pose X_ST = pressed_pose();
  const auto alone = make_simd(kLimits);
  TwoWidths both(make_simd(kLimits));
  const Penetration narrow = ask(*alone, X_ST, kNarrow_m, 1), wide = ask(*alone, X_ST, kWide_m, 2);
  Query query = pattern_->query(X_CS_, X_ST, kWide_m, 50);
  query.depth_width_m = kNarrow_m;
  Query plain = query;
  plain.depth_width_m = 0;
  const std::array queries{query, plain};
  std::array<Penetration, 2> answers;
  both.evaluate(queries, answers);
  EXPECT_EQ(answers[0].depth_m, narrow.depth_m);
  EXPECT_EQ(answers[0].gradient, wide.gradient);
  EXPECT_EQ(answers[1].depth_m, wide.depth_m);
}

INSTANTIATE_TEST_SUITE_P(Patterns, HardPatterns,
                         testing::Values(Case{"saw", {10e-6, 50e-6}}, Case{"saw_in_saw", {10e-6, 50e-6}},
                                         Case{"knurl", {20e-6, 50e-6}}, Case{"spikes", {10e-6}},
                                         Case{"rough_flat", {10e-6, 50e-6}}),
                         [](const auto& of) { return std::string(of.param.pattern); });

}  // namespace
}  // namespace farfeel::penetration
