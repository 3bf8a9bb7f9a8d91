// Records a contact service's answers, and replays them: the same service at the poses that were taken.
#pragma once

#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "slave_sim/recording/answer_fields.h"
#include "slave_sim/recording/recorded_scene.h"

namespace farfeel::slave_sim {

/// Not for a real-time thread: it allocates.
class AnswerRecorder {
 public:
  explicit AnswerRecorder(bool keeps_values = false);
  /// Made before the next answer.
  void note(const SurfaceEdit& edit) { edits_.push_back(message_of(edit)); }
  void note(const contact_service::ToolPose&, const contact_service::Answer&);
  [[nodiscard]] codecs::Stream& stream() { return stream_; }

 private:
  bool keeps_values_;
  codecs::Stream stream_;
  std::vector<codecs::RecordedMessage> edits_;
  AnswerOutputs outputs_;
};

class AnswerReplay {
 public:
  /// moving: of the session. historical: for recordings that ask for it. Fails where the settings are none.
  [[nodiscard]] static tl::expected<AnswerReplay, std::string> begin(codecs::NumberReader& settings,
                                                                     contact_service::FeltScene scene,
                                                                     std::span<const motion::MovingObject> moving,
                                                                     penetration::BackEndMaker historical);

  /// The next record of the stream of answers. Fails where a message is no edit.
  [[nodiscard]] tl::expected<codecs::Outputs, std::string> answer(const codecs::Stream&, const codecs::Record&);

 private:
  AnswerReplay(std::unique_ptr<RecordedScene> scene, const contact_service::ContactOptions&);
  std::unique_ptr<RecordedScene> scene_;
  contact_service::ContactService service_;
  AnswerOutputs outputs_;
};

}  // namespace farfeel::slave_sim
