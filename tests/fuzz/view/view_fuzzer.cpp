// A message of the live view from anybody, alone and in a stream. What is accepted is written again to the same bytes.

#include <algorithm>
#include <cstdlib>

#include "codecs/view/message_stream.h"
#include "codecs/view/view_messages.h"
#include "codecs/view/view_shapes.h"
#include "codecs/view/view_tick.h"

using namespace farfeel;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

template <typename Value>
void check_same(const std::optional<Value>& value, std::span<const std::byte> message) {
  if (!value) return;
  const std::vector<std::byte> again = codecs::write_view(*value);
  demand(std::equal(again.begin(), again.end(), message.begin(), message.end()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto message = std::as_bytes(std::span(bytes, size));
  check_same(codecs::read_view_scene(message), message);
  check_same(codecs::read_view_status(message), message);
  check_same(codecs::read_view_control(message), message);
  check_same(codecs::read_view_answer(message), message);
  check_same(codecs::read_view_tiles(message), message);
  check_same(codecs::read_view_presence(message), message);
  if (const auto body = codecs::read_view_body(message)) {
    for (const geometry::Triangle& triangle : body->triangles)
      for (const std::uint32_t corner : triangle) demand(corner < body->vertices.size());
    check_same(body, message);
  }
  if (const auto tick = codecs::read_view_tick(message)) {
    demand(tick->pushes.count <= local_model::kMostPushes && spatial::is_valid(tick->X_WT));
    demand(codecs::write_view(*tick).size() == message.size());  // a NaN may have other bits
  }
  if (const auto history = codecs::read_view_history(message)) {
    demand(history->size() <= codecs::kMostViewMoments);
    demand(codecs::write_view(*history).size() == message.size());
  }
  if (const auto token = codecs::read_view_token(message)) demand(token->size() == codecs::kViewTokenBytes);
  (void)codecs::read_view_taken(message);

  codecs::MessageStream stream(1024);
  std::size_t told = 0;
  for (std::size_t at = 0; at < size; at += 7) {
    stream.put(message.subspan(at, std::min<std::size_t>(7, size - at)));
    while (const auto whole = stream.next()) {
      demand(!whole->empty() && whole->size() <= 1024);
      told += whole->size() + 4;
    }
  }
  demand(told <= size);
  return 0;
}
