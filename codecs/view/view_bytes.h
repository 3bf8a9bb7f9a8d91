// What all messages of the live view are written and read with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "codecs/view/view_messages.h"
#include "haptic_core/spatial/spatial.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {

/// Room for a message, and its version and kind; taken() cuts it to what was written.
class ViewMessage {
 public:
  ViewMessage(ViewKind kind, std::size_t most);
  [[nodiscard]] std::vector<std::byte> taken();

  void write(const glm::dvec3&);
  void write(const glm::vec3&);
  void write(const spatial::Pose&);
  void write(const spatial::Wrench&);
  void write(const std::string& text);  ///< cut where it is too long

 private:
  std::vector<std::byte> bytes_;

 public:
  transport::ByteWriter to;
};

/// Reads, and remembers whether all was within its range.
class ViewReader {
 public:
  ViewReader(std::span<const std::byte> message, ViewKind kind);
  void demand(bool holds) { is_right_ = is_right_ && holds; }
  [[nodiscard]] bool is_right() const { return is_right_ && from.ok(); }
  [[nodiscard]] bool is_whole() const { return is_right() && from.is_at_end(); }

  glm::dvec3 vec3();
  glm::vec3 vec3f();
  double number();  ///< finite
  spatial::Pose pose();
  spatial::Wrench wrench();
  std::string text();
  bool yes() { return at_most(from.u8(), 1) != 0; }
  template <typename Number>
  Number at_most(Number value, std::size_t most) {
    demand(value <= most);
    return value;
  }

  transport::ByteReader from;

 private:
  bool is_right_ = false;
};

}  // namespace farfeel::codecs
