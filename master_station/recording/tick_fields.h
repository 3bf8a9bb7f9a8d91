// What a recording holds of a haptic loop, field by field: its settings, what came into a tick, and what came out.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/recording/recording.h"
#include "master_station/haptic_loop/haptic_loop.h"

namespace farfeel::master_station {

inline constexpr const char* kTicks = "ticks";  ///< the stream's name
/// Of a tick's messages, in the order in which they came.
enum TickMessage : std::uint8_t {
  kAnswerCame = 1,  ///< codecs::AnswerReader
  kTileCame = 2     ///< TileReceiver::on_tile
};

/// What a loop is made of beside its device and its remote.
struct RecordedLoop {
  HapticLoopSettings settings;
  DeviceCapabilities capabilities;  ///< but for the name
  bool has_outline = false;         ///< it finds contacts itself
};
[[nodiscard]] codecs::Numbers numbers_of(const RecordedLoop&);
/// Looks for them among all settings of a recording. Fails on scripts that are none.
[[nodiscard]] tl::expected<RecordedLoop, std::string> loop_in(codecs::NumberReader&);

/// All numbers that come into one tick.
struct TickInputs {
  realtime::TickTiming timing{};
  bool is_reset = false;
  DeviceState device;
  bool is_given_as_asked = true;  ///< the device gives the hand what the loop asks for; else F_given_B
  spatial::Wrench F_given_B;
  double masked_torque_Nm = 0, hand_energy_J = 0;
};
[[nodiscard]] codecs::Numbers numbers_of(const TickInputs&);
[[nodiscard]] TickInputs inputs_in(const codecs::Stream&, const codecs::Record&);

/// After tick(). Takes the tick's record out of the loop's queue.
[[nodiscard]] codecs::Outputs outputs_of(HapticLoop&);

}  // namespace farfeel::master_station
