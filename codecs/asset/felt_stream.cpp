#include "codecs/asset/felt_stream.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "codecs/asset/felt_heights.h"
#include "codecs/asset/felt_triangles.h"

namespace farfeel::codecs {
namespace {

using geometry::Chart;
using geometry::HapticSurface;

// Specification constants.
constexpr std::int32_t kMostOnGrid = 1 << 20;  // whole steps that a coordinate has on its grid
constexpr std::int32_t kLeastExponent = -126;  // of a grid's step, 2^exponent m
constexpr std::int32_t kNoGrid = 127;          // the exponent of what is on none
constexpr std::int32_t kTurnSteps = 256;       // of a quaternion's x, y and z, in [-1, 1]

double step_of(std::int32_t exponent) {
  return std::ldexp(1.0, exponent);
}

bool is_on_grid(double value, double step) {
  const double steps = value / step;
  return steps == std::round(steps) && std::abs(steps) <= kMostOnGrid && !(value == 0 && std::signbit(value));
}
bool is_on_grid(const glm::dvec3& p, double step) {
  return is_on_grid(p.x, step) && is_on_grid(p.y, step) && is_on_grid(p.z, step);
}

glm::dquat quaternion_of(const std::array<std::int32_t, 3>& turn) {
  const double x = turn[0] / double{kTurnSteps}, y = turn[1] / double{kTurnSteps}, z = turn[2] / double{kTurnSteps};
  return {std::sqrt(std::max(0.0, 1 - x * x - y * y - z * z)), x, y, z};
}

/// The coarsest grid that all coordinates are on, or kNoGrid.
template <typename Points>
std::int32_t grid_of(const Points& points) {
  std::int32_t least = kNoGrid;
  for (const glm::dvec3& p : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] == 0) continue;
      int exponent = 0;
      const double mantissa = std::frexp(p[axis], &exponent);
      const auto digits = static_cast<std::uint64_t>(std::ldexp(std::abs(mantissa), 53));
      least = std::min<std::int32_t>(least, exponent - 53 + std::countr_zero(digits));
    }
  }
  if (least == kNoGrid) least = 0;
  least = std::clamp(least, kLeastExponent, 100);
  const double step = step_of(least);
  const bool are_on_it = std::all_of(points.begin(), points.end(), [&](const auto& p) { return is_on_grid(p, step); });
  return are_on_it ? least : kNoGrid;
}

/// A point as whole steps from what is expected.
template <typename Coder>
class PointModels {
 public:
  void tell(glm::dvec3& p, const glm::dvec3& expected, double step, Coder& coder) {
    std::uint64_t sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = std::round(expected[axis] / step);
      const std::int32_t from = std::abs(steps) <= 2 * kMostOnGrid ? static_cast<std::int32_t>(steps) : 0;
      std::int32_t off = Coder::kReads ? 0 : static_cast<std::int32_t>(p[axis] / step) - from;
      coder.number(off, last_, models_[static_cast<std::size_t>(axis)]);
      if (Coder::kReads) p[axis] = step * (from + off) + 0.0;
      sum += static_cast<std::uint64_t>(std::abs(off));
    }
    last_ = sum;
  }

 private:
  std::array<NumberModels, 3> models_;
  std::uint64_t last_ = 0;
};

/// What of a triangle is one of few: a neighbour's that came before it, or the next that is new, or any.
class LabelModels {
 public:
  template <typename Coder, std::size_t kLikely>
  void tell(std::uint32_t& label, const std::array<std::uint32_t, kLikely>& likely, std::size_t count, Coder& coder) {
    for (std::size_t i = 0; i < count; ++i) {
      if (std::find(likely.begin(), likely.begin() + static_cast<std::ptrdiff_t>(i), likely[i]) !=
          likely.begin() + static_cast<std::ptrdiff_t>(i))
        continue;
      bool is_it = label == likely[i];
      coder.bit(is_it, is_it_[i]);
      if (is_it) return void(label = likely[i]);
    }
    bool is_none = label == geometry::kNoChart;
    coder.bit(is_none, is_none_);
    if (is_none) return void(label = geometry::kNoChart);
    std::int32_t off = static_cast<std::int32_t>(label) - static_cast<std::int32_t>(next_);
    coder.number(off, 0, numbers_);
    if (Coder::kReads) label = static_cast<std::uint32_t>(static_cast<std::int32_t>(next_) + off);
    next_ = std::min(label, kMostFeltElements) + 1;
  }

 private:
  std::array<BitModel, 4> is_it_;
  BitModel is_none_;
  NumberModels numbers_;
  std::uint32_t next_ = 0;
};

/// For each triangle the triangles of lower number across its edges.
std::vector<geometry::Triangle> earlier_neighbours(const std::vector<geometry::Triangle>& triangles) {
  std::vector<geometry::Triangle> out;
  std::unordered_map<std::uint64_t, std::uint32_t> of_edge;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    geometry::Triangle& across = out.emplace_back(geometry::Triangle{kNoVertex, kNoVertex, kNoVertex});
    const auto key = [&](std::size_t from, std::size_t to) {
      return std::uint64_t{triangles[t][from]} << 32 | triangles[t][to];
    };
    for (std::size_t k = 0; k < 3; ++k) {
      if (const auto found = of_edge.find(key((k + 1) % 3, k)); found != of_edge.end()) across[k] = found->second;
    }
    for (std::size_t k = 0; k < 3; ++k) of_edge[key(k, (k + 1) % 3)] = t;
  }
  return out;
}

/// One end's walk over a surface and its detail, whose vectors grow as they are read.
template <typename Coder>
class Walk {
 public:
  Walk(HapticSurface& surface, geometry::TriangleMesh& detail, const FeltCounts& counts, Coder& coder)
      : surface_(surface), detail_(detail), counts_(counts), coder_(coder) {}

  [[nodiscard]] bool run() {
    return tell_mesh(surface_.coarse, counts_.vertices, counts_.triangles) && tell_labels() && tell_thickness() &&
           (counts_.detail_triangles == 0 ? tell_charts() && tell_tiles() : tell_detail());
  }

 private:
  template <typename Value>
  static Value& nth(std::vector<Value>& values, std::size_t n) {
    if constexpr (Coder::kReads) values.emplace_back();
    return values[n];
  }
  bool tell_detail() { return tell_mesh(detail_, counts_.detail_vertices, counts_.detail_triangles); }
  bool tell_mesh(geometry::TriangleMesh& mesh, std::uint32_t vertices, std::uint32_t triangles) {
    TriangleModels models(vertices);
    for (std::size_t i = 0; i < triangles; ++i) {
      if (!models.tell(nth(mesh.triangles, i), coder_) || !coder_.is_good()) return false;
    }
    return tell_positions(mesh.positions_O, models.expected());
  }
  bool tell_grid(std::int32_t& exponent) {
    coder_.number(exponent, 0, exponents_);
    return exponent >= kLeastExponent && exponent <= kNoGrid;
  }
  bool tell_positions(std::vector<glm::dvec3>& positions, const std::vector<Parallelogram>& around) {
    std::int32_t grid = Coder::kReads ? 0 : grid_of(positions);
    if (!tell_grid(grid)) return false;
    PointModels<Coder> points;
    for (std::uint32_t v = 0; v < around.size(); ++v) {
      glm::dvec3& p = nth(positions, v);
      const Parallelogram& at = around[v];
      glm::dvec3 expected = v > 0 ? positions[v - 1] : glm::dvec3(0);
      if (at.from < v && at.to < v && at.across < v)
        expected = positions[at.from] + positions[at.to] - positions[at.across];
      if (grid != kNoGrid) {
        points.tell(p, expected, step_of(grid), coder_);
      } else {
        glm::vec3 plain(p);
        coder_.plain(plain);
        if (Coder::kReads) p = glm::dvec3(plain);
      }
      if (!coder_.is_good()) return false;
    }
    return true;
  }
  bool tell_labels() {
    const std::vector<geometry::Triangle> across = earlier_neighbours(surface_.coarse.triangles);
    LabelModels charts, pieces;
    std::vector<std::uint32_t> piece_of_chart(counts_.charts, kNoVertex);
    first_of_chart_.assign(counts_.charts, kNoVertex);
    for (std::uint32_t i = 0; i < counts_.triangles; ++i) {
      std::uint32_t& chart = nth(surface_.triangle_chart, i);
      std::uint32_t& piece = nth(surface_.triangle_piece, i);
      std::array<std::uint32_t, 4> likely_chart{}, likely_piece{};
      std::size_t count = 0, piece_count = 0;
      for (const std::uint32_t other : across[i]) {
        if (other != kNoVertex) likely_chart[count++] = surface_.triangle_chart[other];
      }
      charts.tell(chart, likely_chart, count, coder_);
      const bool has_chart = chart < counts_.charts;
      if (!has_chart && chart != geometry::kNoChart) return false;
      if (has_chart && piece_of_chart[chart] != kNoVertex) likely_piece[piece_count++] = piece_of_chart[chart];
      for (const std::uint32_t other : across[i]) {
        if (other != kNoVertex) likely_piece[piece_count++] = surface_.triangle_piece[other];
      }
      pieces.tell(piece, likely_piece, piece_count, coder_);
      if (piece >= counts_.pieces || !coder_.is_good()) return false;
      if (has_chart) piece_of_chart[chart] = piece;
      if (has_chart && first_of_chart_[chart] == kNoVertex) first_of_chart_[chart] = i;
    }
    surface_.piece_count = counts_.pieces;
    return true;
  }
  /// As floats without their common zeros at the end.
  bool tell_thickness() {
    constexpr std::int32_t kFewestZeros = 8;  // what is left is a number that can be told
    std::int32_t zeros = 31;
    const auto bits_of = [](double m) { return std::bit_cast<std::uint32_t>(static_cast<float>(m)); };
    if constexpr (!Coder::kReads) {
      for (const double m : surface_.piece_thickness_m)
        zeros = std::min(zeros, std::countr_zero(bits_of(m) | 1U << 31));
    }
    coder_.number(zeros, 0, exponents_);
    if (zeros < 0 || zeros > 31) return false;
    NumberModels numbers;
    std::uint32_t before = 0;
    for (std::uint32_t piece = 0; piece < counts_.pieces; ++piece) {
      double& thickness_m = nth(surface_.piece_thickness_m, piece);
      std::uint32_t bits = Coder::kReads ? 0 : bits_of(thickness_m);
      if (zeros < kFewestZeros) {
        coder_.plain(bits);
      } else {
        std::int32_t off = static_cast<std::int32_t>(bits >> zeros) - static_cast<std::int32_t>(before);
        coder_.number(off, 0, numbers);
        before += static_cast<std::uint32_t>(off);
        bits = before << zeros;
      }
      if (Coder::kReads) thickness_m = std::bit_cast<float>(bits);
      if (!coder_.is_good()) return false;
    }
    return true;
  }
  bool tell_charts() {
    std::vector<glm::dvec3> corners;
    for (const Chart& chart : surface_.charts) corners.push_back(chart.X_OH.p);
    std::int32_t grid = Coder::kReads ? 0 : grid_of(corners);
    if (!tell_grid(grid)) return false;
    std::uint64_t next_tile = 0;
    const Chart none{{}, 0, 1, 1, 0};
    for (std::uint32_t i = 0; i < counts_.charts; ++i) {
      if constexpr (Coder::kReads) surface_.charts.push_back(none);
      Chart& chart = surface_.charts[i];
      tell_frame(i, grid);
      tell_same(chart.texel_m, i > 0 ? surface_.charts[i - 1].texel_m : 0);
      if (!tell_side(chart.columns, 0) || !tell_side(chart.rows, 1)) return false;
      chart.first_tile = static_cast<std::uint32_t>(next_tile);
      next_tile += std::uint64_t{chart.tiles_across()} * chart.tiles_down();
      if (next_tile > counts_.tiles || !coder_.is_good()) return false;
    }
    return next_tile == counts_.tiles;
  }
  void tell_frame(std::uint32_t index, std::int32_t grid) {
    spatial::Pose& X = surface_.charts[index].X_OH;
    if (grid == kNoGrid) {
      for (double* v : {&X.p.x, &X.p.y, &X.p.z}) coder_.plain(*v);
    } else {
      const std::uint32_t first = first_of_chart_[index];
      const glm::dvec3 expected =
          first == kNoVertex ? glm::dvec3(0) : surface_.coarse.positions_O[surface_.coarse.triangles[first][0]];
      corners_.tell(X.p, expected, step_of(grid), coder_);
    }
    std::array<std::int32_t, 3> turn{};
    bool is_stepped = false;
    if constexpr (!Coder::kReads) {
      for (int axis = 0; axis < 3; ++axis)
        turn[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::round(kTurnSteps * (&X.R.x)[axis]));
      is_stepped = quaternion_of(turn) == X.R;
    }
    coder_.bit(is_stepped, is_stepped_);
    if (!is_stepped) {
      for (double* v : {&X.R.w, &X.R.x, &X.R.y, &X.R.z}) coder_.plain(*v);
      return;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) coder_.number(turn[axis], 0, turns_[axis]);
    if (Coder::kReads) X.R = quaternion_of(turn);
  }
  void tell_same(double& value, double as_before) {
    bool is_same = value == as_before;
    coder_.bit(is_same, is_same_);
    if (is_same) {
      value = as_before;
    } else {
      coder_.plain(value);
    }
  }
  bool tell_side(std::uint32_t& side, std::size_t which) {
    constexpr std::int32_t kMostSide = 1 << 22;
    auto told = static_cast<std::int32_t>(side);
    coder_.number(told, 0, sides_[which]);
    side = static_cast<std::uint32_t>(told);
    return told > 0 && told <= kMostSide;
  }
  bool tell_tiles() {
    for (const Chart& chart : surface_.charts) {
      for (std::uint32_t down = 0; down < chart.tiles_down(); ++down) {
        for (std::uint32_t across = 0; across < chart.tiles_across(); ++across) {
          if constexpr (Coder::kReads) surface_.tiles.emplace_back();
          heights_.tell(chart, across, down, std::span(surface_.tiles).subspan(chart.first_tile), coder_);
          if (!coder_.is_good()) return false;
        }
      }
    }
    return true;
  }

  HapticSurface& surface_;
  geometry::TriangleMesh& detail_;
  const FeltCounts& counts_;
  Coder& coder_;
  HeightModels heights_;
  PointModels<Coder> corners_;
  NumberModels exponents_;
  std::array<NumberModels, 3> turns_;
  std::array<NumberModels, 2> sides_;
  BitModel is_stepped_, is_same_;
  std::vector<std::uint32_t> first_of_chart_;
};

}  // namespace

FeltCounts counts_of(const HapticSurface& surface, const geometry::TriangleMesh& detail) {
  const auto count = [](const auto& of) { return static_cast<std::uint32_t>(of.size()); };
  return {count(surface.coarse.positions_O),
          count(surface.coarse.triangles),
          surface.piece_count,
          count(surface.charts),
          count(surface.tiles),
          count(detail.positions_O),
          count(detail.triangles)};
}

bool can_be_told(const HapticSurface& surface) {
  const FeltCounts counts = counts_of(surface);
  std::size_t next_tile = 0;
  for (const Chart& chart : surface.charts) {
    if (chart.first_tile != next_tile) return false;
    next_tile += std::size_t{chart.tiles_across()} * chart.tiles_down();
  }
  return next_tile == surface.tiles.size() &&
         std::max({counts.vertices, counts.triangles, counts.pieces, counts.charts}) <= kMostFeltElements &&
         counts.tiles <= kMostFeltTiles;
}

std::vector<std::byte> encoded_felt(const HapticSurface& surface, const geometry::TriangleMesh& detail) {
  std::vector<std::byte> bytes;
  FeltTeller teller(bytes);
  HapticSurface copy = surface;
  geometry::TriangleMesh detail_copy = detail;
  const FeltCounts counts = counts_of(surface, detail);
  (void)Walk<FeltTeller>(copy, detail_copy, counts, teller).run();
  teller.finish();
  return bytes;
}

std::optional<HapticSurface> decoded_felt(std::span<const std::byte> bytes, const FeltCounts& counts,
                                          geometry::TriangleMesh* detail) {
  FeltReader reader(bytes);
  HapticSurface surface;
  geometry::TriangleMesh read_detail;
  if (!Walk<FeltReader>(surface, read_detail, counts, reader).run() || !reader.is_whole()) return std::nullopt;
  if (detail != nullptr) *detail = std::move(read_detail);
  return surface;
}

spatial::Pose frame_on_grid(const spatial::Pose& X_OH, double step_m) {
  const double sign = X_OH.R.w < 0 ? -1 : 1;
  std::array<std::int32_t, 3> turn{};
  const std::array<double, 3> xyz{X_OH.R.x, X_OH.R.y, X_OH.R.z};
  for (std::size_t i = 0; i < 3; ++i) turn[i] = static_cast<std::int32_t>(std::round(sign * kTurnSteps * xyz[i]));
  // What is turned by half a circle may round to a quaternion that is too long.
  while (turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] > kTurnSteps * kTurnSteps) {
    std::int32_t& longest =
        *std::max_element(turn.begin(), turn.end(), [](int a, int b) { return std::abs(a) < std::abs(b); });
    longest += longest > 0 ? -1 : 1;
  }
  return {quaternion_of(turn), step_m * glm::round(X_OH.p / step_m) + 0.0};
}

}  // namespace farfeel::codecs
