#include "slave_sim/bake/unit_of_length.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "codecs/text/nearest_word.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {
namespace {

constexpr double kMostHeld_m = 1;  ///< along its longest side
constexpr std::array<std::pair<std::string_view, double>, 6> kUnits{
    {{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}}};

}  // namespace

std::optional<double> metres_per_unit(std::string_view unit) {
  for (const auto& [name, metres] : kUnits) {
    if (unit == name) return metres;
  }
  double metres = 0;
  const auto [end, error] = std::from_chars(unit.data(), unit.data() + unit.size(), metres);
  const bool is_number = error == std::errc() && end == unit.data() + unit.size();
  return is_number && metres >= 1e-9 && metres <= 1e9 ? std::optional(metres) : std::nullopt;
}

std::string complaint_about_unit(const std::string& unit) {
  if (metres_per_unit(unit)) return {};
  constexpr std::array<std::string_view, 6> kLikeliestFirst{"mm", "cm", "in", "um", "ft", "m"};
  const std::string_view near = codecs::nearest_word(unit, kLikeliestFirst);
  return fmt::format("{} is neither m, cm, mm, um, in, ft nor a number of metres{}", unit,
                     near.empty() ? "" : fmt::format("; did you mean {}?", near));
}

std::optional<double> length_m(std::string_view words) {
  double number = 0;
  const auto [end, error] = std::from_chars(words.data(), words.data() + words.size(), number);
  std::string_view unit(end, static_cast<std::size_t>(words.data() + words.size() - end));
  while (unit.starts_with(' ')) unit.remove_prefix(1);
  const auto metres = metres_per_unit(unit);
  if (error != std::errc() || !metres || !(number > 0) || !std::isfinite(number)) return std::nullopt;
  return number * *metres;
}

std::string complaint_about_length(const std::string& words) {
  return length_m(words) ? std::string() : words + " is no length with its unit, like 50um or 0.05mm";
}

std::string words_of_size(const glm::dvec3& size_m) {
  const double most_m = std::max({size_m.x, size_m.y, size_m.z});
  const auto words = [&](double unit_m, std::string_view name) {
    const glm::dvec3 s = size_m / unit_m;
    return fmt::format("{:.4g} x {:.4g} x {:.4g} {}", s.x, s.y, s.z, name);
  };
  return most_m >= 1 ? words(1, "m") : most_m >= 1e-3 ? words(1e-3, "mm") : words(1e-6, "um");
}

std::optional<std::string> question_about_unit(const geometry::TriangleMesh& in_units) {
  geometry::Box box;
  for (const geometry::Triangle& t : in_units.triangles) {
    for (const std::uint32_t v : t) {
      if (!spatial::is_finite(in_units.positions_O[v])) return std::nullopt;
      box.include(in_units.positions_O[v]);
    }
  }
  if (box.is_empty()) return std::nullopt;
  const glm::dvec3 size = box.size();
  if (std::max({size.x, size.y, size.z}) <= kMostHeld_m) return std::nullopt;
  return fmt::format(
      "its unit is not said, and in metres it is {}, which no hand holds; say what one unit is: --unit mm ({}), --unit "
      "in ({}), or --unit m if it is so large",
      words_of_size(size), words_of_size(0.001 * size), words_of_size(0.0254 * size));
}

std::string units_that_fit(double across_units) {
  std::string words;
  for (const auto& [name, metres] : kUnits) {
    const double across_m = metres * across_units;
    if (!(across_m >= kSmallest_m && across_m <= kLargest_m)) continue;
    words += fmt::format("{}--unit {} ({:.3g} {} across)", words.empty() ? "" : ", ", name,
                         across_m < 1 ? 1e3 * across_m : across_m, across_m < 1 ? "mm" : "m");
  }
  return words.empty() ? "--unit takes metres as a number, too" : words;
}

std::optional<std::string> words_about_steps(const geometry::TriangleMesh& in_units) {
  geometry::Box box;
  double furthest = 0;
  for (const geometry::Triangle& t : in_units.triangles) {
    for (const std::uint32_t v : t) {
      const glm::dvec3& p = in_units.positions_O[v];
      if (!spatial::is_finite(p) || geometry::rounded_to_float(p) != p) return std::nullopt;
      box.include(p);
      for (int axis = 0; axis < 3; ++axis) furthest = std::max(furthest, std::abs(p[axis]));
    }
  }
  if (box.is_empty()) return std::nullopt;
  constexpr double kShown = 1e-4;  // of the size
  const double step = furthest * std::numeric_limits<float>::epsilon(), size = glm::length(box.size());
  if (!(step > kShown * size)) return std::nullopt;
  return fmt::format(
      "its 32-bit numbers have steps of up to {:.2g} units where it stands, {:.2g} units from its origin, and it is "
      "{:.3g} "
      "units across: its shape is as coarse as that; export it nearer to the origin",
      step, furthest, size);
}

}  // namespace farfeel::slave_sim
