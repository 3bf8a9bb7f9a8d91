#include "tests/bench/living_pair.h"

#include <fmt/format.h>
#include <time.h>

#include <chrono>
#include <limits>
#include <stdexcept>
#include <utility>

#include "haptic_core/geometry/quartered.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/world/exploration.h"

namespace farfeel::bench {
namespace {

using transport::monotonic_ns;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr double kFar_m = 0.5;  // from the block to the first far object, and between two of them

transport::KeyPair key_of(std::uint8_t who) {
  transport::Key32 secret;
  secret.fill(static_cast<std::byte>(who));
  return transport::key_pair_of(secret);
}

codecs::Asset asset_of(const char* model) {
  auto asset = slave_sim::cached_model_asset(model);
  if (!asset) throw std::runtime_error(asset.error().message);
  return *std::move(asset);
}

std::unique_ptr<slave_sim::SlaveSession> slave_of(const slave_sim::World& world, slave_sim::ServedWorld& served,
                                                  const transport::Address& at) {
  const codecs::SceneDescription description = slave_sim::description_of(world);
  auto scene = codecs::write_scene(description);
  if (!scene) throw std::runtime_error(scene.error().message);
  slave_sim::SlaveSession::Options options;
  options.local = at;
  options.own = key_of(100);
  options.find = [](const transport::Key32& key) -> std::optional<transport::Operator> {
    if (key != key_of(1).public_key) return std::nullopt;
    return transport::Operator{"bench", {}, false};
  };
  options.grid = codecs::grid_around(description.exploration.region_low_W, description.exploration.region_high_W);
  auto session = slave_sim::SlaveSession::start(options, *std::move(scene), served.contacts(), served.felt());
  if (!session) throw std::runtime_error(session.error().message);
  return *std::move(session);
}

transport::Address some_port() {
  return transport::parse_address("127.0.0.1:0", 0).value();
}

std::unique_ptr<transport::Relay> link_to(const transport::Address& slave, const transport::LinkSpec& spec) {
  auto relay = transport::Relay::open({some_port(), slave, spec, 1});
  if (!relay) throw std::runtime_error(relay.error().message);
  return *std::move(relay);
}

slave_sim::LivingScene living_of(slave_sim::World& world) {
  auto living = slave_sim::LivingScene::of(world);
  if (!living) throw std::runtime_error(living.error().message);
  return *std::move(living);
}

}  // namespace

slave_sim::World living_world(const LivingSize& size) {
  slave_sim::World world;
  world.definition.name = world.definition.title = "a block that is edited";
  world.tool = asset_of("probe");
  slave_sim::WorldObject block{.name = "block", .asset = asset_of("block"), .X_WO = {}, .may_change = true};
  if (size.visible_triangles <= block.asset.visible.triangles.size()) block.asset.visible = block.asset.felt.coarse;
  while (block.asset.visible.triangles.size() < size.visible_triangles)
    block.asset.visible = geometry::quartered(block.asset.visible);
  world.objects.push_back(std::move(block));
  codecs::Asset far = asset_of("cad");
  far.visible = far.felt.coarse;
  // What is far has no texture of its own here: its outline is what is told first, and felt first.
  far.felt.charts.clear(), far.felt.tiles.clear();
  for (auto& chart : far.felt.triangle_chart) chart = geometry::kNoChart;
  for (std::size_t i = 1; i < size.objects; ++i) {
    const glm::dvec3 p(kFar_m * static_cast<double>(1 + i % 16), kFar_m * static_cast<double>(i / 16), 0);
    world.objects.push_back({.name = fmt::format("far {}", i), .asset = far, .X_WO = {{1, 0, 0, 0}, p}});
  }
  for (const slave_sim::WorldObject& object : world.objects)
    world.definition.objects.push_back({.name = object.name, .source = {}, .X_WM = object.X_WO});
  slave_sim::make_editable(world.definition);
  world.definition.exploration =
      slave_sim::exploration_from_above(world.objects[0].asset, world.objects[0].X_WO, world.tool);
  return world;
}

LivingPair::LivingPair(slave_sim::World& world, const transport::LinkSpec& spec)
    : living_(living_of(world)),
      served_(std::make_unique<slave_sim::ServedWorld>(world, living_)),
      slave_(slave_of(world, *served_, some_port())),
      link_(link_to(slave_->local(), spec)),
      link_thread_([this] { link_->run(is_over_, std::numeric_limits<std::int64_t>::max()); }) {
  if (!served_->trouble().empty()) throw std::runtime_error(served_->trouble());
  transport::Greeter greeter;
  greeter.own = key_of(1);
  greeter.slave = key_of(100).public_key;
  greeter.master = transport::random_identity();
  greeter.wall_clock_ns = transport::wall_clock_ns;
  greeter.next_counter = [] { return static_cast<std::uint64_t>(transport::wall_clock_ns()); };
  began_ns_ = monotonic_ns();
  auto master = master_station::MasterSession::connect({{link_->local()}, greeter, 20, {}});
  if (!master) {
    is_over_ = true;
    throw std::runtime_error(master.error().message);
  }
  master_ = *std::move(master);
  contacts_.emplace(*master_->tiles());
  first_touch_ms_ = 1e-6 * static_cast<double>(monotonic_ns() - began_ns_);
  master_->want_tiles();
}

LivingPair::~LivingPair() {
  master_.reset();
  is_over_ = true;
}

void LivingPair::start_slave_anew(const slave_sim::World& beginning) {
  const transport::Address at = slave_->local();
  slave_.reset();
  served_.reset();
  beginning_ = beginning;
  const slave_sim::LivingScene before = living_of(beginning_);
  served_ = std::make_unique<slave_sim::ServedWorld>(beginning_, before);
  served_->take(living_.changes());
  slave_ = slave_of(beginning_, *served_, at);
}

LivingPair::Tick LivingPair::tick(const glm::dvec3& p_WT) {
  next_ns_ = std::max(next_ns_ + kPeriod_ns, monotonic_ns() - kPeriod_ns);
  const timespec until{next_ns_ / 1'000'000'000, next_ns_ % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
  Tick tick;
  tick.at_ns = monotonic_ns();
  master_station::ToolState state;
  state.sequence = ++sequence_;
  state.time_ns = tick.at_ns - began_ns_;
  state.X_WT.p = p_WT;
  master_->remote().send(state);
  contact::ContactSet newest;
  if (master_->remote().poll(newest)) {
    contacts_->hear(newest);
    answered_ns_ = newest.pose_time_ns;
  }
  for (motion::ObjectCourse told; master_->remote().take_course(told);) contacts_->set_out(told);
  contact_service::ToolPose pose;
  pose.sequence = state.sequence;
  pose.time_ns = state.time_ns;
  pose.X_WT = state.X_WT;
  const local_model::TickContacts& here = contacts_->at(pose);
  for (std::uint32_t i = 0; i < here.set.count; ++i)
    tick.depth_m = std::max(tick.depth_m, here.set.contacts[i].depth_m);
  tick.is_whole = here.set.count > 0 && here.lacking == 0;
  tick.answer_age_ms = 1e-6 * static_cast<double>(state.time_ns - answered_ns_);
  tick.took_ms = 1e-6 * static_cast<double>(monotonic_ns() - tick.at_ns);
  return tick;
}

}  // namespace farfeel::bench
