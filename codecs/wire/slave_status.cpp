#include "codecs/wire/slave_status.h"

#include <cmath>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {

std::size_t write(const SlaveStatus& status, std::span<std::byte> to) noexcept {
  transport::ByteWriter w(to);
  for (const double v : {status.contact_hz, status.contact_us_p50, status.contact_us_p99, status.contact_us_max,
                         status.waiting_us_p50, status.waiting_us_p99, status.waiting_us_max})
    w.f32(v);
  for (const std::uint64_t v : {status.poses_received, status.poses_lost, status.poses_late, status.poses_duplicate,
                                status.poses_malformed, status.contacts_sent, status.contacts_left_out})
    w.u64(v);
  return w.ok() ? w.size() : 0;
}

Fault read(std::span<const std::byte> payload, SlaveStatus& out) noexcept {
  if (payload.size() != kSlaveStatusBytes) return Fault::kLength;
  transport::ByteReader r(payload);
  SlaveStatus status;
  for (double* v : {&status.contact_hz, &status.contact_us_p50, &status.contact_us_p99, &status.contact_us_max,
                    &status.waiting_us_p50, &status.waiting_us_p99, &status.waiting_us_max}) {
    *v = r.f32();
    if (!std::isfinite(*v)) return Fault::kNotFinite;
    if (*v < 0) return Fault::kRange;
  }
  for (std::uint64_t* v : {&status.poses_received, &status.poses_lost, &status.poses_late, &status.poses_duplicate,
                           &status.poses_malformed, &status.contacts_sent, &status.contacts_left_out})
    *v = r.u64();
  out = status;
  return Fault::kNone;
}

}  // namespace farfeel::codecs
