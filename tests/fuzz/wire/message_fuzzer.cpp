// One opened message, u8 type and payload, through every reader but the haptic lane's and the numbered messages', which
// have their own fuzzers:
// what an authentic but hostile peer can send. What is accepted must be written again to the same bytes: then nothing
// was read that is not in the layout, and nothing in the layout was ignored.

#include <cstdlib>
#include <cstring>

#include "codecs/wire/course_message.h"
#include "codecs/wire/edit_messages.h"
#include "codecs/wire/slave_status.h"
#include "codecs/wire/tile_messages.h"
#include "transport/control_messages.h"

using namespace farfeel;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

bool is_same(std::span<const std::byte> a, std::span<const std::byte> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size()) == 0);
}

template <typename Message>
void expect_again(const std::optional<Message>& message, std::span<const std::byte> payload) {
  if (!message) return;
  transport::PayloadBuffer again;
  demand(is_same(write(*message, again), payload));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const auto payload = std::as_bytes(std::span(bytes, size)).subspan(1);
  std::array<std::byte, 2 * transport::kMaxMessageBytes> again;
  switch (static_cast<transport::MessageType>(bytes[0])) {
    case transport::MessageType::kBye:
      expect_again(transport::read_bye(payload), payload);
      break;
    case transport::MessageType::kSlaveStatus: {
      codecs::SlaveStatus status;
      if (codecs::read(payload, status) != codecs::Fault::kNone) break;
      demand(is_same(std::span(again).first(codecs::write(status, again)), payload));
      break;
    }
    case transport::MessageType::kTile:
      if (const auto message = codecs::read_tile_message(payload))
        demand(is_same(std::span(again).first(codecs::write(*message, again)), payload));
      break;
    case transport::MessageType::kCourse:
      if (const auto told = codecs::read_course(payload)) {
        demand(motion::is_usable(told->course));
        demand(is_same(std::span(again).first(codecs::write(*told, again)), payload));
      }
      break;
    case transport::MessageType::kEditRequest:
      if (const auto request = codecs::read_edit_request(payload))
        demand(is_same(std::span(again).first(codecs::write(*request, again)), payload));
      break;
    case transport::MessageType::kEditAnswer:
      if (const auto answer = codecs::read_edit_answer(payload))
        demand(is_same(std::span(again).first(codecs::write(*answer, again)), payload));
      break;
    case transport::MessageType::kSceneNews:
      if (const auto news = codecs::read_scene_news(payload))
        demand(is_same(std::span(again).first(codecs::write(*news, again)), payload));
      break;
    case transport::MessageType::kSaveRequest:
      if (const auto request = codecs::read_save_request(payload))
        demand(is_same(std::span(again).first(codecs::write(*request, again)), payload));
      break;
    case transport::MessageType::kSaveAnswer:
      if (const auto answer = codecs::read_save_answer(payload))
        demand(is_same(std::span(again).first(codecs::write(*answer, again)), payload));
      break;
    case transport::MessageType::kTilesHeld:
      if (const auto held = codecs::read_tiles_held(payload))
        demand(is_same(std::span(again).first(codecs::write(*held, again)), payload));
      break;
    case transport::MessageType::kTileRequest:
      if (const auto message = codecs::read_tile_request(payload))
        demand(is_same(std::span(again).first(codecs::write(*message, again)), payload));
      break;
    default:
      break;
  }
  return 0;
}
