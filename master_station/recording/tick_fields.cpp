#include "master_station/recording/tick_fields.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "haptic_core/local_model/constants.h"

namespace farfeel::master_station {
namespace {

template <typename Tank, typename Visit>
void each_field_of_tank(Tank& tank, Visit&& visit) {
  visit("local_model.tank.cap_J", tank.cap_J);
  visit("local_model.tank.allowance_W", tank.allowance_W);
}

template <typename Model, typename Visit>
void each_field_of_model(Model& model, Visit&& visit) {
  visit("local_model.rung", model.rung);
  visit("local_model.contact", model.contact);
  visit("local_model.tool_mass_kg", model.tool_mass_kg);
  each_field_of_tank(model.tank, visit);
}

/// Settings of older recordings that are constants now. A session that was recorded with another value cannot be
/// replayed.
struct Settled {
  const char* name;
  double value;
};
constexpr std::array kSettled{Settled{"local_model.held_after_s", local_model::kHeldAfter_s},
                              Settled{"local_model.fading_after_s", local_model::kFadingAfter_s},
                              Settled{"local_model.fade_s", local_model::kFade_s},
                              Settled{"local_model.bleed_s", local_model::kBleed_s},
                              Settled{"local_model.bleed_N_per_s", local_model::kBleed_N_per_s},
                              Settled{"local_model.soon_gone_N", local_model::kSoonGone_N},
                              Settled{"local_model.leave_N_per_s", local_model::kLeave_N_per_s},
                              Settled{"local_model.free_step_N", local_model::kFreeStep_N},
                              Settled{"local_model.slope_step_N", local_model::kSlopeStep_N},
                              Settled{"local_model.torque_step_Nm", local_model::kTorqueStep_Nm},
                              Settled{"local_model.surprise_J", local_model::kSurprise_J}};

template <typename Capabilities, typename Visit>
void each_field_of_device(Capabilities& device, Visit&& visit) {
  visit("device.pose_dof", device.pose_dof);
  visit("device.force_dof", device.force_dof);
  visit("device.torque_dof", device.torque_dof);
  visit("device.max_force_N", device.max_force_N);
  visit("device.max_torque_Nm", device.max_torque_Nm);
  visit("device.max_force_rate_N_per_s", device.max_force_rate_N_per_s);
  visit("device.max_power_W", device.max_power_W);
  visit("device.max_speed_m_s", device.max_speed_m_s);
  visit("device.position_step_m", device.position_step_m);
  visit("device.rotation_step_rad", device.rotation_step_rad);
  visit("device.stable_stiffness_N_per_m", device.stable_stiffness_N_per_m);
  visit("device.stable_damping_Ns_per_m", device.stable_damping_Ns_per_m);
  visit("device.stable_rotational_stiffness_Nm_per_rad", device.stable_rotational_stiffness_Nm_per_rad);
  visit("device.stable_rotational_damping_Nms_per_rad", device.stable_rotational_damping_Nms_per_rad);
  visit("device.delay_s", device.delay_s);
  visit("device.exchange_s", device.exchange_s);
}

template <typename Loop, typename Visit>
void each_field(Loop& loop, Visit&& visit) {
  auto& settings = loop.settings;
  visit("loop.period_ns", settings.timing.period_ns);
  visit("loop.mass_kg", settings.body.mass_kg);
  visit("loop.inertia_To_T_kgm2", settings.body.inertia_To_T);
  visit("loop.X_WB", settings.X_WB);
  visit("loop.X_TG", settings.X_TG);
  visit("loop.workspace_scale", settings.scales.workspace);
  visit("loop.force_scale", settings.scales.force);
  visit("loop.has_clutch", settings.scales.has_clutch);
  visit("loop.tiles_may_rest", settings.tiles_may_rest);
  visit("loop.integrator", settings.integrator);
  visit("loop.controller", settings.controller);
  visit("loop.has_outline", loop.has_outline);
  each_field_of_model(settings.local_model, visit);
  each_field_of_device(loop.capabilities, visit);
}

/// What no loop is made of; null if nothing.
const char* fault_of(const RecordedLoop& loop) {
  const HapticLoopSettings& settings = loop.settings;
  constexpr std::int64_t kShortest_ns = 10'000, kLongest_ns = 1'000'000'000;
  if (settings.timing.period_ns < kShortest_ns || settings.timing.period_ns > kLongest_ns) return "a period is absurd";
  if (settings.local_model.rung > local_model::Rung::kTiles ||
      settings.local_model.contact > local_model::ContactLaw::kConstraint ||
      settings.integrator > tool::Integrator::kMidpoint || settings.controller > teleoperation::Controller::kPassivity)
    return "a choice is none";
  if (!spatial::is_valid(settings.X_WB) || !spatial::is_valid(settings.X_TG)) return "a pose is none";
  bool are_finite = true;
  each_field(loop, [&are_finite](const std::string& name, const auto& field) {
    codecs::each_number(name, field, [&are_finite](const std::string&, const auto& value) {
      are_finite = are_finite && std::isfinite(static_cast<double>(value));
    });
  });
  return are_finite ? nullptr : "a number is not finite";
}

template <typename Inputs, typename Visit>
void each_input(Inputs& in, Visit&& visit) {
  visit("deadline_ns", in.timing.deadline_ns);
  visit("wake_ns", in.timing.wake_ns);
  visit("previous_work_ns", in.timing.previous_work_ns);
  visit("missed", in.timing.missed);
  visit("is_reset", in.is_reset);
  visit("X_BD", in.device.X_BD);
  visit("V_BD_B", in.device.V_BD_B);
  visit("is_live", in.device.is_live);
  visit("is_clutch_held", in.device.is_clutch_held);
  visit("stage", in.device.stage);
  visit("device_fault", in.device.fault);
  visit("buttons", in.device.buttons);
  visit("opening", in.device.opening);
  visit("mapping", in.device.mapping);
  visit("device_time_ns", in.device.time_ns);
  visit("is_given_as_asked", in.is_given_as_asked);
  visit("F_given_B", in.F_given_B);
  visit("masked_torque_Nm", in.masked_torque_Nm);
  visit("hand_energy_J", in.hand_energy_J);
}

template <typename Field>
codecs::Output output(std::string name, const Field& field) {
  codecs::Output output{std::move(name), {}};
  codecs::each_number(
      "", field, [&](const std::string&, const auto& value) { output.values.push_back(static_cast<double>(value)); });
  return output;
}

std::string key_name(std::size_t object, std::size_t key) {
  return "moving." + std::to_string(object) + ".key." + std::to_string(key);
}

}  // namespace

codecs::Numbers numbers_of(const RecordedLoop& loop) {
  codecs::NumberWriter writer;
  each_field(loop, writer);
  // Courses are none of a loop's settings: a scene that changes is not recorded.
  std::vector<motion::MovingObject> moving = loop.settings.moving;
  std::erase_if(moving, [](const motion::MovingObject& object) { return !object.script; });
  writer("moving", moving.size());
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const std::string name = "moving." + std::to_string(i);
    const auto keys = moving[i].script->keys();
    writer(name + ".object", moving[i].object);
    writer(name + ".repeats", moving[i].script->afterwards() == motion::Afterwards::kRepeats);
    writer(name + ".keys", keys.size());
    for (std::size_t k = 0; k < keys.size(); ++k) {
      writer(key_name(i, k) + ".at_s", keys[k].at_s);
      writer(key_name(i, k) + ".X_WO", keys[k].X_WO);
    }
  }
  return std::move(writer.numbers());
}

tl::expected<RecordedLoop, std::string> loop_in(codecs::NumberReader& read) {
  RecordedLoop loop;
  each_field(loop, read);
  for (const Settled& settled : kSettled) {
    double value = settled.value;
    read(settled.name, value);
    if (value != settled.value)
      return tl::unexpected(
          fmt::format("it was recorded with {} = {}, which is always {} now", settled.name, value, settled.value));
  }
  std::uint32_t moving = 0;
  read("moving", moving);
  if (moving > codecs::kMostNames) return tl::unexpected(std::string("there are too many scripts"));
  for (std::size_t i = 0; i < moving; ++i) {
    const std::string name = "moving." + std::to_string(i);
    std::uint32_t object = 0, keys = 0;
    bool repeats = false;
    read(name + ".object", object), read(name + ".repeats", repeats), read(name + ".keys", keys);
    if (keys > motion::kMostKeyframes) return tl::unexpected(name + ": a script of so many keys is none");
    std::vector<motion::Keyframe> script(keys);
    for (std::size_t k = 0; k < keys; ++k) {
      read(key_name(i, k) + ".at_s", script[k].at_s);
      read(key_name(i, k) + ".X_WO", script[k].X_WO);
    }
    const auto afterwards = repeats ? motion::Afterwards::kRepeats : motion::Afterwards::kStays;
    if (const auto why = motion::fault_of(script, afterwards)) return tl::unexpected(name + ": " + *why);
    loop.settings.moving.push_back({object, motion::ScriptedMotion(script, afterwards)});
  }
  if (const char* why = fault_of(loop)) return tl::unexpected(std::string("a loop's settings: ") + why);
  return loop;
}

codecs::Numbers numbers_of(const TickInputs& inputs) {
  codecs::NumberWriter writer;
  each_input(inputs, writer);
  return std::move(writer.numbers());
}

TickInputs inputs_in(const codecs::Stream& stream, const codecs::Record& record) {
  TickInputs inputs;
  codecs::NumberReader read(stream.inputs, record.inputs);
  each_input(inputs, read);
  return inputs;
}

codecs::Outputs outputs_of(HapticLoop& loop) {
  TickRecord record;
  (void)loop.records().pop(record);
  return {output("time_ns", record.time_ns),
          output("rtt_ms", record.rtt_ms),
          output("pairs", record.pairs),
          output("rung", record.rung),
          output("is_resting", record.is_resting),
          output("handle's image X_WI", record.X_WI),
          output("local model's contacts that press", record.contacts),
          output("local model's deepest depth_max_m", record.depth_max_m),
          output("contacts by outline", record.by_outline),
          output("outline_off_m", record.outline_off_m),
          output("contacts' force F_contact_To_W", record.F_contact_To_W),
          output("contact_energy_J", record.contact_energy_J),
          output("tool's pose X_WT", record.X_WT),
          output("tool's twist V_WT_W", loop.tool().V_WT_W),
          output("coupling_energy_J", record.coupling_energy_J),
          output("tank_J", record.tank_J),
          output("contact_port_J", record.contact_port_J),
          output("script_work_J", record.script_work_J),
          output("hand's force F_hand_W", record.F_hand_W),
          output("masked_torque_Nm", record.masked_torque_Nm),
          output("state", record.state),
          output("fault", loop.fault()),
          output("sets_out_of_order", loop.sets_out_of_order()),
          output("ticks_spared", loop.ticks_spared()),
          output("truncations", loop.local_model().truncations())};
}

}  // namespace farfeel::master_station
