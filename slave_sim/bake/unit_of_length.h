// What one unit of a file is, and how large the thing becomes by it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// The name of a unit (m, cm, mm, um, in, ft), or metres as a number from 1e-9 to 1e9; nothing otherwise.
[[nodiscard]] std::optional<double> metres_per_unit(std::string_view unit);

/// For an option's check: what is wrong with such a unit; empty where it is one.
[[nodiscard]] std::string complaint_about_unit(const std::string& unit);

/// Of "50um" or "0.05 mm", in metres; nothing where it is no length with a unit, or not positive.
[[nodiscard]] std::optional<double> length_m(std::string_view words);
/// For an option's check, likewise.
[[nodiscard]] std::string complaint_about_length(const std::string& words);

/// For a person: "60.0 x 40.0 x 20.0 mm", in the unit that fits. Precondition: size_m is finite.
[[nodiscard]] std::string words_of_size(const glm::dvec3& size_m);

/// Of a file whose unit nobody has said: as metres it would be larger than hands hold, so its unit has to be asked for.
/// Nothing where metres do, or where coordinates are not finite, which the repair refuses.
[[nodiscard]] std::optional<std::string> question_about_unit(const geometry::TriangleMesh& in_units);

inline constexpr double kSmallest_m = 1e-3, kLargest_m = 10;  ///< across: of what can be baked

/// For a person: the units in which something so many units across can be baked, with its size in each.
[[nodiscard]] std::string units_that_fit(double across_units);

/// Of a file in 32-bit numbers that stands so far from its origin that their steps show: how large these are, and what
/// to do. Nothing where they are below a ten-thousandth of its size.
[[nodiscard]] std::optional<std::string> words_about_steps(const geometry::TriangleMesh& in_units);

}  // namespace farfeel::slave_sim
