// The contacts of one step as the hand felt them, one by one: what a display shows. Nothing is computed from it.
//
// A plain value of fixed size: it crosses threads in a tick's record. Floats are 6e-8 of the value, or some nanometres.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "haptic_core/local_model/received_contact.h"

namespace farfeel::local_model {

/// One contact with a force on the tool.
struct Push {
  std::uint32_t object = 0;  ///< index of S in the scene
  glm::vec3 p_WC_W{0};       ///< contact point [m]
  glm::vec3 nhat_ST_W{0};    ///< direction, unit, out of S, into T
  glm::vec3 force_N{0};      ///< on the tool, in W; spring, damper and friction
  float depth_m = 0;         ///< as it is felt, 0 where it will touch within the step
  std::uint8_t doubts = 0;   ///< quality flags: bits of penetration::Doubt and contact::ContactDoubt
  Source source{};           ///< who told of it
  bool is_leaving = false;   ///< gone from the newest contacts, and let go of over some milliseconds
};

/// As many as an answer has contacts. Those that leave may be as many again; what finds no room is not shown.
inline constexpr std::size_t kMostPushes = contact::kMaxContacts;
struct Pushes {
  std::uint32_t count = 0;
  std::array<Push, kMostPushes> of{};
};

}  // namespace farfeel::local_model
