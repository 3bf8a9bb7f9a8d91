// x up: (x, y, z) becomes (y, z, x), a third of a turn about (1, 1, 1). y up: (x, -z, y), a quarter of one about x.
#include "slave_sim/bake/up_axis.h"

#include <fmt/format.h>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

namespace farfeel::slave_sim {
namespace {

glm::dvec3 turned(const glm::dvec3& p, const std::string& axis) {
  if (axis == "x") return {p.y, p.z, p.x};
  if (axis == "y") return {p.x, -p.z, p.y};
  return p;
}

}  // namespace

std::string complaint_about_axis(const std::string& axis) {
  return axis == "x" || axis == "y" || axis == "z" ? std::string()
                                                   : fmt::format("{} is no axis: x, y or z points up", axis);
}

void turn_up(codecs::MeshInFile& mesh, const std::string& axis) {
  for (glm::dvec3& p : mesh.positions_O) p = turned(p, axis);
}

void turn_up(codecs::MeshParts& parts, const std::string& axis) {
  if (turned({1, 2, 3}, axis) == glm::dvec3(1, 2, 3)) return;
  const glm::dquat turn = glm::quat_cast(
      glm::dmat3(turned({1, 0, 0}, axis), turned({0, 1, 0}, axis), turned({0, 0, 1}, axis)));  // by columns
  for (codecs::MeshPart& part : parts.parts) part.p = turned(part.p, axis), part.R = glm::normalize(turn * part.R);
}

}  // namespace farfeel::slave_sim
