#include "master_station/devices/hand/source_device.h"

namespace farfeel::devices {

master_station::DeviceState SourceDevice::read(std::int64_t time_ns) noexcept {
  sample_ = &source_.newest(time_ns);
  time_ns_ = time_ns;
  is_live_ = is_heard(*sample_, model().reports, time_ns);
  const int button = model().clutch_button;
  const bool is_button_held = button >= 0 && sample_->has_button(static_cast<unsigned>(button));
  master_station::DeviceState state{sample_->X_BD, sample_->V_BD_B, is_live_, false};
  state.stage = sample_->stage;
  state.buttons = sample_->buttons;
  state.opening = sample_->opening;
  state.mapping = mapping_;
  state.time_ns = model().reports == Reports::kStream ? sample_->time_ns : sample_->polled_ns;
  state.is_clutch_held = is_button_held || is_station_clutch_held_.load(std::memory_order_relaxed);
  return state;
}

void SourceDevice::write(const spatial::Wrench& F_hand_B) noexcept {
  Command command;
  command.time_ns = time_ns_;
  command.opening = sample_->opening;
  command.is_light_on = is_live_;
  command.is_force_on = is_live_ && is_usable(*sample_) && spatial::is_finite(F_hand_B) && model().force_dof > 0;
  if (command.is_force_on) command.F_hand_B = F_hand_B;
  source_.command(command);
}

}  // namespace farfeel::devices
