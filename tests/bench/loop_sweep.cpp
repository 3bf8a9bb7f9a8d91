#include "tests/bench/loop_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "tests/bench/on_all_cores.h"

namespace farfeel::bench {
namespace {

using local_model::Rung;

constexpr double kStart_m = -0.015;
constexpr double kBurst = 5;
constexpr std::array kRungs{Rung::kHeldWrench, Rung::kLinear, Rung::kQuadratic, Rung::kTiles};

}  // namespace

transport::LinkSpec LoopCell::link() const {
  transport::LinkSpec link;
  link.round_trip_ns = std::llround(1e6 * rtt_ms);
  link.jitter_ns = std::llround(1e6 * jitter_ms);
  link.loss = loss;
  link.burst = loss > 0 ? kBurst : 1;
  return link;
}

std::string LoopCell::words() const {
  return fmt::format("{}, {:.0f} Hz, rtt {:.0f} ms, jitter {:.0f} ms, loss {:.0f} %, {}", local_model::name(rung),
                     tick_hz, rtt_ms, jitter_ms, 100 * loss, scene->name());
}

SpectrumError LoopCell::spectrum() const {
  return spectrum_error(closed.contact, truth->contact, std::min(1000.0, 0.4 * tick_hz) + 1);
}

LoopGrid full_grid() {
  return {{1000, 2000, 5000},
          {{0, 0, 0}, {10, 0, 0}, {50, 0, 0}, {100, 0, 0}, {200, 0, 0}, {100, 10, 0}, {100, 10, 0.02}},
          strokes_of_every_speed()};
}

LoopGrid quick_grid() {
  return {{1000}, {{0, 0, 0}, {100, 0, 0}, {100, 10, 0.02}}, {{0.1, 0.030, 2}, {0.3, 0.036, 1}}};
}

LoopSweep sweep(std::span<const std::unique_ptr<StrokedScene>> scenes, const LoopGrid& grid,
                const std::function<void(std::size_t, std::size_t)>& told) {
  const std::size_t rates = grid.rates_hz.size();
  const HandProgram program{grid.strokes, kStart_m};
  LoopSweep all;
  std::vector<std::unique_ptr<ReplayTruth>> paths(scenes.size());
  all.truths.resize(scenes.size() * rates);
  std::vector<std::size_t> path_of, truth_of;  // of each cell
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    for (const Rung rung : kRungs) {
      for (std::size_t r = 0; r < rates; ++r) {
        for (const LoopGrid::Link& link : grid.links) {
          LoopCell cell;
          cell.scene = scenes[s].get();
          cell.rung = rung;
          cell.tick_hz = grid.rates_hz[r];
          cell.rtt_ms = link.rtt_ms, cell.jitter_ms = link.jitter_ms, cell.loss = link.loss;
          if (cell.words().find(grid.only) == std::string::npos) continue;
          all.cells.push_back(cell);
          path_of.push_back(s);
          truth_of.push_back(s * rates + r);
        }
      }
    }
  }
  const auto is_wanted = [](const std::vector<std::size_t>& by_cell, std::size_t i) {
    return std::find(by_cell.begin(), by_cell.end(), i) != by_cell.end();
  };
  on_all_cores(scenes.size() * (rates + 1), [&](std::size_t i) {
    const std::size_t s = i / (rates + 1), r = i % (rates + 1), truth = s * rates + r;
    if (r == rates) {
      if (is_wanted(path_of, s)) paths[s] = std::make_unique<ReplayTruth>(*scenes[s], grid.strokes, kStart_m);
    } else if (is_wanted(truth_of, truth)) {
      all.truths[truth] = std::make_unique<ClosedLoop>(stroke_on_truth(*scenes[s], program, grid.rates_hz[r]));
    }
  });
  std::mutex telling;
  std::size_t done = 0;
  on_all_cores(all.cells.size(), [&](std::size_t i) {
    LoopCell& cell = all.cells[i];
    cell.truth = all.truths[truth_of[i]].get();
    cell.replayed = replay(*paths[path_of[i]], cell.rung, cell.tick_hz, cell.link());
    cell.closed = stroke_through_link(*cell.scene, program, cell.rung, grid.contact, cell.tick_hz, cell.link());
    const std::lock_guard lock(telling);
    told(++done, all.cells.size());
  });
  return all;
}

}  // namespace farfeel::bench
