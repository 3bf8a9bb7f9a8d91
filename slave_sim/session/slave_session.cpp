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
constexpr int kMostTilesAtOnce = 16;           // between two reads of the socket

}  // namespace

tl::expected<std::unique_ptr<SlaveSession>, transport::Error> SlaveSession::start(const Options& options,
                                                                                  const std::vector<std::byte>& scene,
                                                                                  ContactSource& contacts,
                                                                                  const Felt& felt) {
  std::vector<std::byte> object = codecs::session_object({scene, felt.outline});
  if (scene.empty() || object.size() > transport::kMaxObjectBytes)
    return tl::unexpected(transport::Error{
        transport::ErrorKind::kProtocol,
        "cannot serve a scene of " + std::to_string(scene.size()) + " bytes: it must have between 1 byte and 64 MiB"});
  auto sockets = transport::UdpSocket::open_pair(options.local);
  if (!sockets) return tl::unexpected(sockets.error());
  return std::unique_ptr<SlaveSession>(
      new SlaveSession(options, std::move(object), contacts, felt.tiles, std::move(*sockets)));
}

SlaveSession::SlaveSession(const Options& options, std::vector<std::byte> object, ContactSource& contacts,
                           TileFeed* tiles, std::array<transport::UdpSocket, 2> sockets)
    : log_(options.log ? options.log : [](const std::string&) {}),
      local_(sockets[0].local()),
      bulk_(std::move(sockets[1])),
      lane_(std::move(sockets[0]), contacts, options.body),
      tiles_(tiles),
      server_(transport::random_identity(), transport::make_object(std::move(object))),
      contact_thread_([this](const std::stop_token& stop) { lane_.run(stop); }),
      io_thread_([this](const std::stop_token& stop) { run_io(stop); }) {
  pthread_setname_np(contact_thread_.native_handle(), "contact");
  pthread_setname_np(io_thread_.native_handle(), "io");
}

SlaveSession::~SlaveSession() = default;

void SlaveSession::edit(const SurfaceEdit& edit) {
  constexpr std::chrono::milliseconds kCatchUp{1};
  while (!lane_.edit(edit)) std::this_thread::sleep_for(kCatchUp);
  while (tiles_ && !tile_edits_.push(edit)) std::this_thread::sleep_for(kCatchUp);
}

void SlaveSession::tell_of_changes(std::uint32_t id) {
  if (id == live_) return;
  if (live_ != 0) log_("session ended: " + server_.last_end());
  live_ = id;
  status_ns_ = 0;
  has_master_.store(id != 0, std::memory_order_relaxed);
  if (id != 0) {
    const auto& address = server_.session()->address;
    if (tiles_) tiles_->restart();
    lane_.set_session({id, address});
    log_("session started with the master at " + transport::to_string(address));
  } else {
    lane_.set_session({});
  }
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

void SlaveSession::feed_tiles(std::int64_t now_ns, const transport::SessionServer::Send& send) {
  if (const contact_service::ToolPose* look = lane_.newest_look(); look && lane_.heard_ns() > 0)
    tiles_->aim(*look, lane_.widest_m(), now_ns);
  for (int i = 0; i < kMostTilesAtOnce; ++i) {
    const auto payload = tiles_->next(now_ns);
    if (!payload) break;
    server_.send_message(transport::PacketType::kTile, *payload, now_ns, send);
  }
}

void SlaveSession::run_io(const std::stop_token& stop) {
  const auto send = [this](const transport::Address& to, std::span<const std::byte> datagram) {
    bulk_.send_to(to, datagram);
  };
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  while (!stop.stop_requested()) {
    const std::int64_t before_ns = transport::monotonic_ns();
    std::int64_t until_ns = std::min(server_.next_time_ns(before_ns), before_ns + kWait_ns);
    if (tiles_ && live_ != 0) until_ns = std::min(until_ns, tiles_->next_time_ns(before_ns));
    bulk_.wait_until(until_ns);
    for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
      const auto received = bulk_.receive(buffer);
      if (!received) break;
      const auto packet = server_.on_datagram(received->from, received->bytes, transport::monotonic_ns(), send);
      if (packet && tiles_) tiles_->on_acknowledge(packet->payload, transport::monotonic_ns());
      tell_of_changes(server_.session() ? server_.session()->id : 0);
    }
    const std::int64_t now_ns = transport::monotonic_ns();
    SurfaceEdit edit;
    while (tiles_ && tile_edits_.pop(edit)) tiles_->edit(edit);
    if (const std::int64_t heard_ns = lane_.heard_ns(); heard_ns > 0 && lane_.report().session == live_)
      server_.heard_at(heard_ns);
    server_.on_time(now_ns, send);
    tell_of_changes(server_.session() ? server_.session()->id : 0);
    if (tiles_ && live_ != 0) feed_tiles(now_ns, send);
    if (live_ != 0 && now_ns - status_ns_ >= kStatus_ns) {
      std::array<std::byte, codecs::kSlaveStatusBytes> payload;
      const std::size_t size = codecs::write(status(), payload);
      status_ns_ = now_ns;
      server_.send_message(transport::PacketType::kSlaveStatus, std::span(payload).first(size), now_ns, send);
    }
  }
  server_.end(transport::ByeReason::kDone, send);
  tell_of_changes(0);
}

}  // namespace farfeel::slave_sim
