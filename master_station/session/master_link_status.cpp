// All that is known of the link, at the operator's end.
#include "master_station/session/master_session.h"
#include "transport/status/status_of.h"

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kTell_ns = 250'000'000;  // for a person who watches

}  // namespace

void MasterSession::tell_status(std::int64_t now_ns) {
  if (!tell_status_ || now_ns - told_ns_ < kTell_ns) return;
  told_ns_ = now_ns;
  tell_status_(link_status(now_ns));
}

transport::LinkStatus MasterSession::link_status(std::int64_t now_ns) {
  const HapticLane::Counters& counters = lane_.counters();
  const HapticLane::Meters& meters = lane_.meters();
  const codecs::SlaveStatus there = told_by_slave();
  transport::LinkStatus status;
  status.role = "master";
  status.uptime_s = 1e-9 * static_cast<double>(now_ns - began_ns_);
  status.peer = transport::to_string(relayed_ ? relayed_->path(transport::LaneKind::kHaptic) : slave_);
  status.peer_name = "the slave";
  status.cipher = transport::name_of(client_.bulk_greeting().suite());
  status.trouble = client_.trouble(now_ns);
  status.sessions = client_.counters().sessions;

  transport::LaneStatus& haptic = status.haptic;
  haptic.is_used = lane_.used_ns() > 0;
  haptic.silent_ms = transport::silent_ms(lane_.heard_ns(), now_ns);
  haptic.round_trip = transport::delay_status(meters.round_trips);
  if (status_ && status_->poses_received > 0)
    haptic.peer_waiting = {1e-3 * status_->waiting_us_p50, 1e-3 * status_->waiting_us_p99,
                           1e-3 * status_->waiting_us_max, status_->poses_received};
  haptic.rekeys = meters.handshakes;
  haptic.migrations = haptic_moves_;
  transport::tell(haptic.up, meters.up);  // what the answers tell of the poses' way
  haptic.up.sent = counters.poses_sent;
  haptic.up.sent_bytes = meters.sent_bytes;
  haptic.up.arrived = there.poses_received;
  haptic.up.lost = there.poses_lost;
  haptic.up.late = there.poses_late;
  haptic.up.duplicate = there.poses_duplicate;
  haptic.up.unusable = there.poses_malformed;
  transport::tell(haptic.down, counters.contact_sets);
  transport::tell(haptic.down, meters.rejects);
  transport::tell(haptic.down, meters.down);
  haptic.down.sent = there.contacts_sent;
  haptic.down.unusable = counters.malformed;

  transport::LaneStatus& bulk = status.bulk;
  const transport::LaneCounters counted = client_.bulk_seal().counters();
  bulk.is_used = true;
  bulk.silent_ms = transport::silent_ms(client_.bulk_heard_ns(), now_ns);
  bulk.rekeys = client_.counters().bulk_handshakes;
  bulk.migrations = bulk_moves_;
  bulk.longest_bytes = longest_bulk_bytes_;
  bulk.up.sent = counted.sent;
  transport::tell(bulk.down, counted);
  transport::tell(bulk.down, client_.bulk_seal().rejects());
  transport::tell(bulk.down, bulk_meter_);
  status.bulk_pace = transport::bulk_status(client_.bulk());
  return status;
}

}  // namespace farfeel::master_station
