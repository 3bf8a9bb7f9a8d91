// Strokes to and fro at several speeds, with reversals that a hand can make: the path that every rung is judged on.
#pragma once

#include <vector>

namespace farfeel::bench {

struct Stroke {
  double speed_m_s;  ///< between the reversals
  double length_m;   ///< of each
  int count;         ///< to, fro, to, ...
};

/// 10 to 300 mm/s over at most 36 mm.
[[nodiscard]] std::vector<Stroke> strokes_of_every_speed();

class StrokePath {
 public:
  /// The path starts, and pauses, at u = start_m. Reversals take kReversal_s.
  StrokePath(const std::vector<Stroke>& strokes, double start_m);

  /// Where the path is: at start_m before 0, at its end after length_s().
  [[nodiscard]] double at_m(double t_s) const;
  [[nodiscard]] double length_s() const { return legs_.empty() ? 0 : legs_.back().end_s; }

  static constexpr double kReversal_s = 0.03;  ///< half of it speeds up, half slows down

 private:
  struct Leg {
    double end_s, duration_s, from_m, to_m, speed_m_s;
  };
  double start_m_;
  std::vector<Leg> legs_;
};

}  // namespace farfeel::bench
