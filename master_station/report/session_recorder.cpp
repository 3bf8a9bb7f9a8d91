#include "master_station/report/session_recorder.h"

#include <chrono>
#include <cmath>
#include <tuple>

namespace farfeel::master_station {
namespace {

constexpr std::chrono::milliseconds kDrainPeriod{20};

std::tuple<std::uint32_t, double> worth(const TickRecord& tick) {
  return {tick.contacts, glm::length(tick.F_hand_W.force_N)};
}

}  // namespace

tl::expected<std::unique_ptr<SessionRecorder>, ReportError> SessionRecorder::start(
    const std::string& csv_path, realtime::SpscQueue<TickRecord>& ticks, ContactWitness& witness) {
  auto csv = SessionCsv::create(csv_path);
  if (!csv) return tl::unexpected(csv.error());
  return std::unique_ptr<SessionRecorder>(new SessionRecorder(*std::move(csv), ticks, witness));
}

SessionRecorder::SessionRecorder(SessionCsv csv, realtime::SpscQueue<TickRecord>& ticks, ContactWitness& witness)
    : csv_(std::move(csv)),
      ticks_(ticks),
      witness_(witness),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

SessionRecorder::~SessionRecorder() = default;

TickRecord SessionRecorder::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void SessionRecorder::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    drain();
    std::this_thread::sleep_for(kDrainPeriod);
  }
}

void SessionRecorder::drain() {
  TickRecord tick;
  bool any = false;
  while (ticks_.pop(tick)) {
    any = true;
    csv_.append(tick);
    statistics_.add(tick);
  }
  if (!any) return;
  // The witness shows the contacts as they are now: only the newest tick may be paired with them.
  const contact::ContactSet& contacts = witness_.newest();
  if (best_.contacts.count == 0 || (contacts.count > 0 && worth(tick) > worth(best_.tick))) best_ = {tick, contacts};
  const std::lock_guard lock(mutex_);
  if (std::isnan(tick.rtt_ms)) tick.rtt_ms = newest_.rtt_ms;
  newest_ = tick;
}

tl::expected<void, ReportError> SessionRecorder::finish() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  drain();
  return csv_.close();
}

}  // namespace farfeel::master_station
