#include "master_station/session/master_session.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include "codecs/felt/felt_outline.h"
#include "codecs/felt/session_object.h"

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kWait_ns = 50'000'000;  // longest before a stop or the haptic lane's news is noticed
constexpr int kMostDatagramsAtOnce = 256;      // between two looks at the clock
constexpr std::chrono::milliseconds kProgress{100};
constexpr std::chrono::milliseconds kLastWord{1000};

tl::unexpected<transport::Error> failed(transport::ErrorKind kind, const std::string& message) {
  return tl::unexpected(transport::Error{kind, message});
}

double milliseconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-6;
}

void add(codecs::SlaveStatus& sum, const codecs::SlaveStatus& s) {
  sum.poses_received += s.poses_received;
  sum.poses_lost += s.poses_lost;
  sum.poses_late += s.poses_late;
  sum.poses_duplicate += s.poses_duplicate;
  sum.poses_malformed += s.poses_malformed;
  sum.contacts_sent += s.contacts_sent;
}

}  // namespace

tl::expected<std::unique_ptr<MasterSession>, transport::Error> MasterSession::connect(
    const Options& options, const std::function<bool()>& should_stop) {
  const transport::Address& slave = options.slave;
  if (slave.port == 0 || slave.port == 0xFFFF)
    return failed(transport::ErrorKind::kAddress,
                  "a slave listens on PORT and PORT + 1, so " + transport::to_string(slave) + " cannot be one");
  auto sockets = transport::UdpSocket::open_pair(transport::loopback(slave.is_ipv6));
  if (!sockets) return tl::unexpected(sockets.error());
  auto& [haptic, bulk] = *sockets;
  if (auto ok = haptic.connect(slave); !ok) return tl::unexpected(ok.error());
  if (auto ok = bulk.connect(slave.with_port(static_cast<std::uint16_t>(slave.port + 1))); !ok)
    return tl::unexpected(ok.error());

  std::unique_ptr<MasterSession> session(new MasterSession(options, std::move(haptic), std::move(bulk)));
  const std::int64_t until_ns =
      transport::monotonic_ns() + static_cast<std::int64_t>(std::clamp(options.connect_timeout_s, 0.0, 1e6) * 1e9);
  std::unique_lock lock(session->mutex_);
  while (!session->client_.has_offered_object()) {
    const double share = session->client_.receiver().progress();
    const std::string trouble = session->client_.trouble();
    const std::string doing = trouble.empty()
                                  ? "receiving the scene"
                                  : "greeting the slave at " + transport::to_string(slave) + " (" + trouble + ")";
    lock.unlock();
    if (options.progress) options.progress(doing, share);
    if (should_stop && should_stop()) return failed(transport::ErrorKind::kTimeout, "stopped while " + doing);
    if (transport::monotonic_ns() > until_ns)
      return failed(transport::ErrorKind::kTimeout,
                    "gave up while " + doing + ". Is farfeel-slave running there, on this port?");
    lock.lock();
    session->changed_.wait_for(lock, kProgress);
  }
  session->greeting_ms_ = 1e-6 * static_cast<double>(session->client_.greeting_round_trip_ns());
  lock.unlock();
  if (auto ok = session->adopt_scene(); !ok) return tl::unexpected(ok.error());
  return session;
}

MasterSession::MasterSession(const Options&, transport::UdpSocket haptic, transport::UdpSocket bulk)
    : bulk_(std::move(bulk)),
      lane_(std::move(haptic)),
      client_(transport::random_identity()),
      io_thread_([this](const std::stop_token& stop) { run_io(stop); }) {
  pthread_setname_np(io_thread_.native_handle(), "io");
}

MasterSession::~MasterSession() = default;

void MasterSession::run_io(const std::stop_token& stop) {
  const auto send = [this](std::span<const std::byte> datagram) { bulk_.send(datagram); };
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  std::int64_t next_ns = 0;
  while (!stop.stop_requested()) {
    bulk_.wait_until(std::min(next_ns, transport::monotonic_ns() + kWait_ns));
    const std::lock_guard lock(mutex_);
    for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
      const auto received = bulk_.receive(buffer);
      if (!received) break;
      const auto packet = client_.on_datagram(received->bytes, transport::monotonic_ns(), send);
      if (!packet) continue;
      if (packet->header.type == transport::PacketType::kSlaveStatus) take_status(packet->payload);
      if (packet->header.type == transport::PacketType::kTile) take_tile(packet->payload, send);
    }
    acknowledge_tiles(send);
    client_.on_time(transport::monotonic_ns(), send);
    look_after();
    next_ns = client_.next_time_ns(transport::monotonic_ns());
    changed_.notify_all();
  }
  const std::lock_guard lock(mutex_);
  lane_.set_session(0);
  client_.end(send);
}

// The haptic lane is open while the session lives and its scene is the one that the loop simulates.
void MasterSession::look_after() {
  if (const std::int64_t heard_ns = lane_.heard_ns(); heard_ns > 0) client_.heard_at(heard_ns);
  if (client_.session() != 0 && first_welcome_ns_ == 0) first_welcome_ns_ = transport::monotonic_ns();
  lane_.set_session(is_adopted() ? client_.session() : 0);
}

bool MasterSession::is_adopted() const {
  return adopted_ && client_.has_offered_object() && client_.receiver().object()->hash == adopted_->hash;
}

void MasterSession::take_status(std::span<const std::byte> payload) {
  codecs::SlaveStatus status;
  if (codecs::read(payload, status) != codecs::Fault::kNone) return;
  if (client_.session() != status_session_) {
    if (status_) add(before_, *status_);
    status_session_ = client_.session();
  }
  status_ = status;
  ++statuses_;
}

void MasterSession::take_tile(std::span<const std::byte> payload, const transport::SessionClient::Send& send) {
  if (!tile_receiver_ || !is_adopted()) return;  // comes again
  tile_receiver_->on_tile(payload);
  if (tile_receiver_->is_full()) acknowledge_tiles(send);
}

void MasterSession::acknowledge_tiles(const transport::SessionClient::Send& send) {
  const std::int64_t now_ns = transport::monotonic_ns();
  if (!wants_tiles_ || !tile_receiver_ || !tile_receiver_->owes(now_ns) || client_.session() == 0) return;
  transport::PayloadBuffer payload;
  const std::size_t size = tile_receiver_->acknowledge(payload, now_ns);
  client_.send_message(transport::PacketType::kTileAcknowledge, std::span(payload).first(size), now_ns, send);
}

void MasterSession::want_tiles() {
  const std::lock_guard lock(mutex_);
  wants_tiles_ = true;
}

MasterSession::State MasterSession::state() const {
  const std::lock_guard lock(mutex_);
  if (client_.session() == 0) return State::kLost;
  if (!client_.has_offered_object()) return State::kLost;
  return client_.receiver().object()->hash == adopted_->hash ? State::kConnected : State::kOtherScene;
}

std::string MasterSession::trouble() const {
  const std::lock_guard lock(mutex_);
  return client_.trouble();
}

LinkReport MasterSession::report() {
  const std::lock_guard lock(mutex_);
  const HapticLane::Counters& here = lane_.counters();
  const realtime::Histogram& trips = lane_.round_trips();
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  LinkReport report;
  report.round_trip = {kNone, kNone, trips.count()};
  if (trips.count() > 0) {
    report.round_trip.p50_ms = milliseconds(trips.quantile_ns(0.5));
    report.round_trip.p99_ms = milliseconds(trips.quantile_ns(0.99));
  }
  codecs::SlaveStatus there = before_;
  if (status_) add(there, *status_);
  report.up = {here.poses_sent, there.poses_received, there.poses_lost, there.poses_late, there.poses_duplicate};
  report.down = here.contact_sets;
  // The slave's count is as old as its last status.
  report.down.sent = std::max(there.contacts_sent, report.down.received + report.down.lost);
  report.malformed = here.malformed + there.poses_malformed;
  report.contacts_left_out = here.contacts_left_out;
  report.doubts = here.doubts;
  report.sessions = client_.counters().welcomes;
  report.slave = status_;
  if (tile_receiver_) report.tiles = tiles_->tiles(), report.tile_bytes = tile_receiver_->bytes();
  return report;
}

// The next status may have left the slave before the last poses arrived there; the one after it has not.
LinkReport MasterSession::last_report() {
  {
    std::unique_lock lock(mutex_);
    const std::uint64_t enough = statuses_ + 2;
    changed_.wait_for(lock, kLastWord, [&] { return statuses_ >= enough || client_.session() == 0; });
  }
  return report();
}

tl::expected<void, transport::Error> MasterSession::adopt_scene() {
  std::shared_ptr<const transport::Object> object;
  std::int64_t began_ns = 0;
  {
    const std::lock_guard lock(mutex_);
    if (client_.has_offered_object()) object = client_.receiver().object();
    began_ns = first_welcome_ns_;
  }
  if (!object) return failed(transport::ErrorKind::kProtocol, "there is no scene to adopt yet: wait until it is here");
  const auto parts = codecs::session_object_in(object->bytes);
  if (!parts) return failed(transport::ErrorKind::kProtocol, "what the slave sent is cut short");
  auto scene = codecs::read_scene(parts->scene);
  if (!scene) return failed(transport::ErrorKind::kProtocol, scene.error().message);
  std::unique_ptr<local_model::TileCache> tiles;
  if (!parts->felt.empty()) {
    auto felt = codecs::read_felt_outline(parts->felt);
    if (!felt) return failed(transport::ErrorKind::kProtocol, felt.error());
    if (felt->bodies.size() != scene->objects.size() + 1)
      return failed(transport::ErrorKind::kProtocol, "the slave tells of other objects to feel than to see");
    for (std::size_t i = 0; i < scene->objects.size(); ++i) felt->bodies[i + 1].motion = scene->objects[i].motion;
    tiles = std::make_unique<local_model::TileCache>(std::move(*felt));
  }
  scene_ = std::move(*scene);
  scene_bytes_ = object->bytes.size();
  scene_ms_ = milliseconds(transport::monotonic_ns() - began_ns);
  const std::lock_guard lock(mutex_);
  adopted_ = std::move(object);
  tile_receiver_.reset();
  tiles_ = std::move(tiles);
  if (tiles_) tile_receiver_.emplace(*tiles_);
  look_after();
  return {};
}

}  // namespace farfeel::master_station
