#include "codecs/tile/smooth_basis.h"

#include <algorithm>
#include <cmath>

namespace farfeel::codecs {
namespace {

constexpr std::size_t kSide = geometry::kTileSide;

using Basis = std::array<std::array<double, kSide>, kSide>;  // [degree][point]

/// Each is the one before times the coordinate, less what those before already say (twice, for the rounding).
Basis gram_polynomials() {
  Basis P{};
  for (std::size_t k = 0; k < kSide; ++k) {
    for (std::size_t i = 0; i < kSide; ++i)
      P[k][i] = k == 0 ? 1 : P[k - 1][i] * (static_cast<double>(i) - 0.5 * (kSide - 1));
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t j = 0; j < k; ++j) {
        double shared = 0;
        for (std::size_t i = 0; i < kSide; ++i) shared += P[k][i] * P[j][i];
        for (std::size_t i = 0; i < kSide; ++i) P[k][i] -= shared * P[j][i];
      }
    }
    double squares = 0;
    for (const double value : P[k]) squares += value * value;
    for (double& value : P[k]) value /= std::sqrt(squares);
  }
  return P;
}

const Basis& basis() {
  static const Basis P = gram_polynomials();
  return P;
}

}  // namespace

TileNumbers smooth_spectrum(const TileNumbers& values) noexcept {
  const Basis& P = basis();
  TileNumbers down{}, spectrum{};  // down: polynomials down the columns, still points along the rows
  for (std::size_t l = 0; l < kSide; ++l) {
    for (std::size_t j = 0; j < kSide; ++j) {
      for (std::size_t i = 0; i < kSide; ++i) down[l * kSide + i] += P[l][j] * values[j * kSide + i];
    }
    for (std::size_t k = 0; k < kSide; ++k) {
      double sum = 0;
      for (std::size_t i = 0; i < kSide; ++i) sum += P[k][i] * down[l * kSide + i];
      spectrum[l * kSide + k] = sum;
    }
  }
  return spectrum;
}

TileNumbers values_of_spectrum(const TileNumbers& spectrum, std::size_t most_degree) noexcept {
  const Basis& P = basis();
  TileNumbers values{};
  for (std::size_t l = 0; l <= std::min(most_degree, kSide - 1); ++l) {
    std::array<double, kSide> along{};
    for (std::size_t k = 0; k <= std::min(most_degree - l, kSide - 1); ++k) {
      for (std::size_t i = 0; i < kSide; ++i) along[i] += spectrum[l * kSide + k] * P[k][i];
    }
    for (std::size_t j = 0; j < kSide; ++j) {
      for (std::size_t i = 0; i < kSide; ++i) values[j * kSide + i] += P[l][j] * along[i];
    }
  }
  return values;
}

}  // namespace farfeel::codecs
