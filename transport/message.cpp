#include "transport/message.h"

namespace farfeel::transport {

std::string_view name_of(MessageType type) noexcept {
  switch (type) {
    case MessageType::kBye:
      return "bye";
    case MessageType::kKeepAlive:
      return "keep-alive";
    case MessageType::kChallenge:
      return "challenge";
    case MessageType::kChallengeAnswer:
      return "challenge answer";
    case MessageType::kSlaveStatus:
      return "slave status";
    case MessageType::kTile:
      return "tile";
    case MessageType::kCourse:
      return "course";
    case MessageType::kTileRequest:
      return "tile request";
    case MessageType::kTilesHeld:
      return "tiles held";
    case MessageType::kEditRequest:
      return "edit request";
    case MessageType::kEditAnswer:
      return "edit answer";
    case MessageType::kSceneNews:
      return "scene news";
    case MessageType::kSaveRequest:
      return "save request";
    case MessageType::kSaveAnswer:
      return "save answer";
    case MessageType::kPoseSample:
      return "pose sample";
    case MessageType::kContactSet:
      return "contact set";
  }
  return {};
}

}  // namespace farfeel::transport
