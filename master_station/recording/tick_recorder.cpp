#include "master_station/recording/tick_recorder.h"

#include <utility>

namespace farfeel::master_station {

TickRecorder::TickRecorder(Device& device, bool keeps_values) : device_(device), keeps_values_(keeps_values) {
  stream_.name = kTicks;
  stream_.inputs = numbers_of(TickInputs{}).names;
}

void TickRecorder::note(TickMessage kind, std::span<const std::byte> bytes) {
  messages_.push_back({kind, {bytes.begin(), bytes.end()}});
}

DeviceState TickRecorder::read(std::int64_t time_ns) noexcept {
  return inputs_.device = device_.read(time_ns);
}

spatial::Wrench TickRecorder::render(const spatial::Wrench& F_hand_B, const Circumstances& circumstances) noexcept {
  inputs_.F_given_B = device_.render(F_hand_B, circumstances);
  inputs_.is_given_as_asked = inputs_.F_given_B == F_hand_B;
  if (inputs_.is_given_as_asked) inputs_.F_given_B = {};
  return inputs_.is_given_as_asked ? F_hand_B : inputs_.F_given_B;
}

void TickRecorder::tick(HapticLoop& loop, const realtime::TickTiming& timing, bool is_reset) {
  inputs_ = {};
  inputs_.timing = timing;
  inputs_.is_reset = is_reset;
  if (is_reset) loop.reset_fault();
  loop.tick(timing);
  inputs_.masked_torque_Nm = device_.masked_torque_Nm();
  inputs_.hand_energy_J = device_.hand_energy_J();
  const codecs::Outputs outputs = outputs_of(loop);
  if (stream_.outputs.empty())
    for (const codecs::Output& output : outputs) stream_.outputs.push_back(output.name);
  stream_.records.push_back(
      {numbers_of(inputs_).values, std::exchange(messages_, {}), codecs::outcome_of(outputs, keeps_values_)});
}

}  // namespace farfeel::master_station
