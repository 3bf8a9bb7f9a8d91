#include "master_station/report/session_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>

#include "master_station/haptic_loop/tick_record.h"

namespace farfeel::master_station {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::quiet_NaN();

constexpr std::array<std::string_view, 20> kPlotted = {
    "hand_force_x_N",
    "hand_force_y_N",
    "hand_force_z_N",
    "hand_torque_x_Nm",
    "hand_torque_y_Nm",
    "hand_torque_z_Nm",
    "depth_max_m",
    "contacts",
    "pairs",
    "rtt_ms",
    "wake_us",
    "work_us",
    "ticks_missed",
    "coupling_energy_J",
    "contact_energy_J",
    "tank_J",
    "device_observer_J",
    "contact_port_J",
    "script_work_J",
    "rung",
};

// fmin and fmax take the other operand when one is NaN: an empty cell does not hide its neighbours.
void merge_neighbours(std::vector<float>& values, float (*chosen)(float, float)) {
  for (std::size_t i = 0; i < values.size(); i += 2)
    values[i / 2] = i + 1 < values.size() ? chosen(values[i], values[i + 1]) : values[i];
  values.resize((values.size() + 1) / 2);
}

// Rows go into the newest bucket until it is full; when there are too many buckets, each takes in its neighbour.
class Buckets {
 public:
  Buckets(std::vector<std::string> names, std::size_t max_buckets)
      : max_buckets_(std::max<std::size_t>(max_buckets, 2)) {
    for (auto& name : names) trace_.lines.push_back({std::move(name), {}, {}});
  }

  void add(float time_s, std::uint8_t state, const std::vector<float>& values) {
    if (trace_.rows % trace_.rows_per_bucket == 0) open_bucket(time_s);
    ++trace_.rows;
    trace_.state.back() = std::max(trace_.state.back(), state);
    for (std::size_t i = 0; i < values.size(); ++i) {
      TraceLine& line = trace_.lines[i];
      line.low.back() = std::fmin(line.low.back(), values[i]);
      line.high.back() = std::fmax(line.high.back(), values[i]);
    }
  }

  [[nodiscard]] SessionTrace take() { return std::move(trace_); }

 private:
  void open_bucket(float time_s) {
    if (trace_.time_s.size() == max_buckets_) halve();
    // After halving an odd number of buckets, or in the middle of a merged one, the last bucket is still being filled.
    if (trace_.rows % trace_.rows_per_bucket != 0) return;
    trace_.time_s.push_back(time_s);
    trace_.state.push_back(0);
    for (TraceLine& line : trace_.lines) {
      line.low.push_back(kEmpty);
      line.high.push_back(kEmpty);
    }
  }

  void halve() {
    trace_.rows_per_bucket *= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < trace_.time_s.size(); i += 2, ++kept) {
      trace_.time_s[kept] = trace_.time_s[i];
      trace_.state[kept] =
          i + 1 < trace_.state.size() ? std::max(trace_.state[i], trace_.state[i + 1]) : trace_.state[i];
    }
    trace_.time_s.resize(kept);
    trace_.state.resize(kept);
    for (TraceLine& line : trace_.lines) {
      merge_neighbours(line.low, std::fmin);
      merge_neighbours(line.high, std::fmax);
    }
  }

  std::size_t max_buckets_;
  SessionTrace trace_;
};

void split(std::string_view row, std::vector<std::string_view>& cells) {
  cells.clear();
  for (;;) {
    const auto comma = row.find(',');
    cells.push_back(row.substr(0, comma));
    if (comma == std::string_view::npos) return;
    row.remove_prefix(comma + 1);
  }
}

float number(std::string_view cell) {
  float value = kEmpty;
  std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return value;
}

std::uint8_t state_number(std::string_view cell) {
  for (std::uint8_t state = 0; state < kLoopStates; ++state)
    if (cell == name(static_cast<LoopState>(state))) return state;
  return 0;
}

std::optional<std::size_t> column(const std::vector<std::string_view>& names, std::string_view wanted) {
  const auto at = std::find(names.begin(), names.end(), wanted);
  if (at == names.end()) return std::nullopt;
  return static_cast<std::size_t>(at - names.begin());
}

// A plotted quantity from a row's cells: one column, or the length of a vector of three that follow each other.
struct Source {
  std::size_t first;
  std::size_t count;
};

float value_of(const Source& source, const std::vector<std::string_view>& cells) {
  if (source.count == 1) return number(cells[source.first]);
  float squared = 0;
  for (std::size_t i = 0; i < source.count; ++i) {
    const float component = number(cells[source.first + i]);
    squared += component * component;
  }
  return std::sqrt(squared);
}

}  // namespace

tl::expected<SessionTrace, ReportError> read_session_csv(const std::string& path, std::size_t max_buckets) {
  std::ifstream file(path);
  std::string header;
  if (!file || !std::getline(file, header))
    return tl::unexpected(ReportError{fmt::format("could not read {}: give the folder a session wrote (--out)", path)});

  std::vector<std::string_view> names;
  split(header, names);
  const auto time = column(names, "time_s");
  const auto state = column(names, "state");
  if (!time || !state)
    return tl::unexpected(ReportError{fmt::format("{} has no columns time_s and state: it is no session.csv", path)});

  std::vector<std::string> line_names;
  std::vector<Source> sources;
  const auto plot = [&](std::string_view line, std::optional<std::size_t> first, std::size_t count) {
    if (!first || *first + count > names.size()) return;
    line_names.emplace_back(line);
    sources.push_back({*first, count});
  };
  for (const std::string_view name : kPlotted) plot(name, column(names, name), 1);
  plot("hand_force_N", column(names, "hand_force_x_N"), 3);
  plot("hand_torque_Nm", column(names, "hand_torque_x_Nm"), 3);

  Buckets buckets(std::move(line_names), max_buckets);
  std::vector<std::string_view> cells;
  std::vector<float> values(sources.size());
  std::string row;
  while (std::getline(file, row)) {
    const bool was_cut_short = file.eof();  // a whole row ends in a new line
    split(row, cells);
    if (was_cut_short || cells.size() != names.size()) continue;
    for (std::size_t i = 0; i < sources.size(); ++i) values[i] = value_of(sources[i], cells);
    buckets.add(number(cells[*time]), state_number(cells[*state]), values);
  }
  return buckets.take();
}

}  // namespace farfeel::master_station
