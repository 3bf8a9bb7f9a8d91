#include "codecs/view/view_tick.h"

#include <algorithm>
#include <cmath>

#include "codecs/view/view_bytes.h"
#include "haptic_core/contact/doubts.h"

namespace farfeel::codecs {
namespace {

using Bins = std::array<ViewBin, kViewSeries>;

constexpr std::size_t kMostTickBytes = 64 * 1024;
constexpr std::uint8_t kMostState = 5, kMostFault = 31, kMostRung = 3;
constexpr std::size_t kPushBytes = 48, kMomentBytes = 8 + 16 * kViewSeries;

void write(ViewMessage& message, const local_model::Push& push) {
  message.to.u32(push.object);
  message.to.u8(push.doubts);
  message.to.u8(static_cast<std::uint8_t>(push.source));
  message.to.u16(push.is_leaving);
  message.write(push.p_WC_W);
  message.write(push.nhat_ST_W);
  message.write(push.force_N);
  message.to.f32(static_cast<double>(push.depth_m));
}
local_model::Push read_push(ViewReader& in) {
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

void write(ViewMessage& message, const Bins& bins) {
  for (const ViewBin& bin : bins) {
    for (const float v : {bin.low, bin.high, bin.mean}) message.to.f32(static_cast<double>(v));
    message.to.u32(bin.count);
  }
}

void read(ViewReader& in, Bins& bins) {
  for (ViewBin& bin : bins) {
    bin.low = static_cast<float>(in.from.f32());
    bin.high = static_cast<float>(in.from.f32());
    bin.mean = static_cast<float>(in.from.f32());
    bin.count = in.from.u32();
    const bool is_finite = std::isfinite(bin.low) && std::isfinite(bin.high) && std::isfinite(bin.mean);
    in.demand(bin.count == 0 ? std::isnan(bin.low) && std::isnan(bin.high) && std::isnan(bin.mean) : is_finite);
  }
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

std::vector<std::byte> write_view(const ViewTick& tick) {
  ViewMessage message(ViewKind::kTick, kMostTickBytes);
  message.to.u64(tick.number);
  message.to.i64(tick.time_ns);
  message.to.i64(tick.told_ns);
  for (const std::uint8_t byte : {tick.state, tick.fault, tick.rung, tick.flags}) message.to.u8(byte);
  message.write(tick.X_WT);
  message.write(tick.X_WI);
  message.write(tick.F_hand_W);
  message.write(tick.F_contact_To_W);
  message.to.f64(tick.depth_max_m);
  message.to.u32(tick.pressing);
  message.to.f64(tick.view_yaw_rad);
  message.to.u32(tick.ticks);
  write(message, tick.bins);
  message.to.u16(static_cast<std::uint16_t>(tick.pushes.count));
  for (std::uint32_t i = 0; i < tick.pushes.count; ++i) write(message, tick.pushes.of[i]);
  message.to.u16(static_cast<std::uint16_t>(tick.moving.size()));
  for (const ViewMoving& moving : tick.moving) {
    message.to.u16(moving.body);
    message.to.u16(moving.is_there ? 1 : 0);
    message.write(moving.X_WB);
  }
  return message.taken();
}

std::vector<std::byte> write_view(const ViewHistory& history) {
  const std::size_t moments = std::min(history.size(), kMostViewMoments);
  ViewMessage message(ViewKind::kHistory, 8 + kMomentBytes * moments);
  message.to.u16(static_cast<std::uint16_t>(moments));
  for (std::size_t i = history.size() - moments; i < history.size(); ++i) {
    message.to.i64(history[i].time_ns);
    write(message, history[i].bins);
  }
  return message.taken();
}

std::optional<ViewTick> read_view_tick(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kTick);
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
  tick.depth_max_m = in.number();
  tick.pressing = in.from.u32();
  tick.view_yaw_rad = in.number();
  tick.ticks = in.from.u32();
  read(in, tick.bins);
  tick.pushes.count = in.at_most(in.from.u16(), local_model::kMostPushes);
  if (!in.is_right() || in.from.remaining() < kPushBytes * tick.pushes.count) return std::nullopt;
  for (std::uint32_t i = 0; i < tick.pushes.count; ++i) tick.pushes.of[i] = read_push(in);
  const std::size_t moving = in.at_most(in.from.u16(), kMostViewMoving);
  if (!in.is_right()) return std::nullopt;
  for (std::size_t i = 0; i < moving && in.is_right(); ++i) {
    const std::uint16_t body = in.from.u16();
    const std::uint16_t is_there = in.from.u16();
    in.demand(body < kMostViewBodies && is_there <= 1);
    tick.moving.push_back({body, in.pose(), is_there == 1});
  }
  return in.is_whole() ? std::optional(std::move(tick)) : std::nullopt;
}

std::optional<ViewHistory> read_view_history(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kHistory);
  const std::size_t moments = in.at_most(in.from.u16(), kMostViewMoments);
  if (!in.is_right() || in.from.remaining() != kMomentBytes * moments) return std::nullopt;
  ViewHistory history(moments);
  for (ViewMoment& moment : history) {
    moment.time_ns = in.from.i64();
    read(in, moment.bins);
  }
  return in.is_whole() ? std::optional(std::move(history)) : std::nullopt;
}

}  // namespace farfeel::codecs
