#include "master_station/devices/host/procedure.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace farfeel::devices {

std::optional<MainAxis> main_axis(const glm::dvec3& by, double least) noexcept {
  const glm::dvec3 sizes = glm::abs(by);
  const int axis = sizes.x >= sizes.y && sizes.x >= sizes.z ? 0 : sizes.y >= sizes.z ? 1 : 2;
  const double others = std::max(sizes[(axis + 1) % 3], sizes[(axis + 2) % 3]);
  if (!(sizes[axis] >= least) || !(others <= 0.5 * sizes[axis])) return std::nullopt;
  return MainAxis{axis, by[axis] > 0 ? 1 : -1};
}

glm::dvec3 Movement::where(const Sample& sample) const noexcept {
  return is_rate_ ? sample.deflection.push : sample.X_BD.p;
}

void Movement::begin(const Sample& from) noexcept {
  from_ = is_rate_ ? glm::dvec3(0) : where(from);
  by_ = glm::dvec3(0);
}

void Movement::add(const Sample& sample) noexcept {
  const glm::dvec3 by = where(sample) - from_;
  if (glm::dot(by, by) > glm::dot(by_, by_)) by_ = by;
}

bool is_yes(std::string_view line) {
  std::string word;
  for (const char c : line)
    if (std::isspace(static_cast<unsigned char>(c)) == 0) word += static_cast<char>(std::tolower(c));
  return word == "yes" || word == "y";
}

}  // namespace farfeel::devices
