#include "master_station/report/session_recorder.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <tuple>

namespace farfeel::master_station {
namespace {

constexpr std::chrono::milliseconds kWriting{20};
constexpr std::size_t kMostRows = 16'384;  // 32 MB, 16 s at 1 kHz: a disk that stalls for longer costs rows, not ticks

std::tuple<std::uint32_t, double> worth(const TickRecord& tick) {
  return {tick.contacts, glm::length(tick.F_hand_W.force_N)};
}

}  // namespace

tl::expected<std::unique_ptr<SessionRecorder>, ReportError> SessionRecorder::start(
    const std::string& csv_path, realtime::SpscQueue<TickRecord>& ticks, ContactWitness& witness, TickSink* sink,
    int every_nth_tick) {
  auto csv = SessionCsv::create(csv_path, every_nth_tick);
  if (!csv) return tl::unexpected(csv.error());
  return std::unique_ptr<SessionRecorder>(new SessionRecorder(*std::move(csv), ticks, witness, sink));
}

SessionRecorder::SessionRecorder(SessionCsv csv, realtime::SpscQueue<TickRecord>& ticks, ContactWitness& witness,
                                 TickSink* sink)
    : csv_(std::move(csv)),
      ticks_(ticks),
      witness_(witness),
      sink_(sink),
      writing_([this](const std::stop_token& stop) { write_rows(stop); }),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

SessionRecorder::~SessionRecorder() = default;

TickRecord SessionRecorder::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void SessionRecorder::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    drain();
    std::this_thread::sleep_for(kDrain);
  }
}

void SessionRecorder::drain() {
  TickRecord tick;
  bool any = false;
  while (ticks_.pop(tick)) {
    any = true;
    if (const std::lock_guard lock(rows_mutex_); rows_.size() < kMostRows)
      rows_.push_back(tick);
    else
      ++rows_lost_;
    if (sink_) sink_->add(tick);
    statistics_.add(tick);
  }
  if (sink_) sink_->flush();
  if (!any) return;
  // The witness shows the contacts as they are now: only the newest tick may be paired with them.
  const contact::ContactSet& contacts = witness_.newest();
  if (best_.contacts.count == 0 || (contacts.count > 0 && worth(tick) > worth(best_.tick))) best_ = {tick, contacts};
  const std::lock_guard lock(mutex_);
  if (std::isnan(tick.rtt_ms)) tick.rtt_ms = newest_.rtt_ms;
  newest_ = tick;
}

void SessionRecorder::write_rows(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    write_waiting();
    std::this_thread::sleep_for(kWriting);
  }
}

void SessionRecorder::write_waiting() {
  in_hand_.clear();
  {
    const std::lock_guard lock(rows_mutex_);
    std::swap(rows_, in_hand_);
  }
  for (const TickRecord& tick : in_hand_) csv_.append(tick);
}

tl::expected<void, ReportError> SessionRecorder::finish() {
  for (std::jthread* thread : {&thread_, &writing_}) {
    thread->request_stop();
    if (thread->joinable()) thread->join();
  }
  drain();
  write_waiting();
  const auto closed = csv_.close();
  if (!closed || rows_lost_ == 0) return closed;
  return tl::unexpected(ReportError{fmt::format(
      "session.csv lacks {} ticks: the disk did not take them in time; write to a faster one with --out", rows_lost_)});
}

}  // namespace farfeel::master_station
