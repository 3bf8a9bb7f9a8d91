#include "slave_sim/recording/answer_replay.h"

#include <gtest/gtest.h>

#include "tests/support/tiled_plates.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::ToolPose;

contact_service::FeltScene scene() {
  const test_support::TiledPlates plates;
  const penetration::FeltSurface tool(plates.tool), table(plates.table);
  const std::array bodies{
      contact_service::TouchableObject{.felt = &plates.tool, .material = plates.material, .prepared = &tool},
      contact_service::TouchableObject{.felt = &plates.table, .material = plates.material, .prepared = &table}};
  return codecs::read_felt_asset(codecs::write_felt_asset(bodies, {}).value()).value().scene;
}

/// A tool that strokes the table, all of whose tiles are lower from the tenth answer on.
codecs::Stream recorded(const contact_service::ContactOptions& options) {
  RecordedScene session(scene(), {});
  contact_service::ContactService service = session.service(options);
  AnswerRecorder recorder;
  for (std::uint32_t i = 0; i < 20; ++i) {
    const std::size_t tiles = session.bodies()[1].felt->tiles.size();
    for (std::uint32_t tile = 0; i == 10 && tile < tiles; ++tile) {
      SurfaceEdit edit{{1, tile}, session.bodies()[1].felt->tiles[tile]};
      ++edit.tile.version;
      for (std::uint16_t& c : edit.tile.coefficients) c = static_cast<std::uint16_t>(c / 2);
      recorder.note(edit);
      (void)session.surfaces().apply(edit);
    }
    ToolPose pose;
    pose.sequence = i, pose.time_ns = 1'000'000 * i;
    pose.X_WT = test_support::TiledPlates::pose(1e-4 * i, 1e-4);
    recorder.note(pose, service.answer(pose));
  }
  return recorder.stream();
}

std::size_t differing(const codecs::Stream& stream, const contact_service::ContactOptions& options) {
  const codecs::Numbers numbers = numbers_of(RecordedOptions{options, false});
  codecs::NumberReader settings(numbers.names, numbers.values);
  auto replay = AnswerReplay::begin(settings, scene(), {}, {});
  std::size_t count = 0;
  for (const codecs::Record& record : stream.records)
    count += codecs::first_difference(record.outcome, replay->answer(stream, record).value(), 0).has_value();
  return count;
}

TEST(AnswerReplay, AnswersAsItWasRecordedEditsAmongThem) {
  EXPECT_EQ(differing(recorded({}), {}), 0);
}

TEST(AnswerReplay, WithoutTheEditsTheAnswersAfterThemDiffer) {
  codecs::Stream stream = recorded({});
  for (codecs::Record& record : stream.records) record.messages.clear();
  EXPECT_EQ(differing(stream, {}), 10);
}

TEST(AnswerReplay, OtherOptionsAnswerOtherwise) {
  EXPECT_GT(differing(recorded({}), {.soft_width_m = 11e-6}), 15);
}

TEST(AnswerReplay, AMessageThatIsNoEditIsRefused) {
  codecs::Stream stream = recorded({});
  stream.records[0].messages.push_back({kEdit, std::vector<std::byte>(3)});
  const codecs::Numbers numbers = numbers_of(RecordedOptions{});
  codecs::NumberReader settings(numbers.names, numbers.values);
  auto replay = AnswerReplay::begin(settings, scene(), {}, {});
  EXPECT_FALSE(replay->answer(stream, stream.records[0]));
}

}  // namespace
}  // namespace farfeel::slave_sim
