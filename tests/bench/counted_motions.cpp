#include "tests/bench/counted_motions.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/counting/work.h"
#include "tests/bench/loop_tick.h"
#include "tests/bench/remote_across_link.h"

namespace farfeel::bench {
namespace {

using contact_service::ToolPose;

constexpr std::array<std::string_view, 5> kScenes{"file-cad", "block-gear", "block-block", "hammer-torus",
                                                  "torus-torus"};
constexpr double kTolerance_m = 0.005;
constexpr std::int64_t kFrame_ns = 1'000'000;
constexpr transport::LinkSpec kLink{.round_trip_ns = 20'000'000};

/// What has been done since it was made, or while it was told to go on.
class Counted {
 public:
  explicit Counted(std::string name) : row_{std::move(name), {}} { counting::done = {}; }
  void add(std::string_view name, std::uint64_t count) {
    if (count > 0) row_.counts.emplace_back(name, count);
  }
  [[nodiscard]] CountedRow row() {
    for (std::size_t i = 0; i < counting::kNames.size(); ++i) add(counting::kNames[i], counting::done[i]);
    return std::move(row_);
  }

 private:
  CountedRow row_;
};

ToolPose tool_pose(const std::vector<spatial::Pose>& motion, std::size_t i) {
  const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, motion.size() - 1);
  const double dt_s = 1e-9 * static_cast<double>(static_cast<std::int64_t>(after - before) * kFrame_ns);
  const spatial::Pose &a = motion[before], &b = motion[after];
  return {
      .sequence = static_cast<std::uint32_t>(i + 1),
      .time_ns = static_cast<std::int64_t>(i + 1) * kFrame_ns,
      .X_WT = motion[i],
      .V_WT_W = {spatial::vector_from_rotation(glm::normalize(b.R * glm::conjugate(a.R))) / dt_s, (b.p - a.p) / dt_s}};
}

CountedRow proximity(const std::string& name, const CountedScene& scene) {
  const collision::HullTree T(collision::ConvexPieces(*scene.bodies.front().felt)),
      S(collision::ConvexPieces(*scene.bodies.back().felt));
  collision::ProximityQuery query(S, T);
  Counted counted(name);
  for (const spatial::Pose& pose : scene.motion) (void)query.nearer_than(kTolerance_m, pose);
  return counted.row();
}

CountedRow frame(const std::string& name, const CountedScene& scene) {
  contact_service::ContactService service(scene.objects(), scene.bodies.front(), {.tolerance_m = kTolerance_m});
  Counted counted(name);
  std::uint64_t contacts = 0, pressing = 0;
  for (std::size_t i = 0; i < scene.motion.size(); ++i) {
    const contact::ContactSet& set = service.answer(tool_pose(scene.motion, i));
    contacts += set.count;
    for (std::uint32_t k = 0; k < set.count; ++k) pressing += set.contacts[k].depth_m > 0 ? 1 : 0;
  }
  counted.add("contacts", contacts), counted.add("pressing", pressing);
  return counted.row();
}

CountedRow seven_contacts(const std::string& name, const CountedScene& scene) {
  SevenContacts loop(*scene.bodies.back().felt, *scene.bodies.front().felt, [&scene](std::int64_t time_ns) {
    return scene.motion[static_cast<std::size_t>(time_ns / SevenContacts::kTick_ns) % scene.motion.size()];
  });
  Counted counted(name);
  std::uint64_t pressing = 0;
  for (int i = 1; i <= static_cast<int>(scene.motion.size()); ++i) {
    loop.tick(i);
    pressing += loop.last_record().contacts;
  }
  counted.add("pressing", pressing);
  return counted.row();
}

class TilesCame final : public RemoteWatch {
 public:
  void on_answer(std::span<const std::byte>) override {}
  void on_tile(std::span<const std::byte>) override { ++parts; }
  void on_answered(const ToolPose&, const contact_service::Answer&) override {}
  std::uint64_t parts = 0;
};

CountedRow stroke(const std::string& name, const CountedScene& scene) {
  TilesCame came;
  RemoteAcrossLink::Options options = RemoteAcrossLink::options_of(local_model::Rung::kTiles);
  options.watch = &came;
  const contact_service::ContactOptions felt{.most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m};
  RemoteAcrossLink remote(scene.bodies, felt, kLink, options);
  local_model::LocalContacts& local = *remote.contacts();
  Counted counted(name);
  contact::ContactSet newest;
  std::uint64_t lacking = 0, contacts = 0;
  auto ours = counting::done;
  for (std::size_t i = 0; i < scene.motion.size(); ++i) {
    const ToolPose tool = tool_pose(scene.motion, i);
    remote.at(tool.time_ns);
    if (remote.poll(newest)) local.hear(newest);
    counting::done = ours;  // without the far end's
    const local_model::TickContacts& here = local.at(tool);
    ours = counting::done;
    lacking += here.lacking > 0 ? 1 : 0;
    contacts += here.set.count;
    remote.send({tool.sequence, tool.time_ns, tool.X_WT, tool.V_WT_W});
  }
  counting::done = ours;
  counted.add("ticks_lacking", lacking), counted.add("tile_bytes", remote.tile_bytes());
  counted.add("tile_parts", came.parts), counted.add("answer_bytes", remote.contact_bytes());
  counted.add("outline_bytes", remote.outline_bytes()), counted.add("contacts", contacts);
  return counted.row();
}

}  // namespace

std::vector<CountedRow> counted_rows(const CountedInputs& inputs, const std::string& only) {
  std::vector<CountedRow> rows;
  const auto add = [&](const std::string& name, const std::string& input, const auto& counted) {
    if (name.find(only) != std::string::npos) rows.push_back(counted(name, inputs.scene(input)));
  };
  for (const std::string_view scene : kScenes) add("proximity/" + std::string(scene), std::string(scene), proximity);
  for (const std::string_view scene : kScenes) add("frame/" + std::string(scene), std::string(scene), frame);
  add("tick/seven-contacts", "seven-contacts", seven_contacts);
  add("loop/stroke", "stroke", stroke);
  return rows;
}

}  // namespace farfeel::bench
