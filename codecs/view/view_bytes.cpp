#include "codecs/view/view_bytes.h"

#include <algorithm>
#include <cmath>

namespace farfeel::codecs {

ViewMessage::ViewMessage(ViewKind kind, std::size_t most) : bytes_(most), to(bytes_) {
  to.u8(kViewVersion);
  to.u8(static_cast<std::uint8_t>(kind));
}

std::vector<std::byte> ViewMessage::taken() {
  bytes_.resize(to.ok() ? to.size() : 0);
  return std::move(bytes_);
}

void ViewMessage::write(const glm::dvec3& v) {
  for (int i = 0; i < 3; ++i) to.f64(v[i]);
}

void ViewMessage::write(const glm::vec3& v) {
  for (int i = 0; i < 3; ++i) to.f32(static_cast<double>(v[i]));
}

void ViewMessage::write(const spatial::Pose& X) {
  write(X.p);
  for (const double q : {X.R.w, X.R.x, X.R.y, X.R.z}) to.f64(q);
}

void ViewMessage::write(const spatial::Wrench& F) {
  write(F.torque_Nm);
  write(F.force_N);
}

void ViewMessage::write(const std::string& text) {
  const std::size_t size = std::min(text.size(), kMostViewText);
  to.u16(static_cast<std::uint16_t>(size));
  to.bytes(std::as_bytes(std::span(text.data(), size)));
}

ViewReader::ViewReader(std::span<const std::byte> message, ViewKind kind) : from(message) {
  is_right_ = kind_of_view(message) == kind;
  (void)from.u16();
}

glm::dvec3 ViewReader::vec3() {
  glm::dvec3 v;
  for (int i = 0; i < 3; ++i) v[i] = number();
  return v;
}

glm::vec3 ViewReader::vec3f() {
  glm::dvec3 v;
  for (int i = 0; i < 3; ++i) v[i] = from.f32();
  demand(spatial::is_finite(v));
  return glm::vec3(v);
}

double ViewReader::number() {
  const double value = from.f64();
  demand(std::isfinite(value));
  return value;
}

spatial::Pose ViewReader::pose() {
  spatial::Pose X;
  X.p = vec3();
  X.R.w = from.f64(), X.R.x = from.f64(), X.R.y = from.f64(), X.R.z = from.f64();
  demand(spatial::is_valid(X));
  return X;
}

spatial::Wrench ViewReader::wrench() {
  spatial::Wrench F;
  F.torque_Nm = vec3();
  F.force_N = vec3();
  return F;
}

std::string ViewReader::text() {
  const std::size_t size = from.u16();
  demand(size <= kMostViewText);
  if (!is_right()) return {};
  const auto bytes = from.bytes(size);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace farfeel::codecs
