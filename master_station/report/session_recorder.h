// The recorder's thread: takes ticks out of the loop's queue, writes them down, adds them up, and remembers the moment
// worth a picture.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <tl/expected.hpp>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/realtime/spsc_queue.h"
#include "master_station/haptic_loop/tick_record.h"
#include "master_station/report/contact_witness.h"
#include "master_station/report/session_csv.h"
#include "master_station/report/tick_sink.h"
#include "master_station/report/tick_statistics.h"

namespace farfeel::master_station {

/// The tool and its contacts at one tick.
struct Moment {
  TickRecord tick;
  contact::ContactSet contacts;
};

class SessionRecorder {
 public:
  static constexpr std::chrono::milliseconds kDrain{8};  ///< two of these are a picture's time at 60 Hz
  /// Writes `csv_path` as it goes. The queue, the witness and the sink, if any, must outlive the recorder.
  [[nodiscard]] static tl::expected<std::unique_ptr<SessionRecorder>, ReportError> start(
      const std::string& csv_path, realtime::SpscQueue<TickRecord>& ticks, ContactWitness& witness,
      TickSink* sink = nullptr, int every_nth_tick = SessionCsv::kThinsItself);
  ~SessionRecorder();

  /// The newest tick, with the newest round trip known; for showing how it goes. Any thread.
  [[nodiscard]] TickRecord newest() const;
  /// Takes what is left in the queue and ends the thread. An error if something did not reach the file; what was summed
  /// up has all ticks anyway.
  [[nodiscard]] tl::expected<void, ReportError> finish();

  // After finish():
  [[nodiscard]] const TickStatistics& statistics() const { return statistics_; }
  /// The moment with the most pressing contacts and, among those, the most force; before any contact, the last tick.
  [[nodiscard]] const Moment& best_moment() const { return best_; }

 private:
  SessionRecorder(SessionCsv csv, realtime::SpscQueue<TickRecord>& ticks, ContactWitness& witness, TickSink* sink);
  void run(const std::stop_token&);
  void drain();
  void write_rows(const std::stop_token&);
  void write_waiting();

  SessionCsv csv_;
  realtime::SpscQueue<TickRecord>& ticks_;
  ContactWitness& witness_;
  TickStatistics statistics_;
  Moment best_;
  mutable std::mutex mutex_;  // of newest_
  TickRecord newest_;
  TickSink* sink_;
  std::mutex rows_mutex_;            // of rows_: held for a swap or a copy, never through a write
  std::vector<TickRecord> rows_;     // that wait for the file
  std::vector<TickRecord> in_hand_;  // the writing thread's
  std::uint64_t rows_lost_ = 0;
  std::jthread writing_;  // a file that does not take rows holds up this one alone
  std::jthread thread_;   // last: it ends before what it uses
};

}  // namespace farfeel::master_station
