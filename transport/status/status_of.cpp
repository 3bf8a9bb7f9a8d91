#include "transport/status/status_of.h"

namespace farfeel::transport {

DelayStatus delay_status(const realtime::Histogram& times) {
  DelayStatus status;
  status.samples = times.count();
  if (status.samples == 0) return status;
  status.least_ms = 1e-6 * static_cast<double>(times.quantile_ns(0));
  status.p50_ms = 1e-6 * static_cast<double>(times.quantile_ns(0.5));
  status.p99_ms = 1e-6 * static_cast<double>(times.quantile_ns(0.99));
  status.most_ms = 1e-6 * static_cast<double>(times.max_ns());
  return status;
}

BulkStatus bulk_status(const BulkLane& bulk) {
  const Pacer& pacer = bulk.pacer();
  BulkStatus status;
  status.message_bytes = bulk.path_limit().message_bytes();
  if (pacer.round_trip_ns() == 0) return status;
  status.least_round_trip_ms = 1e-6 * static_cast<double>(pacer.round_trip_ns());
  status.queue_ms = 1e-6 * static_cast<double>(pacer.queue_ns());
  status.delivered_mbit = 8e-6 * pacer.bytes_per_s();
  return status;
}

HandshakeStatus handshake_status(const HandshakeServer::Counters& c) {
  return {c.initiations, c.welcomed + c.repeated, c.cookies,
          c.busy + c.other_version + c.other_suite + c.wrong_key + c.unknown + c.expired + c.replayed,
          c.malformed + c.forged};
}

double silent_ms(std::int64_t heard_ns, std::int64_t now_ns) {
  return heard_ns == 0 ? kUnmeasured : 1e-6 * static_cast<double>(now_ns - heard_ns);
}

void tell(DirectionStatus& status, const LaneCounters& counters) {
  status.arrived = counters.received;
  status.lost = counters.lost;
  status.late = counters.late;
  status.duplicate = counters.duplicate;
  status.bursts = counters.bursts;
  status.longest_burst = counters.longest_burst;
}

void tell(DirectionStatus& status, const LaneRejects& rejects) {
  status.malformed = rejects.malformed;
  status.unknown_keys = rejects.unknown_index;
  status.forged = rejects.forged;
}

void tell(DirectionStatus& status, const ArrivalMeter& meter) {
  status.arrived_bytes = meter.bytes();
  status.congestion_marks = meter.congestion_marks();
  status.dscp = meter.dscp();
  status.one_way_excess = delay_status(meter.excess());
  if (status.one_way_excess.samples > 1) status.jitter_ms = 1e-3 * meter.jitter_us();
}

}  // namespace farfeel::transport
