#include "slave_sim/bake/given_mesh.h"

#include <fmt/format.h>

#include <algorithm>

#include "codecs/mesh/mesh_file.h"
#include "haptic_core/spatial/spatial.h"
#include "slave_sim/bake/found.h"
#include "slave_sim/bake/repair.h"
#include "slave_sim/bake/self_crossing.h"
#include "slave_sim/bake/unit_of_length.h"
#include "slave_sim/bake/up_axis.h"

namespace farfeel::slave_sim {
namespace {

/// Triangles that are lower than a thousandth of their longest side: they are kept, and stand for nothing that is felt.
Found slivers_of(const geometry::TriangleMesh& mesh) {
  constexpr double kSliver = 1e-3;
  Found found;
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::dvec3 &p = mesh.positions_O[a], &q = mesh.positions_O[b], &r = mesh.positions_O[c];
    const double longest = std::max({glm::dot(q - p, q - p), glm::dot(r - q, r - q), glm::dot(p - r, p - r)});
    if (glm::length(glm::cross(q - p, r - p)) < kSliver * longest) found.add(p);
  }
  return found;
}

}  // namespace

GivenMesh given_mesh(const std::string& file, const std::string& unit, UnitUnsaid if_unsaid, const Openings& openings,
                     const std::function<void(const std::string&)>& doing, const std::string& up) {
  if (doing) doing("read");
  codecs::MeshResult read = codecs::read_mesh_file(file);
  if (read) turn_up(*read, up);
  return given_mesh(read, file, unit, if_unsaid, openings, doing);
}

GivenMesh given_mesh(const codecs::MeshResult& given, const std::string& called, const std::string& unit,
                     UnitUnsaid if_unsaid, const Openings& openings,
                     const std::function<void(const std::string&)>& doing) {
  GivenMesh out;
  const auto begin = [&](const std::string& stage) {
    if (doing) doing(stage);
  };
  const auto mind = [&](const std::string& words) {
    out.told.push_back("mind: " + words);
    out.is_sound = false;
  };
  const auto refuse = [&](const std::string& why) {
    out.refusal = fmt::format("cannot bake {}: {}", called, why);
    out.is_sound = false;
    out.mesh = {};
    return std::move(out);
  };
  if (!given) {
    out.refusal = given.error().message;
    out.is_sound = false;
    return out;
  }
  for (const std::string& note : given->notes) out.told.push_back("read: " + note);
  out.is_sound = given->notes.empty();
  if (const auto words = words_about_steps(*given)) mind(*words);
  double unit_m = unit.empty() ? 1 : *metres_per_unit(unit);
  if (unit.empty()) {
    if (const auto question = question_about_unit(*given)) {
      if (if_unsaid == UnitUnsaid::kIsAsked) return refuse(*question);
      mind(*question + "; it is looked at in millimetres here");
      unit_m = *metres_per_unit("mm");
    }
  }
  begin("mend");
  auto fixed = repaired(*given, unit_m, openings);
  for (const std::string& note : fixed ? fixed->notes : fixed.error().notes) out.told.push_back("repaired: " + note);
  const auto tell_size = [&](const glm::dvec3& size_m) {
    out.told.push_back(fmt::format("size: {}, one unit of the file being {}", words_of_size(size_m),
                                   !unit.empty() ? unit
                                   : unit_m == 1 ? "a metre; --unit says otherwise"
                                                 : "mm"));
  };
  if (!fixed) {
    const glm::dvec3 size_m = unit_m * geometry::bounding_box(*given).size();
    if (spatial::is_finite(size_m)) tell_size(size_m);
    return refuse(fixed.error().message);
  }
  out.is_sound = out.is_sound && fixed->was_sound;
  out.mesh = std::move(fixed->mesh);
  out.in_file = *given, out.colours = given->colours;
  for (glm::dvec3& p : out.in_file.positions_O) p *= unit_m;
  out.left_out = std::move(fixed->left_out);
  tell_size(geometry::bounding_box(out.mesh).size());
  if (const Found slivers = slivers_of(out.mesh); slivers.count > 0)
    mind(fmt::format(
        "{} slivers (lower than a thousandth of their longest side) are kept, the first at ({:.6g}, {:.6g}, "
        "{:.6g}) m",
        slivers.count, slivers.first_O.x, slivers.first_O.y, slivers.first_O.z));
  begin("self-crossings");
  if (const auto words = words_about(self_crossing(out.mesh))) mind(*words);
  return out;
}

}  // namespace farfeel::slave_sim
