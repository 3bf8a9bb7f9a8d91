#include "codecs/tile/tile_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "codecs/tile/number_coder.h"
#include "codecs/tile/smooth_basis.h"

namespace farfeel::codecs {
namespace {

using geometry::kTileSide;

static_assert(std::endian::native == std::endian::little, "the layout is little-endian, and so is this code");

// Specification constants.
enum Form : std::uint8_t { kRaw = 2, kStepped = 3, kSmooth = 4, kSame = 5 };  // 1 was the first codec's
struct Band {
  std::uint8_t first_row, rows;
};
constexpr std::array<Band, 3> kBands{{{0, kTileSide}, {0, kTileSide / 2}, {kTileSide / 2, kTileSide / 2}}};
constexpr std::int64_t kFirst = 32768;  // predicts the first coefficient; spectra are of what differs from it
constexpr std::size_t kMostDegree = 2 * (kTileSide - 1);

// Implementation constants.
constexpr double kRoundingSlack = 1e-6;  // of a step: what two machines' sums may differ by, and far more
constexpr int kCoarsestStep = 255, kFinestStep = 0;
constexpr int kFinestWorth = 8;               // half a coefficient: finer, rounding them is what is left
constexpr std::ptrdiff_t kMostNumbers = 400;  // worth telling of a spectrum: rougher relief is shorter in steps
constexpr int kMostTries = 3;                 // at a length that is nearly what is worth it

using Payload = std::vector<std::byte>;
using Coefficients = std::span<std::uint16_t>;  // whole rows

template <typename Value>
void put(Value value, Payload& to) {
  const auto bytes = std::bit_cast<std::array<std::byte, sizeof value>>(value);
  to.insert(to.end(), bytes.begin(), bytes.end());
}

double unit_of(int step) {
  return std::exp2(step / 8.0 - 2);
}

/// From the left a, above b and above left c: the least of a and b at an edge, their plane where it is smooth.
std::int64_t median_edge_prediction(std::int64_t a, std::int64_t b, std::int64_t c) {
  if (c >= std::max(a, b)) return std::min(a, b);
  if (c <= std::min(a, b)) return std::max(a, b);
  return a + b - c;
}

// ---- Stepped: both ends walk row by row over what is read.

/// number(around) is told, or tells, by how many steps each coefficient differs from its prediction `predicted`.
template <typename Number>
void walk(Coefficients as_read, std::uint16_t within, Number&& number) {
  // Magnitudes with a border of zeros: two to the left, one to the right, two rows above.
  constexpr std::size_t kStride = kTileSide + 3;
  std::array<std::uint32_t, kStride*(kTileSide + 2)> magnitudes{};
  const std::int64_t step = 2 * std::int64_t{within} + 1;
  const std::size_t rows = as_read.size() / kTileSide;
  for (std::size_t row = 0; row < rows; ++row) {
    std::uint16_t* at = &as_read[row * kTileSide];
    std::uint32_t* size = &magnitudes[(row + 2) * kStride + 2];
    for (std::size_t column = 0; column < kTileSide; ++column, ++at, ++size) {
      const std::uint16_t* above = at - kTileSide;
      const std::int64_t predicted = row == 0      ? (column == 0 ? kFirst : at[-1])
                                     : column == 0 ? *above
                                                   : median_edge_prediction(at[-1], *above, above[-1]);
      const std::uint32_t* size_above = size - kStride;
      const std::uint64_t around = 2 * (std::uint64_t{size[-1]} + *size_above) + size_above[-1] + size_above[1] +
                                   size[-2] + *(size_above - kStride);
      const std::int64_t steps = number(row * kTileSide + column, predicted, around);
      *size = static_cast<std::uint32_t>(std::abs(steps));
      *at = static_cast<std::uint16_t>(std::clamp<std::int64_t>(predicted + steps * step, 0, 65535));
    }
  }
}

void write_stepped(std::span<const std::uint16_t> values, std::uint16_t within, Payload& to) {
  std::array<std::uint16_t, std::size_t{kTileSide} * kTileSide> as_read;
  put(within, to);
  RangeEncoder coder(to);
  NumberModels models;
  const std::int64_t step = 2 * std::int64_t{within} + 1;
  walk(Coefficients(as_read).first(values.size()), within,
       [&](std::size_t i, std::int64_t predicted, std::uint64_t around) {
         const std::int64_t off = values[i] - predicted;
         const std::int64_t steps = (off >= 0 ? off + within : off - within) / step;  // to the nearest
         models.write(static_cast<std::int32_t>(steps), around, coder);
         return steps;
       });
  coder.finish();
}

bool read_stepped(std::span<const std::byte> payload, Coefficients values) {
  std::uint16_t within = 0;
  if (payload.size() < sizeof within) return false;
  std::memcpy(&within, payload.data(), sizeof within);
  RangeDecoder coder(payload.subspan(sizeof within));
  NumberModels models;
  walk(values, within,
       [&](std::size_t, std::int64_t, std::uint64_t around) { return std::int64_t{models.read(around, coder)}; });
  return coder.is_whole();
}

// ---- Smooth: the spectrum's numbers, in whole units.

using Numbers = std::array<std::int32_t, std::size_t{kTileSide} * kTileSide>;

/// number(at, around) for every number up to a degree, from the lowest diagonal to the highest.
template <typename Number>
void along_diagonals(const Numbers& numbers, std::size_t most_degree, Number&& number) {
  const auto size = [&](std::size_t row,
                        std::size_t column) -> std::uint64_t {  // 0 beyond the edges, by wrapping round
    return row < kTileSide && column < kTileSide ? std::abs(std::int64_t{numbers[row * kTileSide + column]}) : 0;
  };
  for (std::size_t degree = 0; degree <= most_degree; ++degree) {
    const std::size_t first_row = degree < kTileSide ? 0 : degree - (kTileSide - 1);
    for (std::size_t row = first_row; row <= std::min<std::size_t>(degree, kTileSide - 1); ++row) {
      const std::size_t column = degree - row;
      number(row * kTileSide + column, 2 * (size(row, column - 1) + size(row - 1, column)) + size(row - 1, column - 1) +
                                           size(row, column - 2) + size(row - 2, column));
    }
  }
}

TileNumbers values_of(const Numbers& numbers, double unit, std::size_t most_degree) {
  TileNumbers spectrum;
  for (std::size_t i = 0; i < numbers.size(); ++i) spectrum[i] = unit * numbers[i];
  return values_of_spectrum(spectrum, most_degree);
}

/// A spectrum in whole units, and the sum of the degrees of the last that is not zero; none if it has larger numbers
/// than can be told.
struct Rounded {
  Numbers numbers{};
  std::size_t most_degree = 0;
};
bool round_to_units(const TileNumbers& spectrum, double unit, Rounded& rounded) {
  rounded.most_degree = 0;
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    const double number = std::round(spectrum[i] / unit);
    if (std::abs(number) > kMostNumber) return false;
    rounded.numbers[i] = static_cast<std::int32_t>(number);
    if (number != 0) rounded.most_degree = std::max(rounded.most_degree, i / kTileSide + i % kTileSide);
  }
  return true;
}

/// Whether what is read is near enough once it is rounded to whole coefficients: a difference then grows by less than
/// one.
bool is_near(const TileNumbers& read, const TileNumbers& written, const Nearness& nearness) {
  TileNumbers off;
  double most = 0, most_difference = 0;
  for (std::size_t i = 0; i < off.size(); ++i) {
    off[i] = std::clamp<double>(read[i], -kFirst, 65535 - kFirst) - written[i];
    most = std::max(most, std::abs(off[i]));
  }
  if (most >= nearness.coefficients + 0.5 - kRoundingSlack) return false;
  if (2 * nearness.coefficients <= nearness.differences) return true;
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (i % kTileSide != 0) most_difference = std::max(most_difference, std::abs(off[i] - off[i - 1]));
    if (i >= kTileSide) most_difference = std::max(most_difference, std::abs(off[i] - off[i - kTileSide]));
  }
  return most_difference < nearness.differences - kRoundingSlack;
}

/// A spectrum on its way out.
class SmoothWriter {
 public:
  explicit SmoothWriter(const geometry::HeightTile& tile) {
    for (std::size_t i = 0; i < values_.size(); ++i) values_[i] = static_cast<double>(tile.coefficients[i] - kFirst);
    spectrum_ = smooth_spectrum(values_);
  }

  /// Whether steps would not be shorter.
  [[nodiscard]] bool suits(const Nearness& nearness) const {
    const double least = 2 * nearness.coefficients + 1;
    return std::count_if(spectrum_.begin(), spectrum_.end(), [=](double v) { return std::abs(v) > least; }) <=
           kMostNumbers;
  }

  /// In the coarsest units that are near enough; false where none are.
  bool write_coarsest(const Nearness& nearness, Payload& to) {
    int near = kFinestStep - 1, far = kCoarsestStep + 1;
    while (far - near > 1) {
      const int middle = (near + far) / 2;
      (is_near_in(middle, nearness) ? near : far) = middle;
    }
    if (near < kFinestStep || !is_near_in(near, nearness)) return false;
    write(near, to);
    return true;
  }

  /// In the finest units that take no more than most_bytes, or nearly so; false where none of these are near enough.
  bool write_within(std::size_t most_bytes, const Nearness& nearness, Payload& to) {
    const Octaves octaves = octaves_of_numbers();
    const auto foreseen = [&](int step) {  // digits of all numbers, as bytes
      const double unit_octave = std::log2(unit_of(step)) - kLeastOctave;
      double digits = 0;
      for (std::size_t k = 0; k < octaves.size(); ++k)
        digits += octaves[k] * std::max(0.0, static_cast<double>(k) + 1.5 - unit_octave);
      return std::max(1.0, digits / 8);
    };
    const double most = static_cast<double>(most_bytes) - kTilePartHeaderBytes;
    int coarse = kCoarsestStep + 1, fine = kFinestWorth - 1;  // taken; too long, or not worth it
    double so_far = 1;                                        // bytes a foreseen one
    Payload trial;
    for (int tries = 0; tries < kMostTries && coarse - fine > 1; ++tries) {
      int step = fine + 1;
      while (step < coarse - 1 && so_far * foreseen(step) > most) ++step;
      if (!round_to_units(spectrum_, unit_of(step), rounded_)) return false;
      trial.resize(kTilePartHeaderBytes);
      write(step, trial);
      so_far = static_cast<double>(trial.size() - kTilePartHeaderBytes) / foreseen(step);
      const bool fits = trial.size() <= most_bytes;
      (fits ? coarse : fine) = step;
      if (fits) to.swap(trial);
    }
    return coarse <= kCoarsestStep && is_near_in(coarse, nearness);
  }

 private:
  static constexpr int kLeastOctave = -2;
  using Octaves = std::array<double, 24>;  // how many numbers are in each

  bool is_near_in(int step, const Nearness& nearness) {
    return round_to_units(spectrum_, unit_of(step), rounded_) &&
           is_near(values_of(rounded_.numbers, unit_of(step), rounded_.most_degree), values_, nearness);
  }
  [[nodiscard]] Octaves octaves_of_numbers() const {
    Octaves octaves{};
    for (const double number : spectrum_) {
      const double octave = std::ilogb(std::max(std::abs(number), 1e-3)) - kLeastOctave;
      if (octave >= 0) ++octaves[std::min(static_cast<std::size_t>(octave), octaves.size() - 1)];
    }
    return octaves;
  }
  void write(int step, Payload& to) const {
    to.push_back(static_cast<std::byte>(step));
    to.push_back(static_cast<std::byte>(rounded_.most_degree));
    RangeEncoder coder(to);
    NumberModels models;
    along_diagonals(rounded_.numbers, rounded_.most_degree,
                    [&](std::size_t at, std::uint64_t around) { models.write(rounded_.numbers[at], around, coder); });
    coder.finish();
  }

  TileNumbers values_, spectrum_;
  Rounded rounded_;  // spectrum_, in the units last tried
};

bool read_smooth(std::span<const std::byte> payload, Coefficients values) {
  if (payload.size() < 2) return false;
  const auto most_degree = static_cast<std::size_t>(payload[1]);
  if (most_degree > kMostDegree) return false;
  RangeDecoder coder(payload.subspan(2));
  NumberModels models;
  Numbers numbers{};
  along_diagonals(numbers, most_degree,
                  [&](std::size_t at, std::uint64_t around) { numbers[at] = models.read(around, coder); });
  if (!coder.is_whole()) return false;
  const TileNumbers read = values_of(numbers, unit_of(static_cast<int>(payload[0])), most_degree);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::uint16_t>(std::clamp(std::round(read[i] + kFirst), 0.0, 65535.0));
  return true;
}

// ---- Parts.

/// Of all a tile's ways the best: what is worth it, or else what is short.
struct Written {
  Form form = kRaw;
  Payload bytes;
};
Written written(const geometry::HeightTile& in, std::span<const std::uint16_t> values, const Nearness& nearness,
                std::size_t worth_bytes) {
  const auto stepped = [&](std::uint16_t within) {
    Written out{kStepped, Payload(kTilePartHeaderBytes)};
    write_stepped(values, within, out.bytes);
    return out;
  };
  const std::uint16_t within = std::min<std::uint16_t>(nearness.coefficients, nearness.differences / 2);
  Written best = stepped(worth_bytes > 0 ? 0 : within);
  if (best.bytes.size() <= worth_bytes) return best;
  std::optional<SmoothWriter> smooth;
  if (values.size() == in.coefficients.size()) smooth.emplace(in);
  if (smooth && !smooth->suits(nearness)) smooth.reset();
  Written other{kSmooth, Payload(kTilePartHeaderBytes)};
  if (smooth && worth_bytes > 0 && smooth->write_within(worth_bytes, nearness, other.bytes)) return other;
  if (within > 0 && worth_bytes > 0) best = stepped(within);
  other.bytes.resize(kTilePartHeaderBytes);
  if (smooth && smooth->write_coarsest(nearness, other.bytes) && other.bytes.size() < best.bytes.size())
    best = std::move(other);
  if (best.bytes.size() >= kTilePartHeaderBytes + values.size_bytes()) {
    best = {kRaw, Payload(kTilePartHeaderBytes + values.size_bytes())};
    std::memcpy(&best.bytes[kTilePartHeaderBytes], values.data(), values.size_bytes());
  }
  return best;
}

Payload part(std::uint32_t tile, const geometry::HeightTile& in, std::uint8_t band, const Nearness& nearness,
             std::size_t worth_bytes) {
  const auto [first_row, rows] = kBands[band];
  const std::span values =
      std::span(in.coefficients).subspan(std::size_t{first_row} * kTileSide, std::size_t{rows} * kTileSide);
  auto [form, out] = written(in, values, nearness, worth_bytes);
  out[0] = std::byte{form};
  out[1] = std::byte{band};
  std::memcpy(&out[2], &tile, sizeof tile);
  std::memcpy(&out[6], &in.version, sizeof in.version);
  return out;
}

tl::unexpected<std::string> wrong(const char* why) {
  return tl::unexpected(std::string("a tile's part ") + why);
}

}  // namespace

Nearness nearness(const geometry::HapticSurface& surface, double heights_within_m, double slopes_within) noexcept {
  constexpr double kFinest_m = 0.1e-3;  // a contact spreads over more: slopes of finer texels add up to its own
  double finest_texel_m = std::numeric_limits<double>::infinity();
  for (const geometry::Chart& chart : surface.charts) finest_texel_m = std::min(finest_texel_m, chart.texel_m);
  const auto steps = [&](double length_m) {
    return static_cast<std::uint16_t>(std::clamp(std::floor(length_m / surface.scale.scale_m), 0.0, 65535.0));
  };
  return {steps(heights_within_m), steps(slopes_within * std::max(kFinest_m, finest_texel_m))};
}

std::vector<std::vector<std::byte>> encoded_tile(std::uint32_t tile, const geometry::HeightTile& in,
                                                 const Nearness& nearness, std::size_t worth_bytes) {
  Payload whole = part(tile, in, 0, nearness, worth_bytes);
  if (whole.size() <= kMostPartBytes) return {std::move(whole)};
  return {part(tile, in, 1, nearness, 0), part(tile, in, 2, nearness, 0)};
}

tl::expected<TilePart, std::string> decoded_tile_part(std::span<const std::byte> bytes) {
  if (bytes.size() < kTilePartHeaderBytes || bytes.size() > kMostPartBytes) return wrong("has a length that none has");
  const auto form = static_cast<std::uint8_t>(bytes[0]), band = static_cast<std::uint8_t>(bytes[1]);
  if (band >= kBands.size()) return wrong("has rows that none has");
  TilePart out;
  out.first_row = kBands[band].first_row, out.rows = kBands[band].rows;
  std::memcpy(&out.tile, &bytes[2], sizeof out.tile);
  std::memcpy(&out.version, &bytes[6], sizeof out.version);

  const Coefficients values = Coefficients(out.coefficients).first(std::size_t{out.rows} * kTileSide);
  const std::span<const std::byte> payload = bytes.subspan(kTilePartHeaderBytes);
  if (form == kRaw) {
    if (payload.size() != values.size_bytes()) return wrong("is raw but has another length");
    std::memcpy(values.data(), payload.data(), payload.size());
  } else if (form == kStepped) {
    if (!read_stepped(payload, values)) return wrong("is not what an encoder wrote");
  } else if (form == kSmooth && out.rows == kTileSide) {
    if (!read_smooth(payload, values)) return wrong("is not what an encoder wrote");
  } else if (form == kSame && out.rows == kTileSide) {
    if (!payload.empty()) return wrong("is the same but says more");
    out.is_same = true;
  } else {
    return wrong("is of an unknown form");
  }
  return out;
}

std::vector<std::byte> encoded_same(std::uint32_t tile, std::uint32_t version) {
  std::vector<std::byte> part;
  put(kSame, part), put(std::uint8_t{0}, part), put(tile, part), put(version, part);
  return part;
}

std::uint32_t hash_of(const geometry::HeightTile& tile) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  for (const std::byte byte : std::as_bytes(std::span(tile.coefficients)))
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100'0000'01B3;
  return std::max(1U, static_cast<std::uint32_t>(hash ^ hash >> 32));
}

bool TileAssembly::add(const TilePart& part) {
  const bool is_known = has_tile_ && static_cast<std::int32_t>(part.version - tile_.version) <= 0;
  if (is_known) return false;
  if (rows_present_ != 0 && static_cast<std::int32_t>(part.version - growing_.version) < 0) return false;
  if (part.version != growing_.version) rows_present_ = 0;
  growing_.version = part.version;
  std::copy_n(part.coefficients.begin(), part.rows * kTileSide,
              growing_.coefficients.begin() + part.first_row * kTileSide);
  rows_present_ |= part.rows == kTileSide ? 3U : part.first_row == 0 ? 1U : 2U;
  if (rows_present_ != 3U) return false;
  tile_ = growing_;
  has_tile_ = true;
  rows_present_ = 0;
  return true;
}

}  // namespace farfeel::codecs
