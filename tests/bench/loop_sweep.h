// Every cell of the loop's measurement: rung x tick rate x link x scene.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/loop_closed.h"
#include "tests/bench/loop_replay.h"

namespace farfeel::bench {

struct LoopCell {
  const StrokedScene* scene = nullptr;
  local_model::Rung rung{};
  double tick_hz = 0, rtt_ms = 0, jitter_ms = 0, loss = 0;  ///< losses come in bursts of five
  Replayed replayed;
  ClosedLoop closed;
  const ClosedLoop* truth = nullptr;  ///< in closed loop, at the same rate

  [[nodiscard]] transport::LinkSpec link() const;
  /// Of the model's force on the tool, 20 Hz to the smaller of 1000 Hz and 0.4 of the tick rate.
  [[nodiscard]] SpectrumError spectrum() const;
  [[nodiscard]] bool is_stable() const { return bench::is_stable(closed, *truth); }
  /// "tiles, 1000 Hz, rtt 100 ms, jitter 10 ms, loss 2 %, scan"
  [[nodiscard]] std::string words() const;
};

struct LoopGrid {
  std::vector<double> rates_hz;
  struct Link {
    double rtt_ms, jitter_ms, loss;
  };
  std::vector<Link> links;
  std::vector<Stroke> strokes;
  std::string only{};                                                   ///< cells whose words contain it
  local_model::ContactLaw contact = local_model::ContactLaw::kPenalty;  ///< of the closed loop
};
[[nodiscard]] LoopGrid full_grid();
[[nodiscard]] LoopGrid quick_grid();

/// All cells on as many threads as the machine has cores; told(done, all) after each, from any thread, one at a time.
struct LoopSweep {
  std::vector<LoopCell> cells;
  std::vector<std::unique_ptr<ClosedLoop>> truths;  ///< that the cells point to
};
[[nodiscard]] LoopSweep sweep(std::span<const std::unique_ptr<StrokedScene>> scenes, const LoopGrid&,
                              const std::function<void(std::size_t, std::size_t)>& told);

}  // namespace farfeel::bench
