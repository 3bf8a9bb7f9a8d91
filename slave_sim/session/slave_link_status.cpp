// All that is known of the link, at the remote end.
#include "slave_sim/session/slave_session.h"
#include "transport/status/status_of.h"

namespace farfeel::slave_sim {

transport::LinkStatus SlaveSession::link_status(std::int64_t now_ns) {
  const ContactLane::Report& report = lane_.report();
  transport::LinkStatus status;
  status.role = "slave";
  status.uptime_s = 1e-9 * static_cast<double>(now_ns - began_ns_);
  status.local = transport::to_string(local_);
  status.sessions = server_.counters().sessions;
  status.handshakes = transport::handshake_status(server_.handshakes());
  const auto& session = server_.session();
  if (!session) return status;
  status.peer_name = session->operator_name;
  if (const auto& master = server_.bulk_address()) status.peer = transport::to_string(*master);
  if (is_silent_) status.trouble = "nothing was heard from the master for 2 s; it may come back";

  transport::LaneStatus& haptic = status.haptic;
  if (report.session == live_) {
    haptic.is_used = lane_.heard_ns() > 0;
    haptic.silent_ms = transport::silent_ms(lane_.heard_ns(), now_ns);
    haptic.peer_waiting = transport::delay_status(report.waiting);
    haptic.rekeys = report.handshakes;
    haptic.migrations = report.moves;
    transport::tell(haptic.up, report.poses);
    transport::tell(haptic.up, report.rejects);
    transport::tell(haptic.up, report.up);
    haptic.up.unusable = report.malformed;
    haptic.down.sent = report.sent;
    haptic.down.sent_bytes = lane_.sent_bytes();
  }

  transport::LaneStatus& bulk = status.bulk;
  const transport::LaneCounters counted = server_.bulk_seal().counters();
  bulk.is_used = true;
  bulk.silent_ms = transport::silent_ms(bulk_heard_ns_, now_ns);
  bulk.rekeys = server_.counters().bulk_handshakes;
  bulk.migrations = server_.bulk_moves();
  transport::tell(bulk.up, counted);
  transport::tell(bulk.up, server_.bulk_seal().rejects());
  transport::tell(bulk.up, bulk_meter_);
  bulk.down.sent = counted.sent;
  bulk.down.sent_bytes = server_.bulk().counters().sent_bytes;
  bulk.down.lost = server_.bulk().counters().lost;
  status.bulk_pace = transport::bulk_status(server_.bulk());
  return status;
}

}  // namespace farfeel::slave_sim
