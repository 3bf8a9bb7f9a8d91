#include "tests/support/row_loop.h"

#include <chrono>

namespace farfeel::test_support {

using constraint::Row;
using spatial::Pose;

namespace {

Row row_of(const Stuff& stuff) {
  Row row;
  row.stiffness_N_per_m = stuff.stiffness_N_per_m;
  row.damping_Ns_per_m = stuff.damping_Ns_per_m;
  row.static_friction = row.dynamic_friction = stuff.friction;
  return row;
}

}  // namespace

Row point_on_plane(const Pose& X_WQ, const glm::dvec3& p_ToC_T, const glm::dvec3& nhat_W, double height_m,
                   const Stuff& stuff) {
  Row row = row_of(stuff);
  row.nhat_ST_W = nhat_W;
  row.p_ToC_W = spatial::rotate(X_WQ, p_ToC_T);
  row.depth_m = height_m - glm::dot(nhat_W, X_WQ.p + row.p_ToC_W);
  row.gradient << -spatial::to_eigen(glm::cross(row.p_ToC_W, nhat_W)), -spatial::to_eigen(nhat_W);
  return row;
}

Row pin_in_bore(const Pose& X_WQ, const glm::dvec3& p_ToC_T, double radius_m, const glm::dvec3& outward_W,
                const Stuff& stuff) {
  Row row = row_of(stuff);
  const glm::dvec3 axis_W = spatial::rotate(X_WQ, p_ToC_T);
  row.nhat_ST_W = -outward_W;
  row.p_ToC_W = axis_W + radius_m * outward_W;
  row.depth_m = glm::dot(outward_W, X_WQ.p + axis_W);
  row.gradient << spatial::to_eigen(glm::cross(axis_W, outward_W)), spatial::to_eigen(outward_W);
  return row;
}

void name_in_order(std::vector<Row>& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].name = i + 1;
}

RowLoop::RowLoop(const tool::MassProperties& body, const tool::CouplingGains& gains, const constraint::Law& law,
                 double dt_s, const Pose& X_WT, const Pose& X_TG)
    : coupling_(gains, X_TG), law_(law), dt_s_(dt_s), touching_(constraint::untouched({body, X_WT, {}})) {}

const constraint::TickReport& RowLoop::tick(const Pose& X_WD, const Scene& scene) {
  if (!has_handle_) X_WD_ = X_WD;
  has_handle_ = true;
  const spatial::Twist V_WD_W{spatial::vector_from_rotation(X_WD.R * glm::conjugate(X_WD_.R)) / dt_s_,
                              (X_WD.p - X_WD_.p) / dt_s_};
  X_WD_ = X_WD;
  take(coupling_.evaluate(X_WD, V_WD_W, touching_.tool.X_WT, touching_.tool.V_WT_W).on_tool, scene);
  F_hand_W_ = coupling_.evaluate(X_WD, V_WD_W, touching_.tool.X_WT, touching_.tool.V_WT_W).F_hand_W;
  return report_;
}

const constraint::TickReport& RowLoop::push(const glm::dvec3& force_W, const Scene& scene) {
  tool::LinearResponse others;
  others.F_To_W.tail<3>() = spatial::to_eigen(force_W);
  take(others, scene);
  return report_;
}

void RowLoop::take(const tool::LinearResponse& others, const Scene& scene) {
  rows_.clear();
  const Pose X_WQ = constraint::where_to_look(touching_, dt_s_, law_.pad);
  scene(X_WQ, rows_);
  const auto begun = std::chrono::steady_clock::now();
  report_ = constraint::take_tick(touching_, others, rows_, X_WQ, dt_s_, law_);
  step_us_.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begun).count());
}

double RowLoop::normal_sum_N() const {
  double sum_N = 0;
  for (int i = 0; i < touching_.memory.count; ++i) sum_N += touching_.memory.forces[i].normal_N;
  return sum_N;
}

}  // namespace farfeel::test_support
