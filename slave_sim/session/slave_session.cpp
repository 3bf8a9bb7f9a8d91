#include "slave_sim/session/slave_session.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>

#include "codecs/felt/session_object.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::int64_t kStatus_ns = 200'000'000;
constexpr std::int64_t kWait_ns = 50'000'000;  // longest before a stop is noticed
constexpr int kMostDatagramsAtOnce = 256;      // between two looks at the clock
constexpr int kMostStrangersAtOnce = 64;
constexpr int kMostTilesAtOnce = 16;  // between two reads of the socket
// Between two looks at the allow-list: a revoked operator is out within 1 s.
constexpr std::int64_t kList_ns = 250'000'000;

}  // namespace

tl::expected<std::unique_ptr<SlaveSession>, transport::Error> SlaveSession::start(const Options& options,
                                                                                  const std::vector<std::byte>& scene,
                                                                                  ContactSource& contacts,
                                                                                  const Felt& felt) {
  std::vector<std::byte> object(codecs::kPoseGridBytes);
  (void)codecs::write(options.grid, object);
  const std::vector<std::byte> parts = codecs::session_object({scene, felt.outline});
  object.insert(object.end(), parts.begin(), parts.end());
  if (scene.empty() || object.size() > transport::kMaxObjectBytes)
    return tl::unexpected(transport::Error{
        transport::ErrorKind::kProtocol,
        "cannot serve a scene of " + std::to_string(scene.size()) + " bytes: it must have between 1 byte and 64 MiB"});
  auto port = transport::ListeningPort::open(options.local, {.also_ipv4 = options.local.is_any()});
  if (!port) return tl::unexpected(port.error());
  auto bulk = port->make_lane(transport::Dscp::kBestEffort);
  if (!bulk) return tl::unexpected(bulk.error());
  auto haptic = port->make_lane(transport::Dscp::kExpedited);
  if (!haptic) return tl::unexpected(haptic.error());
  return std::unique_ptr<SlaveSession>(new SlaveSession(options, std::move(object), contacts, felt.tiles,
                                                        *std::move(port), *std::move(bulk), *std::move(haptic)));
}

SlaveSession::SlaveSession(const Options& options, std::vector<std::byte> object, ContactSource& contacts,
                           TileFeed* tiles, transport::ListeningPort port, transport::LaneSocket bulk,
                           transport::LaneSocket haptic)
    : log_(options.log ? options.log : [](const std::string&) {}),
      look_at_list_(options.look_at_list ? options.look_at_list : [] {}),
      port_(std::move(port)),
      local_(port_.local()),
      bulk_(std::move(bulk)),
      lane_(std::move(haptic), contacts, options.grid, options.body),
      tiles_(tiles),
      server_({options.own, transport::random_identity(), options.find, transport::make_object(std::move(object))}),
      send_([this](const transport::Address& to, std::span<const std::byte> datagram) { send(to, datagram); }),
      // A thread names itself: the name of another one is a file to be written, and a confined slave writes none.
      contact_thread_([this](const std::stop_token& stop) {
        pthread_setname_np(pthread_self(), "contact");
        lane_.run(stop);
      }),
      io_thread_([this](const std::stop_token& stop) {
        pthread_setname_np(pthread_self(), "io");
        run_io(stop);
      }) {}

SlaveSession::~SlaveSession() = default;

void SlaveSession::edit(const SurfaceEdit& edit) {
  constexpr std::chrono::milliseconds kCatchUp{1};
  while (!lane_.edit(edit)) std::this_thread::sleep_for(kCatchUp);
  while (tiles_ && !tile_edits_.push(edit)) std::this_thread::sleep_for(kCatchUp);
}

void SlaveSession::tell_of_changes(std::int64_t now_ns) {
  const std::uint32_t id = server_.session() ? server_.session()->id : 0;
  const bool is_silent = server_.is_silent(now_ns);
  has_master_.store(id != 0 && !is_silent, std::memory_order_relaxed);
  if (id == live_ && is_silent != is_silent_) {
    log_(is_silent ? "nothing was heard from the master for 2 s; it may come back" : "the master is heard again");
  }
  is_silent_ = is_silent;
  if (id == live_) return;
  if (live_ != 0) log_("session ended: " + server_.last_end());
  live_ = id;
  status_ns_ = 0;
  lane_.set_session(id);
  if (id == 0) return;
  if (tiles_) tiles_->restart();
  log_("session started with " + server_.session()->operator_name + " at " +
       transport::to_string(*server_.bulk_address()));
}

codecs::SlaveStatus SlaveSession::status() {
  const ContactLane::Report& report = lane_.report();
  codecs::SlaveStatus status;
  if (report.session != live_) return status;  // the contact thread has not taken the session over yet
  if (const std::int64_t span_ns = report.last_answer_ns - report.first_answer_ns; span_ns > 0)
    status.contact_hz = static_cast<double>(report.answered - 1) * 1e9 / static_cast<double>(span_ns);
  status.contact_us_p50 = static_cast<double>(report.answer_time.quantile_ns(0.5)) * 1e-3;
  status.contact_us_p99 = static_cast<double>(report.answer_time.quantile_ns(0.99)) * 1e-3;
  status.contact_us_max = static_cast<double>(report.answer_time.max_ns()) * 1e-3;
  status.poses_received = report.poses.received;
  status.poses_lost = report.poses.lost;
  status.poses_late = report.poses.late;
  status.poses_duplicate = report.poses.duplicate;
  status.poses_malformed = report.malformed;
  status.contacts_sent = report.sent;
  status.contacts_left_out = report.left_out;
  return status;
}

void SlaveSession::feed_tiles(std::int64_t now_ns) {
  if (const contact_service::ToolPose* look = lane_.newest_look(); look && lane_.heard_ns() > 0)
    tiles_->aim(*look, lane_.widest_m(), now_ns);
  for (int i = 0; i < kMostTilesAtOnce; ++i) {
    const auto payload = tiles_->next(now_ns);
    if (!payload) break;
    server_.send_message(transport::MessageType::kTile, *payload, now_ns, send_);
  }
}

// To the master from its lane's socket; to others from the address that they asked.
void SlaveSession::send(const transport::Address& to, std::span<const std::byte> datagram) {
  if (bulk_.peer() == to) {
    bulk_.send(datagram);
  } else if (question_ != nullptr && question_->from == to) {
    port_.answer(*question_, datagram);
  }
}

// The bulk lane's socket goes where the master is; without one it hears nobody.
void SlaveSession::follow_master(const transport::Received* from) {
  const auto& master = server_.bulk_address();
  if (master == bulk_.peer()) return;
  if (!master) return bulk_.disconnect();
  if (from == nullptr || from->from != *master) return;
  const bool has_moved = bulk_.peer().has_value();
  if (!bulk_.connect_to(*master, from->to)) return;
  if (has_moved) log_("the master is at " + transport::to_string(*master) + " now");
}

void SlaveSession::take(const transport::Received& received, std::span<std::byte> bytes) {
  const std::int64_t now_ns = transport::monotonic_ns();
  question_ = &received;
  const auto outcome = server_.on_datagram(received.from, bytes, now_ns, transport::wall_clock_ns(), send_);
  question_ = nullptr;
  if (outcome.is_for_haptic) port_.pass_on(lane_.number(), received);
  if (outcome.message && tiles_) tiles_->on_acknowledge(outcome.message->payload, now_ns);
  follow_master(&received);
  tell_of_changes(now_ns);
  if (const auto grant = server_.take_haptic_grant()) lane_.give_keys(*grant);
}

void SlaveSession::run_io(const std::stop_token& stop) {
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  while (!stop.stop_requested()) {
    const std::int64_t before_ns = transport::monotonic_ns();
    std::int64_t until_ns = std::min(server_.next_time_ns(before_ns), before_ns + kWait_ns);
    if (tiles_ && has_master()) until_ns = std::min(until_ns, tiles_->next_time_ns(before_ns));
    transport::WaitSet wait;
    port_.add_to(wait);
    bulk_.add_to(wait);
    wait.wait_until(until_ns);
    // The master's own datagrams first, and a bounded number of strangers' after them.
    for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
      const auto received = bulk_.receive(buffer);
      if (!received) break;
      take(*received, std::span(buffer).first(received->bytes.size()));
    }
    for (int i = 0; i < kMostStrangersAtOnce; ++i) {
      const auto received = port_.receive(buffer);
      if (!received) break;
      take(*received, std::span(buffer).first(received->bytes.size()));
    }
    const std::int64_t now_ns = transport::monotonic_ns();
    SurfaceEdit edit;
    while (tiles_ && tile_edits_.pop(edit)) tiles_->edit(edit);
    if (const std::int64_t heard_ns = lane_.heard_ns(); heard_ns > 0 && lane_.report().session == live_)
      server_.heard_at(heard_ns);
    if (now_ns - list_ns_ >= kList_ns) {
      list_ns_ = now_ns;
      look_at_list_();
      server_.on_changed_list(now_ns, send_);
    }
    server_.on_time(now_ns, send_);
    follow_master(nullptr);
    tell_of_changes(now_ns);
    if (tiles_ && server_.may_send_bulk() && has_master()) feed_tiles(now_ns);
    if (live_ != 0 && now_ns - status_ns_ >= kStatus_ns) {
      std::array<std::byte, codecs::kSlaveStatusBytes> payload;
      const std::size_t size = codecs::write(status(), payload);
      status_ns_ = now_ns;
      server_.send_message(transport::MessageType::kSlaveStatus, std::span(payload).first(size), now_ns, send_);
    }
  }
  server_.end(transport::ByeReason::kDone, transport::monotonic_ns(), send_);
  tell_of_changes(transport::monotonic_ns());
}

}  // namespace farfeel::slave_sim
