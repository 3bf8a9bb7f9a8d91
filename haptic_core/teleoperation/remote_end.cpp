#include "haptic_core/teleoperation/remote_end.h"

namespace farfeel::teleoperation {

using spatial::Vector6;

LineValue RemoteEnd::answer(const LineValue& arrived, const tool::LinearResponse& contacts, double dt_s) {
  const Vector6 V = spatial::to_vector6(tool_.V_WT_W);
  if (controller_ == Controller::kWaves) {
    budget_.learn(arrived.energy_in_J);
    const Vector6 in = budget_.afforded(arrived.value, dt_s);
    if (!(dt_s > 0)) return {terminal_.out(V, in), budget_.sent_J()};
    tool::LinearResponse forces = contacts;
    forces.F_To_W -= terminal_.force(V, in);
    forces.by_twist -= terminal_.impedance().asDiagonal();
    const Vector6 out = terminal_.out(tool::step(tool_, forces, dt_s).V_moved, in);
    budget_.send(out, dt_s);
    return {out, budget_.sent_J()};
  }
  end_.learn(arrived.energy_in_J);
  if (!(dt_s > 0)) return {contacts.F_To_W, end_.energy_in_J()};
  tool_.V_WT_W = spatial::twist_from(end_.yielding_velocity(contacts.F_To_W, arrived.value, dt_s));
  tool_.X_WT = spatial::integrate(tool_.X_WT, tool_.V_WT_W, dt_s);
  return {contacts.F_To_W, end_.energy_in_J()};
}

}  // namespace farfeel::teleoperation
