// Whether a swing about a virtual spring dies down by itself, from its turning points, with dry friction told apart.
//
// A mass m on a spring K with viscous friction b and dry friction c, the spring's force late by t, swings half a period
// at a time about a middle that dry friction moves by c/K against its way. From one point where it stands still, at A
// to one side of the spring's middle, to the next, at A' to the other:
//     A' + c/K = r (A - c/K),    r = exp(-pi (b - K t) / (2 sqrt(K m)))
// whether it turns there or stays: A' may be negative. Friction and spring together decide what is seen; r alone what
// comes of a larger swing: r < 1 is calm. A hand that leans on the handle moves the middle by g, to one side. So
//     A' = r A - d + (1 + r) g side,    d = (1 + r) c/K,    side = +-1: where A is
// and a fit through swings of different sizes to both sides tells r, d and g apart.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace farfeel::devices {

/// The turning points of a movement, found as it goes on. Never allocates after `reserve`d length.
class TurningPoints {
 public:
  /// step_m: of the encoder; smaller movements than kNoiseSteps of it turn nothing.
  explicit TurningPoints(double step_m);
  void clear();
  /// True: the movement has turned since the last one; at() ends with where.
  bool add(double position_m);
  [[nodiscard]] std::span<const double> positions_m() const { return positions_m_; }
  [[nodiscard]] std::span<const std::size_t> at() const { return at_; }  ///< indices of positions_m
  /// Where it turned, from the sample `from` on, and where it stays if it `rests` at the end [m]. Each refined by a
  /// parabola through the samples about it.
  [[nodiscard]] std::vector<double> stops_m(std::size_t from, bool rests) const;
  /// The last `samples` of them lie closer together than noise.
  [[nodiscard]] bool rests(std::size_t samples) const;

  static constexpr double kNoiseSteps = 2;
  static constexpr double kLeastNoise_m = 2e-6;  ///< where the encoder is finer than what else trembles
  static constexpr std::size_t kSamplesMax = 1024;

 private:
  [[nodiscard]] double refined_m(std::size_t which) const;

  double noise_m_;
  std::vector<double> positions_m_;
  std::vector<std::size_t> at_;
  std::size_t extreme_ = 0;
  int direction_ = 0;  ///< of the movement: 1 up, -1 down, 0 not known yet
};

/// The fit through all swings of all trials at one stiffness.
class SwingFit {
 public:
  explicit SwingFit(double step_m) : step_m_(step_m) {}
  /// Where one trial stood still, from the spring's middle; swings shorter than least_m do not count.
  void add(std::span<const double> stops_m, double least_m);
  [[nodiscard]] std::size_t swings() const { return n_; }
  struct Result {
    double ratio;        ///< r; not finite: the swings were too alike
    double lost_m;       ///< d >= 0: friction takes, and gives nothing
    double ratio_error;  ///< standard error of r
  };
  /// At least kSwingsMin swings.
  [[nodiscard]] Result result() const;

  static constexpr std::size_t kSwingsMin = 8;

 private:
  double step_m_;
  std::size_t n_ = 0;
  glm::dmat3 xx_{0};  ///< sums of products of (A, 1, side)
  glm::dvec3 xy_{0};  ///< and with A'
  double yy_ = 0;
};

}  // namespace farfeel::devices
