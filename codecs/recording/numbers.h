// A struct's fields as named numbers: how settings and inputs stand in a recording.
//
// A struct says once which fields it has, to a visitor: visit("held_after_s", settings.held_after_s). Written, the
// fields become a list of names and values; read, each field looks for its own name. So a recording outlives a field
// that was added: it keeps its default.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

/// Whole numbers are exact below 2^53.
struct Numbers {
  std::vector<std::string> names;
  std::vector<double> values;  ///< as many
  friend bool operator==(const Numbers&, const Numbers&) = default;
};

/// Calls on_number(name, field) for each number that a field is made of.
template <typename Field, typename OnNumber>
void each_number(const std::string& name, Field& field, OnNumber&& on_number) {
  using T = std::remove_const_t<Field>;
  if constexpr (std::is_same_v<T, glm::dvec3>) {
    on_number(name + ".x", field.x), on_number(name + ".y", field.y), on_number(name + ".z", field.z);
  } else if constexpr (std::is_same_v<T, spatial::Pose>) {
    each_number(name + ".p", field.p, on_number);
    on_number(name + ".R.w", field.R.w), on_number(name + ".R.x", field.R.x);
    on_number(name + ".R.y", field.R.y), on_number(name + ".R.z", field.R.z);
  } else if constexpr (std::is_same_v<T, spatial::Twist>) {
    each_number(name + ".angular_rad_s", field.angular_rad_s, on_number);
    each_number(name + ".linear_m_s", field.linear_m_s, on_number);
  } else if constexpr (std::is_same_v<T, spatial::Wrench>) {
    each_number(name + ".torque_Nm", field.torque_Nm, on_number);
    each_number(name + ".force_N", field.force_N, on_number);
  } else if constexpr (std::is_same_v<T, Eigen::Matrix3d>) {
    for (Eigen::Index i = 0; i < 9; ++i) on_number(name + "." + std::to_string(i), field(i));
  } else {
    on_number(name, field);
  }
}

class NumberWriter {
 public:
  template <typename Field>
  void operator()(const std::string& name, const Field& field) {
    each_number(name, field, [this](const std::string& part, const auto& value) {
      numbers_.names.push_back(part);
      numbers_.values.push_back(static_cast<double>(value));
    });
  }
  [[nodiscard]] Numbers& numbers() { return numbers_; }

 private:
  Numbers numbers_;
};

/// For numbers from anybody: whatever they are, a field gets a value of its type. Both lists must outlive it.
class NumberReader {
 public:
  NumberReader(const std::vector<std::string>& names, const std::vector<double>& values)
      : names_(names), values_(values), is_asked_(names.size(), false) {}

  /// Leaves what the lists do not name as it is.
  template <typename Field>
  void operator()(const std::string& name, Field& field) {
    each_number(name, field, [this](const std::string& part, auto& value) {
      if (const std::size_t at = find(part); at < names_.size()) {
        is_asked_[at] = true;
        value = of_type<std::remove_reference_t<decltype(value)>>(values_[at]);
      }
    });
  }
  /// A name that no field has asked for; empty: there is none.
  [[nodiscard]] std::string_view unasked() const {
    const auto at = std::find(is_asked_.begin(), is_asked_.end(), false);
    return at == is_asked_.end() ? std::string_view() : names_[static_cast<std::size_t>(at - is_asked_.begin())];
  }

 private:
  /// Fields are mostly asked for in the order in which they were written.
  [[nodiscard]] std::size_t find(std::string_view name) {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const std::size_t at = (next_ + i) % names_.size();
      if (names_[at] != name) continue;
      next_ = at + 1;
      return at;
    }
    return names_.size();
  }
  template <typename T>
  [[nodiscard]] static T of_type(double value) {
    if constexpr (std::is_same_v<T, bool>) {
      return value != 0;
    } else if constexpr (std::is_enum_v<T>) {
      return static_cast<T>(of_type<std::underlying_type_t<T>>(value));
    } else if constexpr (std::is_integral_v<T>) {
      constexpr double kExact = 9007199254740992;  // 2^53
      const double low = std::max(-kExact, static_cast<double>(std::numeric_limits<T>::min())),
                   high = std::min(kExact, static_cast<double>(std::numeric_limits<T>::max()));
      return value >= low && value <= high ? static_cast<T>(value) : T{};
    } else {
      return value;
    }
  }

  const std::vector<std::string>& names_;
  const std::vector<double>& values_;
  std::vector<bool> is_asked_;
  std::size_t next_ = 0;
};

}  // namespace farfeel::codecs
