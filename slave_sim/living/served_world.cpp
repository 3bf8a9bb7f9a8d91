#include "slave_sim/living/served_world.h"

#include <algorithm>
#include <utility>

#include "codecs/felt/felt_outline.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::TouchableObject;

contact_service::ContactOptions options_of(const SceneDefinition& wanted, penetration::BackEndMaker maker) {
  return {.tolerance_m = wanted.tolerance_m,
          .grid_samples = wanted.grid_samples,
          .soft_width_m = wanted.softness_m,
          .most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m,
          .maker = std::move(maker)};
}

std::vector<motion::MovingObject> may_change_of(const std::vector<TouchableObject>& objects) {
  std::vector<motion::MovingObject> all;
  for (std::uint32_t i = 0; i < objects.size(); ++i) {
    if (objects[i].may_change) all.push_back({i, {}, motion::at_rest(objects[i].X_WO, objects[i].is_there)});
  }
  return all;
}

}  // namespace

Touch::Touch(const World& world) {
  tool_ = add(world.tool, {});
  for (const WorldObject& object : world.objects) {
    TouchableObject& added = objects_.emplace_back(add(object.asset, object.X_WO));
    if (object.motion) added.motion = &*object.motion;
    added.may_change = object.may_change;
    added.is_there = object.is_there;
  }
}

std::vector<TouchableObject> Touch::bodies() const {
  std::vector<TouchableObject> all{tool_};
  all.insert(all.end(), objects_.begin(), objects_.end());
  return all;
}

TouchableObject Touch::add(const codecs::Asset& asset, const spatial::Pose& X_WO) {
  Body& body = *bodies_.emplace_back(std::make_unique<Body>(asset.felt));
  editable_.add(body.surface, body.felt);
  return {&body.surface, asset.material, X_WO, &body.felt};
}

bool is_textured(const World& world) {
  return world.tool.felt.is_textured() ||
         std::ranges::any_of(world.objects, [](const WorldObject& object) { return object.asset.felt.is_textured(); });
}

ServedWorld::ServedWorld(const World& world, const LivingScene& living, penetration::BackEndMaker maker)
    : options_(options_of(world.definition, std::move(maker))),
      touch_(world),
      service_(touch_.objects(), touch_.tool(), options_),
      contacts_(service_, &touch_.editable()) {
  felt_.may_change = may_change_of(touch_.objects());
  contact_service::ContactOptions simd = options_;  // tiles are looked for without depths
  simd.maker = {};
  auto outline = codecs::write_felt_outline(touch_.bodies(), simd, living.tiles_to_come());
  if (!outline) {
    trouble_ = outline.error();
    return;
  }
  felt_.outline = *std::move(outline);
  if (!is_textured(world)) return;
  fed_.emplace(world);
  felt_.tiles = &tiles_.emplace(fed_->objects(), fed_->tool(), simd, TileFeedOptions{}, &fed_->editable());
}

void ServedWorld::take(const LivingScene::Changes& changes) {
  for (const SurfaceEdit& edit : changes.tiles) {
    touch_.editable().apply(edit);
    if (tiles_) tiles_->edit(edit);
  }
  felt_.changed = changes.objects;
}

}  // namespace farfeel::slave_sim
