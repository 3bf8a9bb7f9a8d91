// Who else wants to see the ticks of a session, beside its files: a live view.
#pragma once

#include "master_station/haptic_loop/tick_record.h"

namespace farfeel::master_station {

/// Called by the recorder's thread alone, every SessionRecorder::kDrain. Must not wait for anybody.
class TickSink {
 public:
  virtual ~TickSink() = default;
  virtual void add(const TickRecord&) = 0;
  /// All ticks so far were given to add().
  virtual void flush() = 0;
};

}  // namespace farfeel::master_station
