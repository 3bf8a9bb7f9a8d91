#include "slave_sim/session/contact_lane.h"

#include <algorithm>
#include <array>

#include "haptic_core/contact/penalty.h"
#include "transport/message.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::int64_t kWait_ns = 20'000'000;     // longest before a new session or a stop is noticed
constexpr std::int64_t kPublish_ns = 50'000'000;  // the report is some kilobytes: not with every answer
// Answers go out at 1 kHz at most, whatever the poses come at. A pose that comes early by the jitter of a sender at
// just that rate is answered at once.
constexpr std::int64_t kAnswerPeriod_ns = 1'000'000, kAnswerEarly_ns = 300'000;
constexpr double kMostLineStep_s = 0.005;  // of a tool that is simulated here: a longer gap it did not live through
constexpr std::size_t kQueuedEdits = 64, kMostEditsAtOnce = 16;  // of some tens of microseconds each
constexpr int kMostDatagramsAtOnce = 64;                         // before a pose is answered: 13 ms of them at 5 kHz

}  // namespace

ContactLane::ContactLane(transport::LaneSocket socket, ContactSource& contacts, const codecs::PoseGrid& grid,
                         const tool::MassProperties& body)
    : socket_(std::move(socket)),
      number_(socket_.number()),
      contacts_(contacts),
      body_(body),
      edits_(kQueuedEdits),
      grid_(grid) {}

const ContactLane::Report& ContactLane::report() noexcept {
  published_.refresh();
  return published_.latest();
}

void ContactLane::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const std::int64_t until_ns = transport::monotonic_ns() + kWait_ns;
    socket_.wait_until(is_owed_ ? std::min(until_ns, next_answer_ns_ - kAnswerEarly_ns) : until_ns);
    adopt_session();
    take_edits();
    take_poses();
    prove_master();
    if (is_owed_ && may_answer(transport::monotonic_ns())) answer();
    if (const std::int64_t now = transport::monotonic_ns(); now - published_ns_ >= kPublish_ns) {
      published_ns_ = now;
      report_.poses = lane_.counters();
      report_.rejects = lane_.rejects();
      report_.moves = path_.moves();
      published_.store(report_);
    }
  }
}

// Grants first: the io thread tells of a session before it grants keys for it, so each grant's session is seen below.
void ContactLane::adopt_session() {
  std::array<transport::HapticGrant, kQueuedGrants> grants;
  std::size_t count = 0;
  while (count < grants.size() && grants_.pop(grants[count])) ++count;
  if (const std::uint32_t id = session_.load(std::memory_order_acquire); id != live_) begin_session(id);
  for (std::size_t i = 0; i < count; ++i) {
    if (grants[i].keys.session != live_) continue;
    lane_.adopt(grants[i].keys);
    ++report_.handshakes;
    path_.on_handshake(grants[i].asked_from, grants[i].keys.generation);
  }
}

void ContactLane::begin_session(std::uint32_t id) {
  live_ = id;
  lane_ = transport::SealedLane(transport::SealedLane::Role::kResponder);
  path_.forget();
  socket_.disconnect();
  heard_ns_.store(0, std::memory_order_relaxed);
  scene_time_.store({});
  report_ = {};
  report_.session = live_;
  published_ns_ = 0;
  contacts_.restart();
  line_.reset();
  answers_.reset(grid_);
  is_owed_ = false;
}

void ContactLane::take_edits() noexcept {
  SurfaceEdit edit;
  for (std::size_t i = 0; i < kMostEditsAtOnce && edits_.pop(edit); ++i) contacts_.edit(edit);
  motion::ObjectCourse told;
  for (std::size_t i = 0; i < kQueuedCourses && courses_.pop(told); ++i) contacts_.set_out(told);
}

void ContactLane::take_poses() {
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
    const auto received = socket_.receive(buffer);
    if (!received) break;
    accept(*received, std::span(buffer).first(received->bytes.size()));
  }
}

void ContactLane::accept(const transport::Received& received, std::span<std::byte> bytes) {
  if (transport::receiver_index(bytes) == 0)
    return socket_.give_back(received);  // a handshake, which is the io thread's
  const auto opened = lane_.open(bytes, received.time_ns);
  if (!opened || opened->session != live_) return;
  heard_ns_.store(received.time_ns, std::memory_order_relaxed);
  report_.up.on_datagram(received);
  path_.on_authentic(received.from, bytes.size(), opened->is_newest, opened->generation);
  if (opened->is_newest && !socket_.is_connected_to(received.from, received.to))  // either end may have moved
    (void)socket_.connect_to(received.from, received.to);  // if it fails, the next datagram tries again
  switch (static_cast<transport::MessageType>(opened->type)) {
    case transport::MessageType::kPoseSample:
      return take_pose(opened->message, opened->is_newest, received.time_ns);
    case transport::MessageType::kChallengeAnswer:
      return path_.on_answer(received.from, opened->message);
    default:
      return;
  }
}

void ContactLane::take_pose(std::span<const std::byte> payload, bool is_newest, std::int64_t arrival_ns) {
  codecs::PoseMessage pose;
  if (codecs::read(payload, grid_, pose) != codecs::Fault::kNone) {
    ++report_.malformed;
    return;
  }
  answers_.acknowledge(pose.heard);
  report_.up.on_transit(pose.times.t_send_us, static_cast<std::uint32_t>(arrival_ns / 1000));
  if (!is_newest) return;
  pose_ = pose;
  pose_arrival_ns_ = arrival_ns;
  scene_time_.store({1000 * static_cast<std::int64_t>(pose.time_us), arrival_ns});
  is_owed_ = true;
}

// What a line carries counts every one: it is answered as it comes.
bool ContactLane::may_answer(std::int64_t now_ns) const {
  return pose_.line.moves_remote_tool() || now_ns >= next_answer_ns_ - kAnswerEarly_ns;
}

void ContactLane::prove_master() {
  std::array<std::byte, transport::kMaxDatagramBytes> datagram;
  if (const auto challenge = path_.challenge(transport::monotonic_ns()))
    send(transport::MessageType::kChallenge, *challenge, datagram);
}

/// The message may stand at its place in the datagram already. Returns the datagram's size, or 0: it did not leave.
std::size_t ContactLane::send(transport::MessageType type, std::span<const std::byte> message,
                              std::span<std::byte> datagram) {
  if (!path_.may_send(message.size() + transport::kSealBytes, type == transport::MessageType::kChallenge)) return 0;
  const std::size_t size = lane_.seal(static_cast<std::uint8_t>(type), message, datagram, transport::monotonic_ns());
  if (size == 0 || !socket_.send(datagram.first(size))) return 0;
  path_.on_sent(size);
  const std::size_t on_wire = size + transport::overhead_to(*socket_.peer());
  sent_bytes_.store(sent_bytes_.load(std::memory_order_relaxed) + on_wire, std::memory_order_relaxed);
  return size;
}

/// The tool is simulated here; what came over the line moves it.
const contact_service::Answer& ContactLane::answer_line() {
  if (!line_ || !line_->is_for(pose_.line)) {
    line_.emplace(pose_.line.by, body_, pose_.X_WT);
    line_time_ns_ = 1000 * pose_.time_us;
  }
  const double dt_s =
      std::clamp(1e-9 * static_cast<double>(1000 * pose_.time_us - line_time_ns_), 0.0, kMostLineStep_s);
  line_time_ns_ = 1000 * pose_.time_us;
  const tool::RigidTool& tool = line_->tool();
  const contact_service::Answer& found = contacts_.answer({pose_.number, 1000 * pose_.time_us, tool.X_WT, tool.V_WT_W});
  tool::LinearResponse response;
  response.F_To_W = spatial::to_vector6(found.F_To_W);
  for (std::uint32_t i = 0; i < found.count; ++i)
    response.by_pose -= contact::penalty_stiffness(found.contacts[i], spatial::Matrix6::Zero());
  answer_.line = line_->answer(pose_.line, response, dt_s);
  if (!spatial::is_valid(tool.X_WT) || !spatial::is_finite(tool.V_WT_W)) line_.reset();  // begins anew at the next pose
  return found;
}

void ContactLane::answer() {
  const std::int64_t began_ns = transport::monotonic_ns();
  next_answer_ns_ = std::max(next_answer_ns_ + kAnswerPeriod_ns, began_ns);
  is_owed_ = false;
  answer_.line.reset();
  const std::int64_t time_ns = 1000 * pose_.time_us;
  // Asked for where the tool will be, the slave computes at a pose that the wire can tell exactly.
  const spatial::Pose X_WT =
      pose_.ahead_us == 0 ? pose_.X_WT
                          : codecs::on_grid(spatial::integrate(pose_.X_WT, pose_.V_WT_W, 1e-6 * pose_.ahead_us), grid_);
  const contact_service::Answer& found =
      pose_.line.moves_remote_tool()
          ? answer_line()
          : contacts_.answer({pose_.number, time_ns, X_WT, pose_.V_WT_W, pose_.wants_curvature});
  answer_.set = found;
  widest_m_.store(found.times.widest_m, std::memory_order_relaxed);
  newest_look_.store(found.at_proxy({pose_.number, time_ns, pose_.X_WT, pose_.V_WT_W}));
  const std::int64_t now_ns = transport::monotonic_ns();
  report_.answer_time.add(now_ns - began_ns);
  report_.waiting.add(began_ns - pose_arrival_ns_);
  ++report_.answered;
  if (report_.first_answer_ns == 0) report_.first_answer_ns = now_ns;
  report_.last_answer_ns = now_ns;
  // The master takes out of its round trip what is told here: the computing. What the pose waited in the socket, and
  // for this thread, is left in, for to the hand it is as long as if it were waited on the way.
  answer_.times = codecs::times_now(pose_.times.t_send_us, began_ns, now_ns);

  std::array<std::byte, transport::kMaxDatagramBytes> datagram;
  const auto room = std::span(datagram).subspan(transport::kDataHeaderBytes + 1, transport::kMaxMessageBytes);
  const std::size_t size = answers_.write(answer_, pose_.X_WT, room);
  if (size == 0) return;
  report_.left_out += answers_.left_out();
  if (send(transport::MessageType::kContactSet, room.first(size), datagram) > 0) ++report_.sent;
}

}  // namespace farfeel::slave_sim
