// What a recording holds of a contact service, field by field: its options, what an answer was asked, and what it said.
#pragma once

#include <map>
#include <string>
#include <tl/expected.hpp>

#include "codecs/recording/recording.h"
#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/session/editable_surfaces.h"

namespace farfeel::slave_sim {

inline constexpr const char* kAnswers = "answers";  ///< the stream's name
inline constexpr std::uint8_t kEdit = 1;            ///< of an answer's messages: made before it

struct RecordedOptions {
  contact_service::ContactOptions options;  ///< but for the back end's maker
  bool is_historical = false;               ///< that back end is to be given; else it is simd
};
[[nodiscard]] codecs::Numbers numbers_of(const RecordedOptions&);
/// Fails on what no service is made of.
[[nodiscard]] tl::expected<RecordedOptions, std::string> options_in(codecs::NumberReader&);

[[nodiscard]] codecs::Numbers numbers_of(const contact_service::ToolPose&);
[[nodiscard]] contact_service::ToolPose pose_in(const codecs::Stream&, const codecs::Record&);

[[nodiscard]] codecs::RecordedMessage message_of(const SurfaceEdit&);
[[nodiscard]] tl::expected<SurfaceEdit, std::string> edit_in(const codecs::RecordedMessage&);

/// Names contacts by when they came: ids are the service's own business, and may be given in any way.
class AnswerOutputs {
 public:
  /// Of a service's answer to that pose.
  [[nodiscard]] codecs::Outputs of(const contact_service::Answer&, const contact_service::ToolPose& asked);

 private:
  std::map<std::uint32_t, double> names_;  // of the contacts of the answer before, by their ids
  double named_ = 0;
};

}  // namespace farfeel::slave_sim
