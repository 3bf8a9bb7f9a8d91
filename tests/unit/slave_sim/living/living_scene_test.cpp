#include "slave_sim/living/living_scene.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "codecs/scene/saved_scene.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/private_folder.h"

namespace farfeel::slave_sim {
namespace {

using codecs::EditKind;

/// A ridged plate that may be edited, and a second one that is not there yet.
World two_plates(bool is_editable = true) {
  World world;
  for (const bool is_there : {true, false}) {
    ObjectDefinition definition;
    definition.name = is_there ? "plate" : "visitor";
    definition.is_there = is_there;
    world.definition.objects.push_back(definition);
  }
  if (is_editable) make_editable(world.definition);
  for (const ObjectDefinition& definition : world.definition.objects) {
    WorldObject object;
    object.name = definition.name;
    object.asset.felt = ridged_plate(3e-3, 0.3e-3, {.size_m = {0.04, 0.03, 0.01}});
    object.may_change = definition.may_change;
    object.is_there = definition.is_there;
    world.objects.push_back(std::move(object));
  }
  return world;
}

EditQuestion question(std::uint64_t number, EditKind kind, const std::string& object) {
  EditQuestion asked;
  asked.request.number = number;
  asked.request.kind = kind;
  asked.request.object = object;
  asked.request.radius_m = 5e-3;
  asked.request.depth_m = 0.5e-3;
  asked.request.takes_s = 1;
  if (kind == EditKind::kMove) asked.request.X_WM = spatial::Pose{{1, 0, 0, 0}, {0.1, 0, 0}};
  return asked;
}

bool is_as(const std::vector<geometry::HeightTile>& a, const std::vector<geometry::HeightTile>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].coefficients != b[i].coefficients) return false;
  }
  return a.size() == b.size();
}

TEST(LivingScene, OneNumberOfAKeyIsOneEdit) {
  World world = two_plates();
  LivingScene scene = LivingScene::of(world).value();
  const auto before = world.objects[0].asset.felt.tiles;
  const codecs::EditAnswer first = scene.answer(question(7, EditKind::kStamp, "plate"), nullptr);
  EXPECT_TRUE(first.is_done()) << first.words;
  EXPECT_EQ(first.version, 1u);
  const auto after = world.objects[0].asset.felt.tiles;
  EXPECT_FALSE(is_as(before, after));
  const codecs::EditAnswer again = scene.answer(question(7, EditKind::kStamp, "plate"), nullptr);
  EXPECT_EQ(again.words, first.words);
  EXPECT_EQ(again.version, 1u);
  EditQuestion of_another = question(7, EditKind::kRemove, "plate");
  of_another.key[0] = std::byte{1};
  EXPECT_TRUE(scene.answer(of_another, nullptr).is_done()) << "another key's number is another edit";
  EXPECT_EQ(scene.version(), 2u);
}

TEST(LivingScene, WhatCannotBeIsRefusedInWords) {
  World world = two_plates();
  LivingScene scene = LivingScene::of(world).value();
  std::uint64_t number = 1;
  const auto refusal = [&](EditKind kind, const std::string& object) {
    const codecs::EditAnswer answer = scene.answer(question(number++, kind, object), nullptr);
    return answer.is_done() ? std::string() : answer.words;
  };
  EXPECT_NE(refusal(EditKind::kStamp, "plat").find("did you mean plate?"), std::string::npos);
  EXPECT_NE(refusal(EditKind::kSpawn, "plate").find("is there already"), std::string::npos);
  EXPECT_NE(refusal(EditKind::kMove, "visitor").find("can be spawned"), std::string::npos);
  EXPECT_NE(refusal(EditKind::kRemove, "visitor").find("is not there"), std::string::npos);
  EXPECT_EQ(scene.version(), 0u);
  EXPECT_EQ(refusal(EditKind::kSpawn, "visitor"), "");
  EXPECT_EQ(refusal(EditKind::kMove, "visitor"), "");
  EXPECT_EQ(refusal(EditKind::kRemove, "visitor"), "");
  // One place is stamped until the room is used up, and what is possible then is said.
  std::string last;
  for (int i = 0; i < 10 && last.empty(); ++i) last = refusal(EditKind::kStamp, "plate");
  EXPECT_NE(last.find("is possible"), std::string::npos) << last;

  World closed = two_plates(false);
  LivingScene still = LivingScene::of(closed).value();
  EXPECT_NE(still.answer(question(1, EditKind::kStamp, "plate"), nullptr).words.find("editable = true"),
            std::string::npos);
  EXPECT_TRUE(still.tiles_to_come().empty());
}

TEST(LivingScene, RevertBringsBackTheBeginningInNewVersions) {
  World world = two_plates();
  LivingScene scene = LivingScene::of(world).value();
  const auto before = world.objects[0].asset.felt.tiles;
  EXPECT_TRUE(scene.answer(question(1, EditKind::kStamp, "plate"), nullptr).is_done());
  EXPECT_TRUE(scene.answer(question(2, EditKind::kRemove, "plate"), nullptr).is_done());
  const auto stamped = world.objects[0].asset.felt.tiles;
  EXPECT_TRUE(scene.answer(question(3, EditKind::kRevert, "plate"), nullptr).is_done());
  const auto& after = world.objects[0].asset.felt.tiles;
  EXPECT_TRUE(is_as(before, after));
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (stamped[i].coefficients == before[i].coefficients) continue;
    EXPECT_GT(after[i].version, stamped[i].version) << "whoever has the stamp must take the original for newer";
  }
  EXPECT_NE(scene.answer(question(4, EditKind::kSpawn, "plate"), nullptr).words.find("is there already"),
            std::string::npos);
}

/// Bounds on heights are taken from tiles_to_come() and what is there: no stamp gets lower.
TEST(LivingScene, NoStampGetsLowerThanWhatWasAnnounced) {
  World world = two_plates();
  LivingScene scene = LivingScene::of(world).value();
  const auto announced = scene.tiles_to_come();
  std::uint64_t number = 1;
  for (double x_m = -0.015; x_m < 0.016; x_m += 3e-3) {
    for (int i = 0; i < 5; ++i) {
      EditQuestion asked = question(number++, EditKind::kStamp, "plate");
      asked.request.place_M = {x_m, 0, 0};
      (void)scene.answer(asked, nullptr);
    }
  }
  EXPECT_GT(scene.version(), 10u);
  int lowered = 0;
  for (const SurfaceEdit& lowest : announced) {
    const geometry::HeightTile& now = world.objects[lowest.where.surface - 1].asset.felt.tiles[lowest.where.tile];
    for (std::size_t i = 0; i < now.coefficients.size(); ++i) {
      ASSERT_GE(now.coefficients[i], lowest.tile.coefficients[i]);
      lowered += now.coefficients[i] == lowest.tile.coefficients[i] ? 1 : 0;
    }
  }
  RecordProperty("texels_at_the_bound", lowered);
}

/// What a node that was killed has on its disk is made again, to the last texel, and nothing is made twice.
TEST(LivingScene, WhatWasMadeIsMadeAgain) {
  const test_support::PrivateFolder folder;
  World world = two_plates();
  std::vector<std::byte> whole;
  {
    const auto journal = Journal::open(folder.path()).value();
    EXPECT_FALSE(Journal::open(folder.path())) << "two nodes with one journal";
    LivingScene scene = LivingScene::of(world).value();
    ASSERT_TRUE(scene.keep_in(*journal, [](const std::string&) {}));
    EXPECT_TRUE(scene.changes().tiles.empty());
    EditQuestion asked = question(1, EditKind::kStamp, "plate");
    asked.key[0] = std::byte{1};
    EXPECT_TRUE(scene.answer(asked, nullptr).is_done());
    asked.request.number = 2;
    asked.request.kind = EditKind::kSpawn;
    asked.request.object = "visitor";
    asked.request.X_WM = spatial::Pose{{1, 0, 0, 0}, {0, 0.1, 0}};
    EXPECT_TRUE(scene.answer(asked, nullptr).is_done());
    asked.request.number = 3;
    asked.request.kind = EditKind::kMove;
    asked.request.takes_s = 2;
    asked.request.X_WM->p.x = 0.3;
    EXPECT_TRUE(scene.answer(asked, nullptr).is_done());
    while (journal->durable_version() < 3) std::this_thread::yield();
    EXPECT_EQ(scene.answer(asked, nullptr).outcome, codecs::EditOutcome::kDurable);
  }
  const std::filesystem::path file = std::filesystem::path(folder.path()) / "edits";
  const auto size = std::filesystem::file_size(file);
  {
    World again = two_plates();
    const auto journal = Journal::open(folder.path()).value();
    LivingScene scene = LivingScene::of(again).value();
    ASSERT_TRUE(scene.keep_in(*journal, [](const std::string&) {}));
    EXPECT_EQ(scene.version(), 3u);
    const LivingScene::Changes changes = scene.changes();
    ASSERT_EQ(changes.objects.size(), 1u);
    EXPECT_EQ(changes.objects[0].X_WO, world.objects[1].X_WO);
    const World beginning = two_plates();
    std::size_t others = 0;
    for (std::size_t i = 0; i < beginning.objects[0].asset.felt.tiles.size(); ++i)
      others += beginning.objects[0].asset.felt.tiles[i].version != again.objects[0].asset.felt.tiles[i].version;
    EXPECT_EQ(changes.tiles.size(), others);
    EXPECT_TRUE(is_as(again.objects[0].asset.felt.tiles, world.objects[0].asset.felt.tiles));
    EXPECT_TRUE(again.objects[1].is_there);
    EXPECT_EQ(again.objects[1].X_WO, world.objects[1].X_WO);
    EditQuestion asked = question(2, EditKind::kSpawn, "visitor");
    asked.key[0] = std::byte{1};
    EXPECT_EQ(scene.answer(asked, nullptr).version, 2u) << "it was made before the crash";
    EXPECT_EQ(scene.version(), 3u);
    EXPECT_TRUE(scene.answer(question(9, EditKind::kRevert, "visitor"), nullptr).is_done());
    EXPECT_FALSE(again.objects[1].is_there) << "the beginning is the file's, not the restart's";
    while (journal->durable_version() < 4) std::this_thread::yield();
  }
  // Half an entry at the end, as a crash leaves it, is left out; so is one whose bytes are not its hash's.
  std::filesystem::resize_file(file, size + 20);
  {
    World again = two_plates();
    const auto journal = Journal::open(folder.path()).value();
    LivingScene scene = LivingScene::of(again).value();
    ASSERT_TRUE(scene.keep_in(*journal, [](const std::string&) {}));
    EXPECT_EQ(scene.version(), 3u);
    EXPECT_EQ(journal->torn_bytes(), 20u);
  }
  EXPECT_EQ(std::filesystem::file_size(file), size);
  // Another scene's journal is not this one's.
  World other = two_plates();
  other.objects[0].asset.felt.tiles[0].coefficients[0] ^= 0x400;
  const auto journal = Journal::open(folder.path()).value();
  LivingScene another = LivingScene::of(other).value();
  const auto refused = another.keep_in(*journal, [](const std::string&) {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("another scene"), std::string::npos);
}

/// Plates of which assets can be written.
World two_saved_plates() {
  World world = two_plates();
  for (WorldObject& object : world.objects) {
    object.asset.name = object.name;
    object.asset.visible = object.asset.felt.coarse;
    object.asset.mass_kg = 1;
    object.asset.inertia_O_kg_m2 = glm::dmat3(1e-3);
    object.asset.p_OM_O = {0, 0, 0.002};
    object.asset.material = {
        .stiffness_N_per_m = 1500, .damping_Ns_per_m = 1, .static_friction = 0, .dynamic_friction = 0};
  }
  world.tool = world.objects[0].asset;
  world.definition.title = "Plates, \"two\"\n";
  world.definition.origin_m = glm::dvec3(1000, 0, 0);
  return world;
}

/// Its files are what a node reads again, to the last step of a height.
TEST(LivingScene, WhatIsSavedIsTheSceneAsItIsNow) {
  World world = two_saved_plates();
  // As a bake for an error leaves it. What is stamped does not follow from it any more.
  world.objects[0].asset.detail = {world.objects[0].asset.visible, 1e-3, world.objects[0].asset.felt.charts[0].texel_m};
  world.objects[0].asset.visible_colours.assign(world.objects[0].asset.visible.positions_O.size(), {255, 0, 255});
  LivingScene scene = LivingScene::of(world).value();
  const Saved before = scene.save(5);
  EXPECT_EQ(before.answer.outcome, codecs::SaveOutcome::kOffered) << before.answer.words;
  EXPECT_EQ(scene.save(6).object, before.object) << "the same scene is made once";
  EXPECT_EQ(scene.save(6).answer.number, 6u);
  EXPECT_TRUE(scene.answer(question(1, EditKind::kStamp, "plate"), nullptr).is_done());
  EditQuestion spawn = question(2, EditKind::kSpawn, "visitor");
  spawn.request.X_WM = spatial::Pose{spatial::rotation_from_vector({0.1, 0, 0.2}), {0.1, 0.2, 0.3}};
  EXPECT_TRUE(scene.answer(spawn, nullptr).is_done());
  Saved saved = scene.save(7);
  for (int i = 0; i < 3000 && saved.answer.outcome == codecs::SaveOutcome::kLater; ++i) {
    EXPECT_NE(saved.answer.words.find("is saved again in"), std::string::npos);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    saved = scene.save(7);
  }
  ASSERT_EQ(saved.answer.outcome, codecs::SaveOutcome::kOffered) << saved.answer.words;
  EXPECT_EQ(saved.answer.version, 2u);
  EXPECT_EQ(saved.answer.hash, saved.object->hash);
  EXPECT_NE(saved.answer.hash, before.answer.hash);

  const auto files = codecs::read_saved_scene(saved.object->bytes).value();
  ASSERT_EQ(files.size(), 4u);
  const std::string text(reinterpret_cast<const char*>(files[0].bytes.data()), files[0].bytes.size());
  const SceneDefinition read = parse_scene(text, "scene.toml", {}).value();
  EXPECT_EQ(read.title, world.definition.title);
  EXPECT_TRUE(read.is_editable);
  EXPECT_EQ(read.origin_m, world.definition.origin_m);
  EXPECT_EQ(read.objects[1].name, "visitor");
  EXPECT_TRUE(read.objects[1].is_there);
  EXPECT_LT(glm::distance(read.objects[1].X_WM.p, spawn.request.X_WM->p), 1e-12);
  EXPECT_LT(glm::length(spatial::vector_from_rotation(read.objects[1].X_WM.R * glm::conjugate(spawn.request.X_WM->R))),
            1e-14);
  EXPECT_EQ(read.objects[0].source.asset, files[1].name);
  const codecs::Asset plate = codecs::read_asset(files[1].bytes).value();
  const geometry::HapticSurface& now = world.objects[0].asset.felt;
  ASSERT_EQ(plate.felt.tiles.size(), now.tiles.size());
  for (std::size_t i = 0; i < now.tiles.size(); ++i) {
    for (std::size_t c = 0; c < now.tiles[i].coefficients.size(); ++c)
      ASSERT_NEAR(plate.felt.scale.height_m(plate.felt.tiles[i].coefficients[c]),
                  now.scale.height_m(now.tiles[i].coefficients[c]), 1e-15);
  }
  EXPECT_EQ(plate.material.stiffness_N_per_m, 1500);
  EXPECT_EQ(plate.visible_colours, world.objects[0].asset.visible_colours) << "a scan's colours are saved with it";
}

TEST(LivingScene, WhatCannotBeWrittenIsRefusedInWords) {
  World world = two_plates();  // without mass
  LivingScene scene = LivingScene::of(world).value();
  const Saved refused = scene.save(1);
  EXPECT_EQ(refused.answer.outcome, codecs::SaveOutcome::kRefused);
  EXPECT_EQ(refused.object, nullptr);
  EXPECT_NE(refused.answer.words.find("the mass is not positive"), std::string::npos) << refused.answer.words;
}

}  // namespace
}  // namespace farfeel::slave_sim
