#include "tests/end_to_end/faults/remote_world.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>

#include "codecs/felt/felt_outline.h"
#include "slave_sim/session/slave_session.h"
#include "tests/end_to_end/faults/hand.h"
#include "tests/support/tiled_plates.h"

namespace farfeel::end_to_end {
namespace {

using std::chrono::milliseconds;

transport::KeyPair key_of(std::uint8_t who) {
  transport::Key32 secret;
  secret.fill(static_cast<std::byte>(who));
  return transport::key_pair_of(secret);
}

/// A rough sheet: what Draco makes of it is as large as a small scene.
geometry::TriangleMesh sheet(std::uint32_t number) {
  constexpr std::uint32_t kSide = 120;
  std::mt19937 random(number + 1);
  geometry::TriangleMesh mesh;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x)
      mesh.positions_O.emplace_back(1e-3 * x, 1e-3 * y, 1e-6 * static_cast<double>(random() % 1000));
  }
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t at = y * kSide + x;
      mesh.triangles.push_back({at, at + 1, at + kSide});
      mesh.triangles.push_back({at + 1, at + kSide + 1, at + kSide});
    }
  }
  return mesh;
}

/// The plates under the plane: nobody feels them here, but their heights are told, and change.
struct EditedPlates {
  test_support::TiledPlates plates;
  penetration::FeltSurface tool_felt{plates.tool}, table_felt{plates.table};
  contact_service::TouchableObject tool{&plates.tool, plates.material, {}, &tool_felt},
      table{&plates.table, plates.material, {}, &table_felt};
  std::vector<std::byte> outline = codecs::write_felt_outline(std::array{tool, table}, {}).value();
  slave_sim::EditableSurfaces editable = [this] {
    slave_sim::EditableSurfaces both;
    both.add(plates.tool, tool_felt);
    both.add(plates.table, table_felt);
    return both;
  }();
  slave_sim::TileFeed feed{std::span(&table, 1), tool, {}, exact(), &editable};

  static slave_sim::TileFeedOptions exact() {
    slave_sim::TileFeedOptions options;
    options.is_exact = true;
    return options;
  }
  [[nodiscard]] std::vector<contact_service::SurfaceTile> under_the_hand() const {
    auto service = plates.remote();
    std::vector<contact_service::SurfaceTile> tiles;
    for (const auto& where : service.tiles_needed({1, 0, where_pressed(), {}}, 0).tiles) {
      if (where.surface == 1 && std::find(tiles.begin(), tiles.end(), where) == tiles.end()) tiles.push_back(where);
    }
    return tiles;
  }
};

}  // namespace

test_support::AnalyticWorld plane(std::uint32_t run) {
  test_support::AnalyticWorld world;
  world.level_m = level_m(run);
  world.points_T = {{3e-3, 2e-3, 0}, {3e-3, -2e-3, 0}, {-3e-3, 2e-3, 0}, {-3e-3, -2e-3, 0}};
  world.material.stiffness_N_per_m = 500;  // four of them
  return world;
}

geometry::HeightTile told_tile(std::uint32_t run, std::uint32_t version) {
  geometry::HeightTile tile;
  tile.version = version;
  tile.coefficients.fill(static_cast<std::uint16_t>(30'000 + 100 * (run % kRunsTold) + version % 100));
  return tile;
}

codecs::SceneDescription scene_number(std::uint32_t number) {
  codecs::SceneDescription scene;
  scene.name = "scene " + std::to_string(number);
  scene.objects = {{"sheet", {}, sheet(number)}};
  scene.tool.name = "block";
  scene.tool.visible_T = {{{0, 0, 0}, {0.02, 0, 0}, {0, 0.02, 0}, {0, 0, 0.02}},
                          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  scene.tool.mass_kg = 0.05;
  scene.tool.inertia_To_T_kg_m2 = glm::dmat3(1e-5);
  return scene;
}

const contact_service::Answer& PlaneContacts::answer(const contact_service::ToolPose& pose) noexcept {
  const std::int64_t began_ns = transport::monotonic_ns();
  static_cast<contact::ContactSet&>(set_) = world_.contacts(pose.X_WT);
  set_.pose_sequence = pose.sequence;
  set_.pose_time_ns = pose.time_ns;
  while (transport::monotonic_ns() - began_ns < takes_ns_) continue;
  return set_;
}

transport::KeyPair slave_key() {
  return key_of(100);
}
transport::KeyPair operator_key() {
  return key_of(1);
}
std::optional<transport::Operator> allowed_operator(const transport::Key32& key) {
  if (key != operator_key().public_key) return std::nullopt;
  return transport::Operator{"the operator", {}, false};
}

void serve(const SlaveStart& start, int tell) {
  EditedPlates world;
  PlaneContacts contacts(start.run, start.takes_ns);
  slave_sim::SlaveSession::Options options;
  options.local = transport::loopback().with_port(start.port);
  options.own = slave_key();
  options.find = allowed_operator;
  auto session = slave_sim::SlaveSession::start(options, codecs::write_scene(scene_number(start.scene)).value(),
                                                contacts, {world.outline, &world.feed, {}});
  if (!session) {
    std::fprintf(stderr, "the slave: %s\n", session.error().message.c_str());
    std::_Exit(1);
  }
  const std::uint16_t port = (*session)->local().port;
  if (write(tell, &port, sizeof port) != sizeof port) std::_Exit(1);
  const auto tiles = world.under_the_hand();
  for (std::uint32_t version = 1;; ++version) {
    std::this_thread::sleep_for(milliseconds(20));
    if (!start.edits || tiles.empty()) continue;
    for (const auto& where : tiles) (*session)->edit({where, told_tile(start.run, version)});
  }
}

}  // namespace farfeel::end_to_end
