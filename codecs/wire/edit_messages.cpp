#include "codecs/wire/edit_messages.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "codecs/wire/wire_fields.h"
#include "haptic_core/motion/course.h"

namespace farfeel::codecs {
namespace {

constexpr std::uint8_t kHasPose = 1;

/// Nothing in it steers a terminal: no control character of ASCII, and none of the second set as UTF-8 has it.
bool is_printable(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 || c == 0x7F) return false;
    if (c == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0) return false;
  }
  return true;
}

void write_text(transport::ByteWriter& w, std::string_view text) {
  w.bytes(std::as_bytes(std::span(text.data(), text.size())));
}

std::string read_text(transport::ByteReader& r, std::size_t size) {
  std::string text(size, '\0');
  const auto bytes = r.bytes(size);
  if (bytes.size() == size) std::memcpy(text.data(), bytes.data(), size);
  return text;
}

/// What fits and may be sent, not cut amid a character of UTF-8.
std::string sendable(std::string words) {
  if (words.size() > kMostEditWords) {
    std::size_t end = kMostEditWords;
    while (end > 0 && (static_cast<unsigned char>(words[end]) & 0xC0) == 0x80) --end;
    words.resize(end);
  }
  if (is_printable(words)) return words;
  for (char& c : words) {
    if (const auto byte = static_cast<unsigned char>(c); byte < 0x20 || byte > 0x7E) c = '?';
  }
  return words;
}

bool is_within_limits(const EditRequest& request) {
  const auto kind = static_cast<std::uint8_t>(request.kind);
  if (request.number == 0 || kind < 1 || kind > 5 || request.object.empty() || request.object.size() > kMostEditName ||
      !is_printable(request.object))
    return false;
  if (request.kind != EditKind::kStamp) return true;
  return request.radius_m > 0 && request.depth_m > 0 && request.depth_m <= request.radius_m;
}

}  // namespace

std::size_t write(const EditRequest& request, std::span<std::byte> to) {
  if (!is_within_limits(request)) return 0;
  transport::ByteWriter w(to);
  w.u64(request.number);
  w.u8(static_cast<std::uint8_t>(request.kind));
  w.u8(request.X_WM ? kHasPose : 0);
  w.u8(static_cast<std::uint8_t>(request.object.size()));
  write_text(w, request.object);
  write_f64(w, request.place_M);
  for (const double v : {request.radius_m, request.depth_m, request.takes_s}) w.f64(v);
  if (request.X_WM) write_pose(w, *request.X_WM);
  return w.ok() ? w.size() : 0;
}

std::optional<EditRequest> read_edit_request(std::span<const std::byte> payload) {
  CheckedReader r(payload);
  EditRequest request;
  request.number = r.raw().u64();
  request.kind = static_cast<EditKind>(r.raw().u8());
  const std::uint8_t flags = r.raw().u8();
  const std::size_t name = r.raw().u8();
  if (name > kMostEditName) return std::nullopt;
  request.object = read_text(r.raw(), name);
  request.place_M = r.vector_f64(kMaxCoordinate_m);
  request.radius_m = r.f64(0, kMostEditRadius_m);
  request.depth_m = r.f64(0, kMostEditRadius_m);
  request.takes_s = r.f64(0, motion::kLongestCourse_s);
  if (flags == kHasPose) request.X_WM = r.pose();
  const bool is_right = r.fault() == Fault::kNone && r.raw().remaining() == 0 && flags <= kHasPose;
  return is_right && is_within_limits(request) ? std::optional(request) : std::nullopt;
}

std::size_t write(const EditAnswer& answer, std::span<std::byte> to) {
  const std::string words = sendable(answer.words);
  transport::ByteWriter w(to);
  w.u64(answer.number);
  w.u8(static_cast<std::uint8_t>(answer.outcome));
  w.u32(answer.version);
  w.u16(static_cast<std::uint16_t>(words.size()));
  write_text(w, words);
  return w.ok() ? w.size() : 0;
}

std::optional<EditAnswer> read_edit_answer(std::span<const std::byte> payload) {
  transport::ByteReader r(payload);
  EditAnswer answer;
  answer.number = r.u64();
  answer.outcome = static_cast<EditOutcome>(r.u8());
  answer.version = r.u32();
  const std::size_t size = r.u16();
  if (size > kMostEditWords) return std::nullopt;
  answer.words = read_text(r, size);
  const bool is_right = r.ok() && r.remaining() == 0 && answer.number != 0 && answer.outcome <= EditOutcome::kDurable;
  return is_right && is_printable(answer.words) ? std::optional(answer) : std::nullopt;
}

std::size_t write(const SceneNews& news, std::span<std::byte> to) {
  const std::string words = sendable(news.words);
  transport::ByteWriter w(to);
  w.u32(news.version);
  w.u32(news.durable);
  w.u16(static_cast<std::uint16_t>(words.size()));
  write_text(w, words);
  return w.ok() ? w.size() : 0;
}

std::optional<SceneNews> read_scene_news(std::span<const std::byte> payload) {
  transport::ByteReader r(payload);
  SceneNews news;
  news.version = r.u32();
  news.durable = r.u32();
  const std::size_t size = r.u16();
  if (size > kMostEditWords) return std::nullopt;
  news.words = read_text(r, size);
  return r.ok() && r.remaining() == 0 && news.durable <= news.version && is_printable(news.words) ? std::optional(news)
                                                                                                  : std::nullopt;
}

std::size_t write(const SaveRequest& request, std::span<std::byte> to) {
  transport::ByteWriter w(to);
  w.u64(request.number);
  return w.ok() && request.number != 0 ? w.size() : 0;
}

std::optional<SaveRequest> read_save_request(std::span<const std::byte> payload) {
  transport::ByteReader r(payload);
  const SaveRequest request{r.u64()};
  return r.is_at_end() && request.number != 0 ? std::optional(request) : std::nullopt;
}

std::size_t write(const SaveAnswer& answer, std::span<std::byte> to) {
  const std::string words = sendable(answer.words);
  transport::ByteWriter w(to);
  w.u64(answer.number);
  w.u8(static_cast<std::uint8_t>(answer.outcome));
  w.u32(answer.version);
  w.bytes(answer.hash);
  w.u16(static_cast<std::uint16_t>(words.size()));
  write_text(w, words);
  return w.ok() ? w.size() : 0;
}

std::optional<SaveAnswer> read_save_answer(std::span<const std::byte> payload) {
  transport::ByteReader r(payload);
  SaveAnswer answer;
  answer.number = r.u64();
  answer.outcome = static_cast<SaveOutcome>(r.u8());
  answer.version = r.u32();
  const auto hash = r.bytes(answer.hash.size());
  std::ranges::copy(hash, answer.hash.begin());
  const std::size_t size = r.u16();
  if (size > kMostEditWords) return std::nullopt;
  answer.words = read_text(r, size);
  const bool is_right = r.is_at_end() && answer.number != 0 && answer.outcome <= SaveOutcome::kLater &&
                        (answer.outcome == SaveOutcome::kOffered || answer.hash == decltype(answer.hash){});
  return is_right && is_printable(answer.words) ? std::optional(answer) : std::nullopt;
}

}  // namespace farfeel::codecs
