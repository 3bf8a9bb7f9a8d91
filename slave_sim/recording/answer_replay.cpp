#include "slave_sim/recording/answer_replay.h"

#include <utility>

namespace farfeel::slave_sim {

AnswerRecorder::AnswerRecorder(bool keeps_values) : keeps_values_(keeps_values) {
  stream_.name = kAnswers;
  stream_.inputs = numbers_of(contact_service::ToolPose{}).names;
}

void AnswerRecorder::note(const contact_service::ToolPose& pose, const contact_service::Answer& answer) {
  const codecs::Outputs outputs = outputs_.of(answer, pose);
  if (stream_.outputs.empty())
    for (const codecs::Output& output : outputs) stream_.outputs.push_back(output.name);
  stream_.records.push_back(
      {numbers_of(pose).values, std::exchange(edits_, {}), codecs::outcome_of(outputs, keeps_values_)});
}

tl::expected<AnswerReplay, std::string> AnswerReplay::begin(codecs::NumberReader& settings,
                                                            contact_service::FeltScene scene,
                                                            std::span<const motion::MovingObject> moving,
                                                            penetration::BackEndMaker historical) {
  auto recorded = options_in(settings);
  if (!recorded) return tl::unexpected(recorded.error());
  if (recorded->is_historical) recorded->options.maker = std::move(historical);
  return AnswerReplay(std::make_unique<RecordedScene>(std::move(scene), moving), recorded->options);
}

AnswerReplay::AnswerReplay(std::unique_ptr<RecordedScene> scene, const contact_service::ContactOptions& options)
    : scene_(std::move(scene)), service_(scene_->service(options)) {}

tl::expected<codecs::Outputs, std::string> AnswerReplay::answer(const codecs::Stream& stream,
                                                                const codecs::Record& record) {
  for (const codecs::RecordedMessage& message : record.messages) {
    const auto edit = edit_in(message);
    if (!edit) return tl::unexpected(edit.error());
    (void)scene_->surfaces().apply(*edit);
  }
  const contact_service::ToolPose pose = pose_in(stream, record);
  return outputs_.of(service_.answer(pose), pose);
}

}  // namespace farfeel::slave_sim
