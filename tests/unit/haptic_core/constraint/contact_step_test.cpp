// Springs by the same solver are the penalty step, wherever all rows push at the step's end; what the pad stores, and
// what a step may make.
#include "haptic_core/constraint/contact_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "haptic_core/constraint/tool_step.h"
#include "haptic_core/contact/penalty.h"
#include "haptic_core/tool/virtual_coupling.h"

namespace farfeel::constraint {
namespace {

using spatial::Vector6;

class ContactStepTest : public ::testing::Test {
 protected:
  double normal() { return std::normal_distribution<>()(random_); }
  glm::dvec3 normal3(double size) { return size * glm::dvec3(normal(), normal(), normal()); }
  std::mt19937 random_{1};
};

TEST_F(ContactStepTest, SpringsAreThePenaltyStep) {
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
    take_tick(touching, others, rows, where_to_look(touching, dt_s, Pad::kSprings), dt_s, springs());
    bool do_all_push = true;
    for (std::size_t k = 0; k < rows.size(); ++k) do_all_push = do_all_push && touching.memory.forces[k].normal_N > 0;
    if (is_clamped || !do_all_push) continue;
    ++all_push;
    const Vector6 off = spatial::to_vector6(touching.tool.V_WT_W) - spatial::to_vector6(today.V_WT_W);
    ASSERT_LE(off.cwiseAbs().maxCoeff(), 1e-10) << i;
    ASSERT_LE(glm::length(touching.tool.X_WT.p - today.X_WT.p), 1e-13) << i;
  }
  EXPECT_GE(all_push, 5000);
}

TEST_F(ContactStepTest, ThePadStoresOnceWhateverReportsIt) {
  for (const auto& [copies, law] :
       {std::pair(1, one_pad(2000)), {2, one_pad(2000)}, {8, one_pad(2000)}, {8, springs()}}) {
    const double depth_m = 1e-3;
    ContactMemory memory;
    std::vector<Row> rows(copies);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].name = i + 1;
      rows[i].gradient << 0, 0, 0, 0, 0, -1;
    }
    // A tool that cannot be moved is led in by 50 um a tick.
    const Mobility moves{{}, spatial::Vector6::Unit(5) * -0.05, spatial::Matrix6::Identity() * 1e-9, 1e-3};
    double work_J = 0;
    for (int i = 0; i < 20; ++i) {
      ContactForces out;
      solve_contacts(rows, {}, {{1, 0, 0, 0}, {0, 0, -50e-6 * i}}, moves, law, 0, memory, out);
      work_J -= out.F_To_W.dot(out.V_moved) * 1e-3;
    }
    // k d^2 / 2 of 1 N/mm and 1 mm; of the pad once, less e's share.
    const double springs_J = 0.5e3 * depth_m * depth_m * (law.pad == Pad::kOne ? 1 : copies);
    EXPECT_NEAR(memory.stored_J, springs_J, 0.004 * springs_J) << copies;
    EXPECT_GE(work_J, memory.stored_J) << copies;
    EXPECT_LE(work_J, 1.06 * memory.stored_J) << copies;  // backward Euler takes a twentieth in 20 steps
  }
}

/// Cells of walls that jam, which jump, turn, change their stiffness, come and go at random.
TEST_F(ContactStepTest, MakesNoMoreThanCanBeAffordedWhateverItIsTold) {
  std::uniform_real_distribution<> uniform;
  for (const double afford_J : {0.0, 1e-5}) {
    int news = 0, kept_back = 0, unsolved = 0, steps = 0;
    double least_J = 0;
    for (int cell = 0; cell < 20; ++cell) {
      TouchingTool touching = untouched({{}, {}, {}});
      struct Wall {
        Row row;
        glm::dvec3 place_T, place_W;
      };
      std::vector<Wall> walls(2 + cell % 14);
      for (std::size_t i = 0; i < walls.size(); ++i) {
        walls[i].place_T = normal3(0.01);
        walls[i].place_W = walls[i].place_T + normal3(0.1e-3);
        Row& row = walls[i].row;
        row.name = i + 1;
        row.nhat_ST_W = glm::normalize(normal3(1));
        row.stiffness_N_per_m = 1000 * std::exp(normal());
        row.damping_Ns_per_m = 0.3 * uniform(random_);
        row.dynamic_friction = row.static_friction = cell % 3 ? 0.4 : 0;
      }
      const tool::VirtualCoupling coupling({2000, 1, 5, 0.005}, {});
      for (int i = 0; i < 150; ++i) {
        const double t = 1e-3 * i;
        const spatial::Pose X_WD{spatial::rotation_from_vector(0.02 * glm::dvec3(std::sin(9 * t), std::sin(7 * t), 0)),
                                 3e-3 * glm::dvec3(std::sin(11 * t), std::sin(13 * t), std::sin(17 * t))};
        const spatial::Pose X_WQ = where_to_look(touching, 1e-3);
        std::vector<Row> rows;
        for (Wall& wall : walls) {
          if (uniform(random_) < 0.02) wall.place_W += normal3(0.2e-3);
          if (uniform(random_) < 0.02) wall.row.nhat_ST_W = glm::normalize(wall.row.nhat_ST_W + normal3(0.3));
          if (uniform(random_) < 0.02) wall.row.stiffness_N_per_m *= std::exp(normal());
          if (uniform(random_) < 0.05) continue;
          Row row = wall.row;
          row.p_ToC_W = spatial::rotate(X_WQ, wall.place_T);
          row.depth_m = glm::dot(row.nhat_ST_W, wall.place_W - X_WQ.p - row.p_ToC_W);
          row.gradient << -spatial::to_eigen(glm::cross(row.p_ToC_W, row.nhat_ST_W)), -spatial::to_eigen(row.nhat_ST_W);
          rows.push_back(row);
        }
        const double before_J = touching.memory.stored_J;
        const auto others = coupling.evaluate(X_WD, {}, touching.tool.X_WT, touching.tool.V_WT_W).on_tool;
        const TickReport report = take_tick(touching, others, rows, X_WQ, 1e-3, one_pad(2000), afford_J);
        const double taken_J =
            -report.contacts.F_To_W.dot(report.stepped.V_moved) * 1e-3 + before_J - touching.memory.stored_J;
        EXPECT_NEAR(taken_J, report.contacts.taken_J, 1e-12);
        least_J = std::min(least_J, taken_J);
        news += taken_J < 0;
        kept_back += *std::max_element(report.contacts.kept_back_m.begin(), report.contacts.kept_back_m.end()) > 0;
        unsolved += !report.contacts.is_solved;
        ++steps;
      }
    }
    // What friction held together others hold then: their joints may store so much more.
    EXPECT_GE(least_J, -afford_J - 1e-8);
    EXPECT_GT(kept_back, 100);
    EXPECT_LE(unsolved, 0.02 * steps);
    if (afford_J > 0) {
      EXPECT_GT(news, 100);
    }
  }
}

TEST_F(ContactStepTest, ARowYieldsLittleBesideTheCoupling) {
  EXPECT_EQ(row_compliance_m_per_N(2000), 3e-6);
  EXPECT_EQ(row_compliance_m_per_N(10'000), 1e-6);
  EXPECT_EQ(row_compliance_m_per_N(0), 3e-6);
}

}  // namespace
}  // namespace farfeel::constraint
