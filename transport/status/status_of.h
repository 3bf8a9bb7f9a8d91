// A link's status from what its lanes count and measure.
#pragma once

#include "haptic_core/realtime/histogram.h"
#include "transport/bulk/bulk_lane.h"
#include "transport/lane/arrival_meter.h"
#include "transport/lane/handshake_server.h"
#include "transport/lane/sealed_lane.h"
#include "transport/status/link_status.h"

namespace farfeel::transport {

[[nodiscard]] DelayStatus delay_status(const realtime::Histogram&);
[[nodiscard]] BulkStatus bulk_status(const BulkLane&);
[[nodiscard]] HandshakeStatus handshake_status(const HandshakeServer::Counters&);
[[nodiscard]] double silent_ms(std::int64_t heard_ns, std::int64_t now_ns);  ///< heard_ns 0: never

// What arrived; `sent` and what is not told here stay as they are.
void tell(DirectionStatus&, const LaneCounters&);
void tell(DirectionStatus&, const LaneRejects&);
void tell(DirectionStatus&, const ArrivalMeter&);

}  // namespace farfeel::transport
