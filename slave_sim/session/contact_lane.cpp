#include "slave_sim/session/contact_lane.h"

#include <algorithm>
#include <array>

#include "haptic_core/contact/penalty.h"
#include "transport/packet.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::int64_t kWait_ns = 20'000'000;     // longest before a new session or a stop is noticed
constexpr std::int64_t kPublish_ns = 50'000'000;  // the report is some kilobytes: not with every answer
constexpr double kMostLineStep_s = 0.005;  // of a tool that is simulated here: a longer gap it did not live through
constexpr std::size_t kQueuedEdits = 64, kMostEditsAtOnce = 16;  // of some tens of microseconds each
constexpr int kMostDatagramsAtOnce = 4096;                       // bounds a drain while somebody floods the port

}  // namespace

ContactLane::ContactLane(transport::UdpSocket socket, ContactSource& contacts, const tool::MassProperties& body)
    : socket_(std::move(socket)), contacts_(contacts), body_(body), edits_(kQueuedEdits) {}

const ContactLane::Report& ContactLane::report() noexcept {
  published_.refresh();
  return published_.latest();
}

void ContactLane::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    socket_.wait_until(transport::monotonic_ns() + kWait_ns);
    adopt_session();
    take_edits();
    if (take_newest_pose()) answer();
    if (const std::int64_t now = transport::monotonic_ns(); now - published_ns_ >= kPublish_ns) {
      published_ns_ = now;
      report_.poses = window_.counters();
      published_.store(report_);
    }
  }
}

void ContactLane::adopt_session() {
  if (!session_.refresh() || session_.latest().id == live_.id) return;
  live_ = session_.latest();
  has_peer_ = false;
  window_ = {};
  sequence_ = 0;
  heard_ns_.store(0, std::memory_order_relaxed);
  report_ = {};
  report_.session = live_.id;
  published_ns_ = 0;
  contacts_.restart();
  line_.reset();
}

void ContactLane::take_edits() noexcept {
  SurfaceEdit edit;
  for (std::size_t i = 0; i < kMostEditsAtOnce && edits_.pop(edit); ++i) contacts_.edit(edit);
}

bool ContactLane::take_newest_pose() {
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  bool has_new = false;
  for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
    const auto received = socket_.receive(buffer);
    if (!received) break;
    has_new = accept(*received) || has_new;
  }
  return has_new;
}

// A datagram changes something only if all of it is right: session, sender, payload, and then its place in the order.
bool ContactLane::accept(const transport::Received& received) {
  const transport::Packet packet = transport::read_packet(received.bytes);
  if (!packet.ok() || packet.header.type != transport::PacketType::kPoseSample) return false;
  if (live_.id == 0 || packet.header.session != live_.id) return false;
  if (has_peer_ ? received.from != peer_ : !received.from.has_ip_of(live_.control)) return false;
  codecs::PoseSample sample;
  if (codecs::read(packet.payload, sample) != codecs::Fault::kNone) {
    ++report_.malformed;
    return false;
  }
  const auto verdict = window_.accept(packet.header.sequence);
  if (verdict == transport::SequenceWindow::Verdict::kAbsurd) {
    ++report_.malformed;
    return false;
  }
  peer_ = received.from;
  has_peer_ = true;
  heard_ns_.store(received.time_ns, std::memory_order_relaxed);
  if (verdict != transport::SequenceWindow::Verdict::kNewest) return false;
  pose_ = sample;
  pose_arrival_ns_ = received.time_ns;
  return true;
}

/// The tool is simulated here; what came over the line moves it.
void ContactLane::answer_line() {
  if (!line_ || line_controller_ != pose_.controller) {
    line_.emplace(pose_.controller, body_, pose_.X_WT);
    line_controller_ = pose_.controller;
    line_time_ns_ = pose_.time_ns;
  }
  const double dt_s = std::clamp(1e-9 * static_cast<double>(pose_.time_ns - line_time_ns_), 0.0, kMostLineStep_s);
  line_time_ns_ = pose_.time_ns;
  const tool::RigidTool& tool = line_->tool();
  answer_.set = contacts_.answer({pose_.sequence, pose_.time_ns, tool.X_WT, tool.V_WT_W});
  tool::LinearResponse response;
  response.F_To_W = spatial::to_vector6(answer_.set.F_To_W);
  for (std::uint32_t i = 0; i < answer_.set.count; ++i)
    response.by_pose -= contact::penalty_stiffness(answer_.set.contacts[i], spatial::Matrix6::Zero());
  answer_.line = line_->answer(pose_.line, response, dt_s);
  if (!spatial::is_valid(tool.X_WT) || !spatial::is_finite(tool.V_WT_W)) line_.reset();  // begins anew at the next pose
}

void ContactLane::answer() {
  const std::int64_t began_ns = transport::monotonic_ns();
  answer_.line.reset();
  if (pose_.controller == teleoperation::Controller::kOurs) {
    const spatial::Pose X_WT = spatial::integrate(pose_.X_WT, pose_.V_WT_W, 1e-6 * pose_.ahead_us);
    answer_.set = contacts_.answer({pose_.sequence, pose_.time_ns, X_WT, pose_.V_WT_W, pose_.wants_curvature});
  } else {
    answer_line();
  }
  widest_m_.store(contacts_.widest_m(), std::memory_order_relaxed);
  newest_look_.store(contacts_.at_proxy({pose_.sequence, pose_.time_ns, pose_.X_WT, pose_.V_WT_W}));
  const std::int64_t now_ns = transport::monotonic_ns();
  report_.answer_time.add(now_ns - began_ns);
  ++report_.answered;
  if (report_.first_answer_ns == 0) report_.first_answer_ns = now_ns;
  report_.last_answer_ns = now_ns;
  answer_.times.t_send_ns = now_ns;
  answer_.times.t_echo_ns = pose_.times.t_send_ns;
  const std::int64_t hold_us = (now_ns - pose_arrival_ns_ + 500) / 1000;
  answer_.times.hold_us = static_cast<std::uint32_t>(std::clamp<std::int64_t>(hold_us, 0, 0xFFFF'FFFF));

  std::array<std::byte, transport::kMaxDatagramBytes> datagram;
  const auto room = std::span(datagram).subspan(transport::kHeaderBytes);
  const std::size_t size = codecs::write(answer_, room);
  const std::size_t total =
      transport::write_packet({transport::PacketType::kContactSet, live_.id, ++sequence_}, room.first(size), datagram);
  if (socket_.send_to(peer_, std::span(datagram).first(total))) ++report_.sent;
  report_.left_out += answer_.set.count - codecs::contacts_that_fit(answer_);
}

}  // namespace farfeel::slave_sim
