#include "codecs/view/view_messages.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/doubts.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using transport::ByteReader;
using transport::ByteWriter;

constexpr double kQuantised = 65535;  // steps across a box
constexpr std::size_t kMostTickBytes = 64 * 1024;
constexpr std::uint8_t kMostState = 4, kMostFault = 31, kMostRung = 3;
constexpr std::size_t kVertexBytes = 6, kTriangleBytes = 12, kPushBytes = 48;

/// Room for a message, and its version and kind; taken() cuts it to what was written.
class Message {
 public:
  Message(ViewKind kind, std::size_t most) : bytes_(most), writer(bytes_) {
    writer.u8(kViewVersion);
    writer.u8(static_cast<std::uint8_t>(kind));
  }
  [[nodiscard]] std::vector<std::byte> taken() {
    bytes_.resize(writer.ok() ? writer.size() : 0);
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;

 public:
  ByteWriter writer;
};

void write(ByteWriter& to, const glm::dvec3& v) {
  for (int i = 0; i < 3; ++i) to.f64(v[i]);
}
void write(ByteWriter& to, const glm::vec3& v) {
  for (int i = 0; i < 3; ++i) to.f32(static_cast<double>(v[i]));
}
void write(ByteWriter& to, const spatial::Pose& X) {
  write(to, X.p);
  for (const double q : {X.R.w, X.R.x, X.R.y, X.R.z}) to.f64(q);
}
void write(ByteWriter& to, const spatial::Wrench& F) {
  write(to, F.torque_Nm);
  write(to, F.force_N);
}
/// Cut where it is too long.
void write(ByteWriter& to, const std::string& text) {
  const std::size_t size = std::min(text.size(), kMostViewText);
  to.u16(static_cast<std::uint16_t>(size));
  to.bytes(std::as_bytes(std::span(text.data(), size)));
}

/// Reads, and remembers whether all was within its range.
class Checked {
 public:
  Checked(std::span<const std::byte> message, ViewKind kind) : from(message) {
    is_right_ = kind_of_view(message) == kind;
    (void)from.u16();
  }
  void demand(bool holds) { is_right_ = is_right_ && holds; }
  [[nodiscard]] bool is_right() const { return is_right_ && from.ok(); }
  [[nodiscard]] bool is_whole() const { return is_right() && from.is_at_end(); }
  glm::dvec3 vec3() {
    glm::dvec3 v;
    for (int i = 0; i < 3; ++i) v[i] = from.f64();
    demand(spatial::is_finite(v));
    return v;
  }
  glm::vec3 vec3f() {
    glm::dvec3 v;
    for (int i = 0; i < 3; ++i) v[i] = from.f32();
    demand(spatial::is_finite(v));
    return glm::vec3(v);
  }
  spatial::Pose pose() {
    spatial::Pose X;
    X.p = vec3();
    X.R.w = from.f64(), X.R.x = from.f64(), X.R.y = from.f64(), X.R.z = from.f64();
    demand(spatial::is_valid(X));
    return X;
  }
  spatial::Wrench wrench() {
    spatial::Wrench F;
    F.torque_Nm = vec3();
    F.force_N = vec3();
    return F;
  }
  std::string text() {
    const std::size_t size = from.u16();
    demand(size <= kMostViewText);
    if (!is_right()) return {};
    const auto bytes = from.bytes(size);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  template <typename Number>
  Number at_most(Number value, std::size_t most) {
    demand(value <= most);
    return value;
  }
  ByteReader from;

 private:
  bool is_right_ = false;
};

void write(ByteWriter& to, const local_model::Push& push) {
  to.u32(push.object);
  to.u8(push.doubts);
  to.u8(static_cast<std::uint8_t>(push.source));
  to.u16(push.is_leaving);
  write(to, push.p_WC_W);
  write(to, push.nhat_ST_W);
  write(to, push.force_N);
  to.f32(static_cast<double>(push.depth_m));
}
local_model::Push read_push(Checked& in) {
  local_model::Push push;
  push.object = in.from.u32();
  push.doubts = in.from.u8();
  push.source = static_cast<local_model::Source>(
      in.at_most(in.from.u8(), static_cast<std::size_t>(local_model::Source::kOldRemote)));
  push.is_leaving = in.at_most(in.from.u16(), 1) != 0;
  push.p_WC_W = in.vec3f();
  push.nhat_ST_W = in.vec3f();
  push.force_N = in.vec3f();
  push.depth_m = static_cast<float>(in.from.f32());
  in.demand((push.doubts & ~contact::kAllDoubts) == 0 && std::isfinite(push.depth_m));
  return push;
}

}  // namespace

void ViewBin::add(double value) noexcept {
  const auto v = static_cast<float>(value);
  if (std::isfinite(v)) add(ViewBin{v, v, v, 1});
}

void ViewBin::add(const ViewBin& other) noexcept {
  if (other.count == 0) return;
  if (count == 0) {
    *this = other;
    return;
  }
  low = std::min(low, other.low);
  high = std::max(high, other.high);
  const double all = static_cast<double>(count) + static_cast<double>(other.count);
  mean += static_cast<float>((static_cast<double>(other.mean) - static_cast<double>(mean)) *
                             (static_cast<double>(other.count) / all));
  count += other.count;
}

void ViewTick::absorb(const ViewTick& earlier) noexcept {
  ticks += earlier.ticks;
  for (std::size_t i = 0; i < bins.size(); ++i) bins[i].add(earlier.bins[i]);
}

ViewBody view_body(std::uint16_t index, std::string name, const spatial::Pose& X_WB,
                   const geometry::TriangleMesh& mesh_B) {
  ViewBody body{index, std::move(name), X_WB, {}, {}, {}, {}};
  if (mesh_B.positions_O.empty() || mesh_B.positions_O.size() > kMostViewVertices ||
      mesh_B.triangles.size() > kMostViewTriangles)
    return body;
  const geometry::Box box = geometry::bounding_box(mesh_B);
  body.low_B = box.low;
  body.step_B = box.size() / kQuantised;
  body.vertices.reserve(mesh_B.positions_O.size());
  for (const glm::dvec3& p : mesh_B.positions_O) {
    std::array<std::uint16_t, 3> vertex{};
    for (int i = 0; i < 3; ++i) {
      const double at = body.step_B[i] > 0 ? (p[i] - body.low_B[i]) / body.step_B[i] : 0;
      vertex[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(std::clamp(std::round(at), 0.0, kQuantised));
    }
    body.vertices.push_back(vertex);
  }
  body.triangles = mesh_B.triangles;
  return body;
}

std::vector<std::byte> write_view(const ViewScene& scene) {
  Message message(ViewKind::kScene, 16 + kMostViewText);
  write(message.writer, scene.name);
  message.writer.u16(scene.bodies);
  return message.taken();
}

std::vector<std::byte> write_view(const ViewBody& body) {
  Message message(ViewKind::kBody,
                  256 + kMostViewText + kVertexBytes * body.vertices.size() + kTriangleBytes * body.triangles.size());
  ByteWriter& to = message.writer;
  to.u16(body.index);
  write(to, body.name);
  write(to, body.X_WB);
  write(to, body.low_B);
  write(to, body.step_B);
  to.u32(static_cast<std::uint32_t>(body.vertices.size()));
  to.u32(static_cast<std::uint32_t>(body.triangles.size()));
  to.bytes(std::as_bytes(std::span(body.vertices)));
  to.bytes(std::as_bytes(std::span(body.triangles)));
  return message.taken();
}

std::vector<std::byte> write_view(const ViewTick& tick) {
  Message message(ViewKind::kTick, kMostTickBytes);
  ByteWriter& to = message.writer;
  to.u64(tick.number);
  to.i64(tick.time_ns);
  to.i64(tick.told_ns);
  for (const std::uint8_t byte : {tick.state, tick.fault, tick.rung, tick.flags}) to.u8(byte);
  write(to, tick.X_WT);
  write(to, tick.X_WI);
  write(to, tick.F_hand_W);
  write(to, tick.F_contact_To_W);
  to.f64(tick.depth_max_m);
  to.u32(tick.pressing);
  to.u32(tick.ticks);
  for (const ViewBin& bin : tick.bins) {
    for (const float v : {bin.low, bin.high, bin.mean}) to.f32(static_cast<double>(v));
    to.u32(bin.count);
  }
  to.u16(static_cast<std::uint16_t>(tick.pushes.count));
  for (std::uint32_t i = 0; i < tick.pushes.count; ++i) write(to, tick.pushes.of[i]);
  to.u16(static_cast<std::uint16_t>(tick.moving.size()));
  for (const auto& [body, X_WB] : tick.moving) {
    to.u16(body);
    write(to, X_WB);
  }
  return message.taken();
}

std::vector<std::byte> write_view(const ViewStatus& status) {
  const std::size_t words = std::min(status.words.size(), kMostViewWords);
  Message message(ViewKind::kStatus, 16 + (2 + 2 * kMostViewWords) * (2 + kMostViewText));
  ByteWriter& to = message.writer;
  to.u8(status.is_trouble);
  write(to, status.happened);
  write(to, status.to_do);
  to.u8(static_cast<std::uint8_t>(words));
  for (std::size_t i = 0; i < words; ++i) {
    write(to, status.words[i].first);
    write(to, status.words[i].second);
  }
  return message.taken();
}

std::vector<std::byte> write_view(ViewVerb verb) {
  Message message(ViewKind::kControl, 8);
  message.writer.u8(static_cast<std::uint8_t>(verb));
  return message.taken();
}

std::vector<std::byte> write_view_token(const std::string& token) {
  Message message(ViewKind::kToken, 8 + token.size());
  message.writer.bytes(std::as_bytes(std::span(token)));
  return message.taken();
}

std::vector<std::byte> write_view_taken(std::uint64_t number) {
  Message message(ViewKind::kTaken, 16);
  message.writer.u64(number);
  return message.taken();
}

std::optional<ViewKind> kind_of_view(std::span<const std::byte> message) noexcept {
  if (message.size() < 2 || message.size() > kMostViewBytes) return std::nullopt;
  const auto kind = std::to_integer<std::uint8_t>(message[1]);
  if (std::to_integer<std::uint8_t>(message[0]) != kViewVersion || kind < 1 ||
      kind > static_cast<std::uint8_t>(ViewKind::kTaken))
    return std::nullopt;
  return static_cast<ViewKind>(kind);
}

std::optional<ViewScene> read_view_scene(std::span<const std::byte> message) {
  Checked in(message, ViewKind::kScene);
  ViewScene scene;
  scene.name = in.text();
  scene.bodies = in.at_most(in.from.u16(), kMostViewBodies);
  return in.is_whole() ? std::optional(std::move(scene)) : std::nullopt;
}

std::optional<ViewBody> read_view_body(std::span<const std::byte> message) {
  Checked in(message, ViewKind::kBody);
  ViewBody body;
  body.index = in.from.u16();
  in.demand(body.index < kMostViewBodies);
  body.name = in.text();
  body.X_WB = in.pose();
  body.low_B = in.vec3();
  body.step_B = in.vec3();
  const std::size_t vertices = in.at_most(in.from.u32(), kMostViewVertices);
  const std::size_t triangles = in.at_most(in.from.u32(), kMostViewTriangles);
  if (!in.is_right() || in.from.remaining() != kVertexBytes * vertices + kTriangleBytes * triangles)
    return std::nullopt;
  body.vertices.resize(vertices);
  for (auto& vertex : body.vertices)
    for (std::uint16_t& coordinate : vertex) coordinate = in.from.u16();
  body.triangles.resize(triangles);
  for (geometry::Triangle& triangle : body.triangles) {
    for (std::uint32_t& corner : triangle) {
      corner = in.from.u32();
      in.demand(corner < vertices);
    }
  }
  return in.is_whole() ? std::optional(std::move(body)) : std::nullopt;
}

std::optional<ViewTick> read_view_tick(std::span<const std::byte> message) {
  Checked in(message, ViewKind::kTick);
  ViewTick tick;
  tick.number = in.from.u64();
  tick.time_ns = in.from.i64();
  tick.told_ns = in.from.i64();
  tick.state = in.at_most(in.from.u8(), kMostState);
  tick.fault = in.at_most(in.from.u8(), kMostFault);
  tick.rung = in.at_most(in.from.u8(), kMostRung);
  tick.flags = in.at_most(in.from.u8(), ViewTick::kResting);
  tick.X_WT = in.pose();
  tick.X_WI = in.pose();
  tick.F_hand_W = in.wrench();
  tick.F_contact_To_W = in.wrench();
  tick.depth_max_m = in.from.f64();
  in.demand(std::isfinite(tick.depth_max_m));
  tick.pressing = in.from.u32();
  tick.ticks = in.from.u32();
  for (ViewBin& bin : tick.bins) {
    bin.low = static_cast<float>(in.from.f32());
    bin.high = static_cast<float>(in.from.f32());
    bin.mean = static_cast<float>(in.from.f32());
    bin.count = in.from.u32();
    const bool is_finite = std::isfinite(bin.low) && std::isfinite(bin.high) && std::isfinite(bin.mean);
    in.demand(bin.count == 0 ? std::isnan(bin.low) && std::isnan(bin.high) && std::isnan(bin.mean) : is_finite);
  }
  tick.pushes.count = in.at_most(in.from.u16(), local_model::kMostPushes);
  if (!in.is_right() || in.from.remaining() < kPushBytes * tick.pushes.count) return std::nullopt;
  for (std::uint32_t i = 0; i < tick.pushes.count; ++i) tick.pushes.of[i] = read_push(in);
  const std::size_t moving = in.at_most(in.from.u16(), kMostViewMoving);
  if (!in.is_right()) return std::nullopt;
  for (std::size_t i = 0; i < moving && in.is_right(); ++i) {
    const std::uint16_t body = in.from.u16();
    in.demand(body < kMostViewBodies);
    tick.moving.emplace_back(body, in.pose());
  }
  return in.is_whole() ? std::optional(std::move(tick)) : std::nullopt;
}

std::optional<ViewStatus> read_view_status(std::span<const std::byte> message) {
  Checked in(message, ViewKind::kStatus);
  ViewStatus status;
  status.is_trouble = in.at_most(in.from.u8(), 1) != 0;
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
  Checked in(message, ViewKind::kControl);
  const std::uint8_t verb = in.from.u8();
  in.demand(verb >= 1 && verb <= static_cast<std::uint8_t>(ViewVerb::kResetFault));
  return in.is_whole() ? std::optional(static_cast<ViewVerb>(verb)) : std::nullopt;
}

std::optional<std::string> read_view_token(std::span<const std::byte> message) {
  Checked in(message, ViewKind::kToken);
  if (!in.is_right() || in.from.remaining() != kViewTokenBytes) return std::nullopt;
  const auto bytes = in.from.bytes(kViewTokenBytes);
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::optional<std::uint64_t> read_view_taken(std::span<const std::byte> message) noexcept {
  Checked in(message, ViewKind::kTaken);
  const std::uint64_t number = in.from.u64();
  return in.is_whole() ? std::optional(number) : std::nullopt;
}

}  // namespace farfeel::codecs
