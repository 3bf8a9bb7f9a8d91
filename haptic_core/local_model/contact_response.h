// What felt contacts do to the tool within one step: springs, dampers and friction, as the implicit step takes them.
//
// A spring of k and depth d pushes with -k d g, and that changes with the pose by -k g g^T and by the turn of g. What a
// step applies is held for all of it: as its end's, or as its mean where contacts from tiles are felt amid the step.
#pragma once

#include <cstdint>

#include "haptic_core/local_model/felt_contact.h"
#include "haptic_core/tool/linear_response.h"

namespace farfeel::local_model {

/// One step of the tool.
struct Step {
  spatial::Pose X_WT;
  spatial::Vector6 V_WT_W = spatial::Vector6::Zero();
  double dt_s = 0;
  double tool_mass_kg = 0;
  double mean_share = 0;        ///< of contacts from tiles: how much of their push is the step's mean
  double payback_Ns_per_m = 0;  ///< damping that a debt of the tank asks for
};

/// What the local model is at one tool pose.
struct Felt {
  /// On the tool, about To, for a step of dt_s: contacts that will touch within it are there with their gap.
  tool::LinearResponse response;
  double depth_max_m = 0;        ///< of the contacts as received, not below 0
  std::uint32_t pressing = 0;    ///< contacts that push
  double energy_J = 0;           ///< stored in the contacts
  std::uint32_t by_outline = 0;  ///< contacts that push with heights of the outline in place of those that are late
  double outline_off_m = 0;      ///< how far the depth of such is from the true one, at most
  Step step;                     ///< that it was asked for
};

/// A stiffness that a step holds without being told of it.
[[nodiscard]] double held_without_N_per_m(double tool_mass_kg, double dt_s) noexcept;
/// Of a contact, with what old answers ask for.
[[nodiscard]] double damping_Ns_per_m(const FeltContact&, double tool_mass_kg) noexcept;
/// The part of v across the direction.
[[nodiscard]] inline glm::dvec3 across(const glm::dvec3& v, const glm::dvec3& nhat) noexcept {
  return v - glm::dot(v, nhat) * nhat;
}

/// Adds one contact, which is `at` at the step's pose; V_WS_W: of its object at To.
void add_response(Felt&, const FeltContact&, const FeltContact::Sample& at, const spatial::Vector6& V_WS_W,
                  const Step&) noexcept;

}  // namespace farfeel::local_model
