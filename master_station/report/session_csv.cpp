#include "master_station/report/session_csv.h"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "codecs/text/whole_file.h"

namespace farfeel::master_station {
namespace {

constexpr std::string_view kColumns =
    "time_s,state,rung,contacts,pairs,depth_max_m,"
    "hand_force_x_N,hand_force_y_N,hand_force_z_N,hand_torque_x_Nm,hand_torque_y_Nm,hand_torque_z_Nm,"
    "contact_force_x_N,contact_force_y_N,contact_force_z_N,"
    "contact_torque_x_Nm,contact_torque_y_Nm,contact_torque_z_Nm,"
    "handle_x_m,handle_y_m,handle_z_m,handle_qw,handle_qx,handle_qy,handle_qz,"
    "tool_x_m,tool_y_m,tool_z_m,tool_qw,tool_qx,tool_qy,tool_qz,"
    "rtt_ms,wake_us,work_us,ticks_missed,coupling_energy_J,contact_energy_J,tank_J,contact_port_J,device_observer_J,"
    "script_work_J\n";

using Row = fmt::memory_buffer;

void cell(Row& row, double value) {
  if (std::isfinite(value)) fmt::format_to(std::back_inserter(row), FMT_COMPILE("{:.7g}"), value);
  row.push_back(',');
}
void cells(Row& row, const glm::dvec3& v) {
  cell(row, v.x);
  cell(row, v.y);
  cell(row, v.z);
}
void cells(Row& row, const spatial::Pose& X) {
  cells(row, X.p);
  cell(row, X.R.w);
  cell(row, X.R.x);
  cell(row, X.R.y);
  cell(row, X.R.z);
}

std::uint64_t stride_at(std::uint64_t seen, int every_nth_tick) {
  if (every_nth_tick > 0) return static_cast<std::uint64_t>(every_nth_tick);
  return std::uint64_t{1} << std::bit_width(seen / SessionCsv::kWhole);
}

}  // namespace

SessionCsv::SessionCsv(std::string path, std::unique_ptr<std::FILE, Close> file, int every_nth_tick)
    : path_(std::move(path)), file_(std::move(file)), every_nth_tick_(every_nth_tick) {}

tl::expected<SessionCsv, ReportError> SessionCsv::create(const std::string& path, int every_nth_tick) {
  std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "we"));
  if (!file) return tl::unexpected(ReportError{fmt::format("could not create {}: {}", path, std::strerror(errno))});
  std::setvbuf(file.get(), nullptr, _IOFBF, 64 * 1024);
  std::fwrite(kColumns.data(), 1, kColumns.size(), file.get());
  return SessionCsv(path, std::move(file), every_nth_tick);
}

void SessionCsv::append(const TickRecord& tick) {
  const bool has_changed = tick.state != std::exchange(state_, tick.state);
  if (has_changed && tick.state == LoopState::kFault) {
    for (Waiting& before : waiting_) before.is_kept = true;
    whole_until_ = seen_ + kAround;
  }
  const bool is_kept = has_changed || seen_ < whole_until_ || seen_ % stride_at(seen_, every_nth_tick_) == 0;
  ++seen_;
  waiting_.push_back({is_kept, tick});
  write_until(kAround);
}

// Rows go in their order: behind one that waits all others wait.
void SessionCsv::write_until(std::size_t waiting) {
  for (; !waiting_.empty() && (waiting_.front().is_kept || waiting_.size() > waiting); waiting_.pop_front())
    if (waiting_.front().is_kept) write(waiting_.front().tick);
}

void SessionCsv::write(const TickRecord& tick) {
  Row row;
  fmt::format_to(std::back_inserter(row), FMT_COMPILE("{:.6f},{},{},{},{},"), static_cast<double>(tick.time_ns) * 1e-9,
                 name(tick.state), tick.rung, tick.contacts, tick.pairs);
  cell(row, tick.depth_max_m);
  cells(row, tick.F_hand_W.force_N);
  cells(row, tick.F_hand_W.torque_Nm);
  cells(row, tick.F_contact_To_W.force_N);
  cells(row, tick.F_contact_To_W.torque_Nm);
  cells(row, tick.X_WI);
  cells(row, tick.X_WT);
  cell(row, tick.rtt_ms);
  cell(row, tick.wake_us);
  cell(row, tick.work_us);
  cell(row, static_cast<double>(tick.ticks_missed));
  cell(row, tick.coupling_energy_J);
  cell(row, tick.contact_energy_J);
  cell(row, tick.tank_J);
  cell(row, tick.contact_port_J);
  cell(row, tick.device_observer_J);
  cell(row, tick.script_work_J);
  row[row.size() - 1] = '\n';  // in place of the last comma
  if (std::fwrite(row.data(), 1, row.size(), file_.get()) != row.size() && first_error_ == 0) first_error_ = errno;
}

tl::expected<void, ReportError> SessionCsv::close() {
  if (!file_) return {};
  write_until(0);
  if (std::fflush(file_.get()) != 0 && first_error_ == 0) first_error_ = errno;
  file_.reset();
  if (first_error_ != 0) return tl::unexpected(ReportError{codecs::why_not_written("all of " + path_, first_error_)});
  return {};
}

}  // namespace farfeel::master_station
