#include "codecs/asset/physics_json.h"

#include <Eigen/Eigenvalues>

namespace farfeel::codecs {

nlohmann::json physics_node(const Asset& asset) {
  Eigen::Matrix3d inertia;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) inertia(row, column) = asset.inertia_O_kg_m2[column][row];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(inertia);
  Eigen::Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  const Eigen::Quaterniond turn(axes);
  const Eigen::Vector3d moments = principal.eigenvalues();
  nlohmann::json node;
  node["motion"] = {{"mass", asset.mass_kg},
                    {"centerOfMass", {0.0, 0.0, 0.0}},
                    {"inertiaDiagonal", {moments.x(), moments.y(), moments.z()}},
                    {"inertiaOrientation", {turn.x(), turn.y(), turn.z(), turn.w()}}};
  node["collider"] = {{"geometry", {{"mesh", 0}}}, {"physicsMaterial", 0}};
  return node;
}

nlohmann::json physics_document(const Asset& asset) {
  nlohmann::json material = {{"staticFriction", asset.material.static_friction},
                             {"dynamicFriction", asset.material.dynamic_friction},
                             {"restitution", 0.0}};
  nlohmann::json document;
  document["physicsMaterials"] = nlohmann::json::array({material});
  return document;
}

}  // namespace farfeel::codecs
