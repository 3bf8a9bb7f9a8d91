// Springs by the same solver are today's penalty step: wherever all rows push at the step's end.
#include "haptic_core/constraint/row_problem.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "haptic_core/constraint/tool_step.h"
#include "haptic_core/contact/penalty.h"
#include "haptic_core/tool/virtual_coupling.h"

namespace farfeel::constraint {
namespace {

using spatial::Vector6;

class RowProblemTest : public ::testing::Test {
 protected:
  double normal() { return std::normal_distribution<>()(random_); }
  glm::dvec3 normal3(double size) { return size * glm::dvec3(normal(), normal(), normal()); }
  std::mt19937 random_{1};
};

TEST_F(RowProblemTest, SpringsAreThePenaltyStep) {
  int all_push = 0;
  for (int i = 0; i < 20'000; ++i) {
    tool::RigidTool tool;
    tool.X_WT = {spatial::rotation_from_vector(normal3(0.5)), normal3(0.01)};
    tool.V_WT_W = {normal3(0.3), normal3(0.02)};
    const tool::VirtualCoupling coupling({2000, 1, 5, 0.005}, {{1, 0, 0, 0}, {0, 0, 0.05}});
    spatial::Pose X_WD = tool.X_WT * spatial::Pose{{1, 0, 0, 0}, {0, 0, 0.05}};
    X_WD.p += normal3(0.001);
    const tool::LinearResponse others = coupling.evaluate(X_WD, {}, tool.X_WT, tool.V_WT_W).on_tool;
    constexpr double dt_s = 1e-3;

    tool::LinearResponse forces = others;
    std::vector<Row> rows(1 + i % 4);
    bool is_clamped = false;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const glm::dvec3 nhat = glm::normalize(normal3(1)), r = normal3(0.02);
      contact::Contact contact;
      contact.gradient << spatial::to_eigen(-glm::cross(r, nhat)), spatial::to_eigen(-nhat);
      contact.depth_m = 3e-4 * std::abs(normal());
      contact.material.stiffness_N_per_m = 500 + 1000 * std::abs(normal());
      contact.material.damping_Ns_per_m = i % 3 ? 0.25 : 0;
      const auto& material = contact.material;
      const double spring_N = material.stiffness_N_per_m * contact.depth_m;
      const double rate_m_s = contact.gradient.dot(spatial::to_vector6(tool.V_WT_W));
      // Today's damper never exceeds the spring; the row's never makes it pull. Where neither bites they are the same.
      is_clamped = is_clamped || material.damping_Ns_per_m * std::abs(rate_m_s) > spring_N;
      forces.F_To_W += spatial::to_vector6(contact::penalty_wrench(contact, tool.V_WT_W));
      forces.by_pose -= contact::penalty_stiffness(contact, spatial::Matrix6::Zero());
      forces.by_twist -= material.damping_Ns_per_m * contact.gradient * contact.gradient.transpose();

      Row& row = rows[k];
      row.name = k + 1;
      row.depth_m = contact.depth_m;
      row.gradient = contact.gradient;
      row.nhat_ST_W = nhat;
      row.p_ToC_W = r;
      row.stiffness_N_per_m = material.stiffness_N_per_m;
      row.damping_Ns_per_m = material.damping_Ns_per_m;
      row.most_N = 1e9;
    }
    tool::RigidTool today = tool;
    tool::step(today, forces, dt_s);
    TouchingTool touching = untouched(tool);
    const TickReport report =
        take_tick(touching, others, rows, where_to_look(touching, dt_s, Pad::kSprings), dt_s, springs());
    bool do_all_push = true;
    for (std::size_t k = 0; k < rows.size(); ++k) do_all_push = do_all_push && report.contacts.normal.lambda[k] > 0;
    if (is_clamped || !do_all_push) continue;
    ++all_push;
    const Vector6 off = spatial::to_vector6(touching.tool.V_WT_W) - spatial::to_vector6(today.V_WT_W);
    ASSERT_LE(off.cwiseAbs().maxCoeff(), 1e-10) << i;
    ASSERT_LE(glm::length(touching.tool.X_WT.p - today.X_WT.p), 1e-13) << i;
  }
  EXPECT_GE(all_push, 5000);
}

TEST_F(RowProblemTest, ThePadStoresOnceWhateverReportsIt) {
  for (const int copies : {1, 2, 8}) {
    Row row;
    row.depth_m = 1e-3;
    row.gradient << 0, 0, 0, 0, 0, -1;
    const std::vector<Row> rows(copies, row);
    // k d^2 / 2 of 1 N/mm and 1 mm, less e's share.
    EXPECT_NEAR(pad_energy_J(rows, {}, {}, one_pad(2000)), 0.5e-3, 0.5e-3 * 0.004) << copies;
    EXPECT_NEAR(pad_energy_J(rows, {}, {}, springs()), copies * 0.5e-3, 1e-12) << copies;
    EXPECT_EQ(pad_energy_J(rows, {}, {{1, 0, 0, 0}, {0, 0, 2e-3}}, one_pad(2000)), 0) << copies;
  }
}

TEST_F(RowProblemTest, ARowYieldsLittleBesideTheCoupling) {
  EXPECT_EQ(row_compliance_m_per_N(2000), 3e-6);
  EXPECT_EQ(row_compliance_m_per_N(10'000), 1e-6);
  EXPECT_EQ(row_compliance_m_per_N(0), 3e-6);
}

}  // namespace
}  // namespace farfeel::constraint
