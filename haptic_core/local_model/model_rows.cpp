// Felt contacts as rows that the tool may not leave (haptic_core/constraint): the pad yields between the tool and its
// proxy, which stays on the surface, and is where surfaces are looked up.
//
// A contact's linearisation was looked up on the surface. So it is sampled there, at the proxy P = T - pad, and felt as
// far as the pad is pressed: depth at T = depth at P - n.pad (FeltContact::sample). What was changed, recess and
// shares, is as ever, because the force of one contact is k times the felt depth here as there. Only what is stored
// differs: one pad stores once what many rows report, and changes in steps alone. So the tank pays for a change when
// the pad takes it up, as news (contact_forces.h), and for nothing before.
#include <algorithm>
#include <cmath>

#include "haptic_core/constraint/mobility.h"
#include "haptic_core/constraint/proxy_shift.h"
#include "haptic_core/constraint/recess.h"
#include "haptic_core/local_model/constants.h"
#include "haptic_core/local_model/local_model.h"

namespace farfeel::local_model {

using constraint::Row;
using spatial::Pose;
using spatial::Vector6;

/// At the model's tool pose, its object at rest: looked up at the proxy. How the pad leans across a slope is no depth.
Row LocalModel::row_at_rest(const FeltContact& felt) const noexcept {
  const glm::dvec3& n = felt.transition.nhat_W;
  const glm::dvec3 slope_W = spatial::twist_from(felt.here.gradient).linear_m_s + n;
  const contact::Material& material = felt.received.contact.material;
  Row row;
  row.name = felt.row;
  row.depth_m = felt.here.depth_m + glm::dot(n, pad_W_);
  row.recess_m = felt.transition.recess_m + glm::dot(slope_W, pad_W_);
  const double unbelieved_m = std::max(0.0, felt.transition.recess_m - kMostUnfelt_m);
  row.depth_m -= unbelieved_m, row.recess_m -= unbelieved_m;
  row.gradient = felt.here.gradient;
  row.nhat_ST_W = n;
  row.p_ToC_W = felt.here.p_ToC_W;
  row.stiffness_N_per_m = std::max(felt.stiffness_N_per_m(), kLeastRow_N_per_m);
  row.static_friction = std::max(material.static_friction, material.dynamic_friction);
  row.dynamic_friction = material.dynamic_friction;
  return row;
}

Pose LocalModel::where_to_look(const constraint::TouchingTool& touching, double dt_s) const noexcept {
  const Vector6 way = dt_s * spatial::to_vector6(touching.tool.V_WT_W);
  Pose X_WQ = spatial::integrate(touching.X_WP, touching.tool.V_WT_W, dt_s);
  glm::dvec3 out_W{0};
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t i = 0; i < count_; ++i) {
      const FeltContact& felt = contacts_[i];
      const glm::dvec3 by_translation = spatial::twist_from(felt.here.gradient).linear_m_s;
      const double depth_m = row_at_rest(felt).depth_m + felt.here.gradient.dot(way) + glm::dot(by_translation, out_W);
      const double steep = -glm::dot(by_translation, felt.transition.nhat_W);
      if (depth_m > 0 && !felt.transition.is_leaving && steep > 0) out_W += depth_m / steep * felt.transition.nhat_W;
    }
  }
  X_WQ.p += out_W;
  return X_WQ;
}

std::span<const Row> LocalModel::rows(const constraint::TouchingTool& touching, double dt_s) noexcept {
  const Pose& X_WT = touching.tool.X_WT;
  look_from(X_WT);
  row_count_ = 0;
  for (std::size_t i = 0; i < count_ && row_count_ < rows_.size(); ++i) {
    const FeltContact& felt = contacts_[i];
    const Row row = row_at_rest(felt);
    if (row.depth_m < -kReach_m && !(felt.felt_m() > 0)) continue;
    row_of_[row_count_] = i;
    rows_[row_count_++] = row;
  }
  for (std::size_t r = 0; r < row_count_; ++r) {
    Row& row = rows_[r];
    row.V_WS_W = surface_twist(contacts_[row_of_[r]], X_WT.p);
    row.depth_m -= dt_s * row.gradient.dot(row.V_WS_W);
    row.damping_Ns_per_m = damping_Ns_per_m(contacts_[row_of_[r]], settings_.tool_mass_kg);
  }
  return {rows_.data(), row_count_};
}

/// After a step: depth that the tool did not make by moving is recess, before it is felt. Two parts of it are known
/// here.
///   the pad leant   by leant_W, where the proxy went otherwise than the tool: the step took the surface to stay below
///                   the tool, and across a slope that makes depth of slope.leant_W
///   no room         what is left at the proxy, as it is looked up there: walls that oppose each other would push each
///                   other with it over e, 1 N each 3 um, and nobody pressed
void LocalModel::recede(FeltContact& felt, const Row& row, double left_m, const glm::dvec3& leant_W) noexcept {
  double& recess_m = felt.transition.recess_m;
  const glm::dvec3 slope_W = spatial::twist_from(row.gradient).linear_m_s + row.nhat_ST_W;
  if (felt.felt_m() > 0) recess_m -= glm::dot(slope_W, leant_W);
  if (!(left_m > 0)) return;
  felt.no_room_m = std::max(left_m, felt.at_proxy_m());
  recess_m = std::max(recess_m, felt.no_room_m);
}

Felt LocalModel::settle(const constraint::TouchingTool& touching, const constraint::TickReport& report, double dt_s,
                        Pushes& pushes) noexcept {
  const Vector6& V = report.stepped.V_moved;
  const double work_J = -report.contacts.F_To_W.dot(V) * dt_s;
  port_.add(work_J);
  Felt felt;
  felt.depth_max_m = report.proxy_depth_m;
  double script_J = 0;
  pushes.count = 0;
  for (std::size_t r = 0; r < row_count_; ++r) {
    const constraint::RowForce& force = touching.memory.forces[r];
    FeltContact& contact = contacts_[row_of_[r]];
    if (force.normal_N > 0) {
      ++felt.pressing;
      felt.by_outline += contact.received.is_from_outline();
      felt.outline_off_m = std::max(felt.outline_off_m, contact.received.origin.off_m);
    }
    // What the object puts in by its script: the force on the tool times the object's own way.
    const glm::dvec3 torsion_Nm = force.torsion_Nm * rows_[r].nhat_ST_W;
    const Vector6 F_To_W = -force.normal_N * rows_[r].gradient +
                           spatial::to_vector6(spatial::Twist{
                               glm::cross(rows_[r].p_ToC_W, force.friction_W) + torsion_Nm, force.friction_W});
    script_J += F_To_W.dot(rows_[r].V_WS_W) * dt_s;
    const glm::dvec3 force_N = spatial::wrench_from(F_To_W).force_N;
    if (force_N == glm::dvec3(0) || pushes.count == pushes.of.size()) continue;
    pushes.of[pushes.count++] = {contact.received.contact.object,
                                 glm::vec3(touching.X_WP.p + rows_[r].p_ToC_W),
                                 glm::vec3(rows_[r].nhat_ST_W),
                                 glm::vec3(force_N),
                                 static_cast<float>(contact.felt_m()),
                                 static_cast<std::uint8_t>(contact.received.contact.doubts & contact::kAllDoubts),
                                 contact.received.origin.source,
                                 contact.transition.is_leaving};
  }
  const Pose X_WQ{X_WT_.R, X_WT_.p - pad_W_};  // where the rows were looked up
  X_WT_ = touching.tool.X_WT;
  const glm::dvec3 leant_W = X_WT_.p - touching.X_WP.p - pad_W_;
  pad_W_ += leant_W;
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& contact = contacts_[i];
    if (const motion::Moved* object = moving_ ? moving_->find(contact.received.contact.object) : nullptr) {
      contact.foreseen_W = spatial::integrate({}, object->V_Wo_W, dt_s);
      contact.go_along(contact.foreseen_W);
    }
    contact.pad_W = pad_W_;
    contact.no_room_m = 0;
    contact.look_from(X_WT_);
  }
  for (std::size_t r = 0; r < row_count_; ++r) {
    const double left_m = constraint::unmade_depth_m(rows_[r], X_WQ, touching.X_WP, constraint::kOnSurface_m);
    contacts_[row_of_[r]].transition.recess_m += report.contacts.kept_back_m[r];
    recede(contacts_[row_of_[r]], rows_[r], left_m, leant_W);
  }
  truncations_ += report.contacts.is_news_unpaid;
  tank_.add(report.contacts.taken_J);
  script_work_J_ += script_J;
  felt.energy_J = stored_J_ = touching.memory.stored_J;
  return felt;
}

}  // namespace farfeel::local_model
