// What a program is at while it bakes or loads: on a terminal one line, written over; in a log a line now and then.
//
// A stage that says nothing for long is told again with the time so far, by a thread of this class: what computes looks
// at no clock.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace farfeel::slave_sim {

/// Any thread may call; the functions given are called from it and from another, never from both at once.
class ProgressLine {
 public:
  struct Out {
    std::FILE* to = stdout;
    std::optional<bool> is_terminal;              ///< nothing: as `to` is
    std::function<void(const std::string&)> log;  ///< a line of a log; null: printed to `to`
    std::chrono::milliseconds again{8000};        ///< a log hears of a stage again after so long
  };

  ProgressLine() : ProgressLine(Out{}) {}
  explicit ProgressLine(Out);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const std::string& stage) { show(stage, {}); }
  /// done: in [0, 1].
  void show(const std::string& stage, std::optional<double> done);
  /// Nothing more is shown, and a terminal's line is gone.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kStage{5};    // a log hears of the next stage no sooner after the last
  static constexpr std::chrono::seconds kRedrawn{1};  // a terminal's line

  [[nodiscard]] std::string words(bool with_time) const;
  void print(bool with_time);
  void watch(const std::stop_token&);

  Out out_;
  bool is_terminal_;
  Clock::time_point started_ = Clock::now(), told_ = started_;
  std::string stage_;  // empty: nothing is under way
  std::optional<double> done_;
  std::mutex mutex_;
  std::condition_variable_any never_;
  std::jthread again_;
};

}  // namespace farfeel::slave_sim
