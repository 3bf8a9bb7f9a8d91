#include "codecs/view/view_messages.h"

#include <algorithm>

#include "codecs/view/view_bytes.h"

namespace farfeel::codecs {
namespace {

ViewVerb read_verb(ViewReader& in) {
  const std::uint8_t verb = in.from.u8();
  in.demand(verb >= 1 && verb <= static_cast<std::uint8_t>(ViewVerb::kRecentre));
  return static_cast<ViewVerb>(verb);
}

}  // namespace

std::vector<std::byte> write_view(const ViewStatus& status) {
  const std::size_t words = std::min(status.words.size(), kMostViewWords);
  ViewMessage message(ViewKind::kStatus, 16 + (2 + 2 * kMostViewWords) * (2 + kMostViewText));
  message.to.u8(static_cast<std::uint8_t>(status.tone));
  message.to.u8(status.is_paused);
  message.write(status.happened);
  message.write(status.to_do);
  message.to.u8(static_cast<std::uint8_t>(words));
  for (std::size_t i = 0; i < words; ++i) {
    message.write(status.words[i].first);
    message.write(status.words[i].second);
  }
  return message.taken();
}

std::vector<std::byte> write_view(ViewVerb verb) {
  ViewMessage message(ViewKind::kControl, 8);
  message.to.u8(static_cast<std::uint8_t>(verb));
  return message.taken();
}

std::vector<std::byte> write_view(const ViewAnswer& answer) {
  ViewMessage message(ViewKind::kAnswer, 16 + kMostViewText);
  message.to.u8(static_cast<std::uint8_t>(answer.verb));
  message.to.u8(answer.is_done);
  message.write(answer.words);
  return message.taken();
}

std::vector<std::byte> write_view_token(const std::string& token) {
  ViewMessage message(ViewKind::kToken, 8 + token.size());
  message.to.bytes(std::as_bytes(std::span(token)));
  return message.taken();
}

std::vector<std::byte> write_view_taken(std::uint64_t number) {
  ViewMessage message(ViewKind::kTaken, 16);
  message.to.u64(number);
  return message.taken();
}

std::optional<ViewKind> kind_of_view(std::span<const std::byte> message) noexcept {
  if (message.size() < 2 || message.size() > kMostViewBytes) return std::nullopt;
  const auto kind = std::to_integer<std::uint8_t>(message[1]);
  if (std::to_integer<std::uint8_t>(message[0]) != kViewVersion || kind < 1 ||
      kind > static_cast<std::uint8_t>(ViewKind::kHistory))
    return std::nullopt;
  return static_cast<ViewKind>(kind);
}

std::optional<ViewStatus> read_view_status(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kStatus);
  ViewStatus status;
  status.tone = static_cast<ViewTone>(in.at_most(in.from.u8(), static_cast<std::size_t>(ViewTone::kTrouble)));
  status.is_paused = in.yes();
  status.happened = in.text();
  status.to_do = in.text();
  const std::size_t words = in.at_most(in.from.u8(), kMostViewWords);
  for (std::size_t i = 0; i < words && in.is_right(); ++i) {
    std::string label = in.text();
    status.words.emplace_back(std::move(label), in.text());
  }
  return in.is_whole() ? std::optional(std::move(status)) : std::nullopt;
}

std::optional<ViewVerb> read_view_control(std::span<const std::byte> message) noexcept {
  ViewReader in(message, ViewKind::kControl);
  const ViewVerb verb = read_verb(in);
  return in.is_whole() ? std::optional(verb) : std::nullopt;
}

std::optional<ViewAnswer> read_view_answer(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kAnswer);
  ViewAnswer answer;
  answer.verb = read_verb(in);
  answer.is_done = in.yes();
  answer.words = in.text();
  return in.is_whole() ? std::optional(std::move(answer)) : std::nullopt;
}

std::optional<std::string> read_view_token(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kToken);
  if (!in.is_right() || in.from.remaining() != kViewTokenBytes) return std::nullopt;
  const auto bytes = in.from.bytes(kViewTokenBytes);
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::optional<std::uint64_t> read_view_taken(std::span<const std::byte> message) noexcept {
  ViewReader in(message, ViewKind::kTaken);
  const std::uint64_t number = in.from.u64();
  return in.is_whole() ? std::optional(number) : std::nullopt;
}

}  // namespace farfeel::codecs
