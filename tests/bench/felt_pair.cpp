#include "tests/bench/felt_pair.h"

#include <utility>

namespace farfeel::bench {

using contact_service::TouchableObject;

FeltPair::FeltPair(std::string name, geometry::HapticSurface object, geometry::HapticSurface tool, double tolerance_m,
                   const spatial::Pose& X_WO)
    : name_(std::move(name)),
      object_(std::move(object)),
      tool_(std::move(tool)),
      X_WO_(X_WO),
      object_felt_(object_),
      tool_felt_(tool_) {
  options_.tolerance_m = tolerance_m;
  options_.most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m;  // as slave_sim/main.cpp
}

TouchableObject FeltPair::object(const contact::Material& material) const {
  return {&object_, material, X_WO_, &object_felt_, script_ ? &*script_ : nullptr};
}

TouchableObject FeltPair::tool(const contact::Material& material) const {
  return {&tool_, material, {}, &tool_felt_};
}

contact_service::ContactService FeltPair::service(const contact::Material& material) const {
  const TouchableObject S = object(material);
  return {std::span(&S, 1), tool(material), options_};
}

}  // namespace farfeel::bench
