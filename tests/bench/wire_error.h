// What the haptic lane's compact messages cost in force: the same answers of a contact service, felt by one local model
// as they are and by another as they come over the wire.
//
//   motion -> pose message -> service, at the pose as told -> answer -------------------------> full precision
//                                                             answer message, acknowledged ---> as told
//
// Both models live at the motion's own poses, the answers a round trip late. A third, whose service is asked at the
// exact poses, says what the poses' grid adds: two services that search two poses may part where clusters are made
// anew.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/local_model/local_model.h"

namespace farfeel::bench {

/// Less force than this is not compared by share but by size: a fingertip feels about as little, and a share of next to
/// nothing says nothing.
inline constexpr double kWireLeast_N = 0.05;
inline constexpr double kWireLever_m = 0.05;  ///< torque counts as the force that makes it at this arm

struct WireScene {
  std::string name;
  std::vector<spatial::Pose> motion;  ///< X_WT at 1 kHz
  std::function<contact_service::ContactService()> service;
};

struct WireShares {  ///< of the error, in the larger of the force and kWireLeast_N [1]
  double p50 = 0, p99 = 0, p99_9 = 0, most = 0;
};

struct WireError {
  WireShares force, torque;  ///< of contacts as told
  WireShares with_poses;     ///< of force, with the poses' grid
  std::size_t ticks = 0, touching = 0;
  double contacts_mean = 0;  ///< of an answer
  std::uint32_t contacts_most = 0;
  double pose_bytes = 0;  ///< with the felt wrench
  double answer_bytes_mean = 0;
  std::size_t answer_bytes_most = 0;
  double told_bytes_mean = 0;  ///< of an answer: identities and shares
  double by_seven_bytes = 0;   ///< mean of answers with seven contacts; 0: there are none
  double pose_write_ns = 0, pose_read_ns = 0, answer_write_ns = 0, answer_read_ns = 0;  ///< medians
};

struct WireSetting {
  local_model::Rung rung = local_model::Rung::kLinear;
  int round_trip_ticks = 20;
  bool has_exact_poses = true;  ///< the third model, too
};

[[nodiscard]] WireError wire_error(const WireScene&, const WireSetting&);

/// Of the benchmark scenes of these names, "ridges" and "roughness": recorded motions, and strokes of every speed over
/// a textured plate. Bakes models at first use.
[[nodiscard]] WireScene wire_scene(const std::string& name, std::uint64_t seed, std::size_t frames);

}  // namespace farfeel::bench
