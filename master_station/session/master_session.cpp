#include "master_station/session/master_session.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "codecs/felt/felt_outline.h"
#include "codecs/felt/session_object.h"
#include "transport/status/link_words.h"

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kWait_ns = 50'000'000;    // longest before a stop or the haptic lane's news is noticed
constexpr int kMostDatagramsAtOnce = 256;        // between two looks at the clock
constexpr std::int64_t kLook_ns = 20'000'000;    // longest before a stop is noticed while greeting
constexpr std::int64_t kTell_ns = 500'000'000;   // between two words about it
constexpr std::int64_t kRace_ns = 250'000'000;   // RFC 8305: between the tries of two addresses
constexpr std::int64_t kMoved_ns = 250'000'000;  // of silence: then it is looked whether this machine's address changed
constexpr std::int64_t kRequest_ns = 100'000'000;  // between two requests for tiles
constexpr int kMostHeldAtOnce = 4;                 // messages, between two looks at what arrived
constexpr std::int64_t kUnused_ns = 100'000'000;   // a haptic thread that did not tick for so long does not run
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

// What greets one of the addresses that the slave may have, or over a relay.
struct Greeting {
  transport::Address slave;
  transport::UdpSocket socket;
  transport::SessionClient client;
  std::optional<RelayedLanes> relayed;
};

tl::expected<transport::UdpSocket, transport::Error> lane_socket(const transport::Address& to, bool is_relayed,
                                                                 transport::Dscp dscp) {
  if (is_relayed) return transport::UdpSocket::open(transport::any_address(to.is_ipv6), {.dscp = dscp});
  return transport::UdpSocket::open_towards(to, {.dscp = dscp});
}

void take_arrivals(Greeting& greeting) {
  constexpr auto kBulk = transport::LaneKind::kBulk;
  auto& relayed = greeting.relayed;
  const auto send = [&](transport::LaneKind, std::span<const std::byte> datagram) {
    relayed ? greeting.socket.send_to(relayed->path(kBulk), datagram) : greeting.socket.send(datagram);
  };
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  for (int i = 0; i < kMostDatagramsAtOnce && greeting.client.session() == 0; ++i) {
    const auto received = greeting.socket.receive(buffer);
    if (!received) break;
    if (relayed && relayed->take(kBulk, received->from, received->bytes, received->time_ns)) continue;
    (void)greeting.client.on_datagram(std::span(buffer).first(received->bytes.size()), received->time_ns, send);
  }
  const std::int64_t now_ns = transport::monotonic_ns();
  if (relayed) {
    relayed->on_time(now_ns, [&](transport::LaneKind, const transport::Address& to,
                                 std::span<const std::byte> datagram) { greeting.socket.send_to(to, datagram); });
    if (!relayed->is_open(kBulk, now_ns)) return;  // it would lead nowhere yet
  }
  greeting.client.on_time(now_ns, send);
}

// The trouble that says most: any answer says more than silence.
std::string trouble_of(const std::vector<Greeting>& greetings) {
  std::string trouble;
  for (const Greeting& greeting : greetings) {
    const std::string of_relay =
        greeting.relayed ? greeting.relayed->trouble(transport::monotonic_ns()) : std::string();
    if (!of_relay.empty()) {
      trouble += (trouble.empty() ? "" : "; ") + of_relay;
      continue;
    }
    if (trouble.empty() || greeting.client.bulk_greeting().trouble() != transport::GreetingTrouble::kNone)
      trouble = greeting.client.trouble(transport::monotonic_ns());
  }
  return trouble;
}

std::string to_string(const std::vector<transport::Address>& addresses) {
  std::string text;
  for (const transport::Address& address : addresses)
    text += (text.empty() ? "" : " or ") + transport::to_string(address);
  return text;
}

}  // namespace

tl::expected<std::unique_ptr<MasterSession>, transport::Error> MasterSession::connect(
    const Options& options, const std::function<bool()>& should_stop) {
  // Each way that leads there, the relay's last.
  std::vector<transport::Address> ways = options.slave;
  if (options.relay) ways.push_back(options.relay->relay);
  if (ways.empty()) return failed(transport::ErrorKind::kAddress, "there is no address to connect to");
  const std::int64_t began_ns = transport::monotonic_ns();
  const std::int64_t until_ns =
      began_ns + static_cast<std::int64_t>(std::clamp(options.connect_timeout_s, 0.0, 1e6) * 1e9);
  const std::string doing = "greeting the slave at " + to_string(ways) + (options.relay ? " (a relay)" : "");
  transport::Error last_error{transport::ErrorKind::kAddress, "no address could be tried"};
  std::vector<Greeting> greetings;
  std::size_t tried = 0;
  std::int64_t told_ns = began_ns;
  for (Greeting* answered = nullptr; answered == nullptr;) {
    const std::int64_t now_ns = transport::monotonic_ns();
    while (tried < ways.size() && now_ns - began_ns >= kRace_ns * static_cast<std::int64_t>(greetings.size())) {
      const bool is_relayed = tried == options.slave.size();
      const transport::Address& way = ways[tried++];
      auto socket = lane_socket(way, is_relayed, transport::Dscp::kLowerEffort);
      if (!socket) {
        last_error = socket.error();
        continue;
      }
      greetings.push_back({way, std::move(*socket), transport::SessionClient(options.greeter), std::nullopt});
      if (is_relayed) greetings.back().relayed.emplace(*options.relay, now_ns);
    }
    if (greetings.empty() && tried == ways.size()) return tl::unexpected(last_error);
    transport::WaitSet wait;
    std::int64_t next_ns = now_ns + kLook_ns;
    for (Greeting& greeting : greetings) {
      wait.add(greeting.socket.descriptor());
      if (greeting.relayed) next_ns = std::min(next_ns, greeting.relayed->next_time_ns());
      if (!greeting.relayed || greeting.relayed->is_open(transport::LaneKind::kBulk, now_ns))
        next_ns = std::min(next_ns, greeting.client.next_time_ns(now_ns));
    }
    wait.wait_until(next_ns);
    for (Greeting& greeting : greetings) {
      take_arrivals(greeting);
      if (greeting.client.session() != 0) {
        answered = &greeting;
        break;
      }
    }
    const std::string trouble = trouble_of(greetings);
    if (options.progress && transport::monotonic_ns() - told_ns >= kTell_ns) {
      told_ns = transport::monotonic_ns();
      options.progress(doing + " (" + trouble + ")", 0);
    }
    if (should_stop && should_stop()) return failed(transport::ErrorKind::kTimeout, "stopped while " + doing);
    if (answered == nullptr && transport::monotonic_ns() > until_ns)
      return failed(transport::ErrorKind::kTimeout, "gave up while " + doing + ": " + trouble);
    if (answered == nullptr) continue;

    auto haptic = lane_socket(answered->slave, answered->relayed.has_value(), transport::Dscp::kExpedited);
    if (!haptic) return tl::unexpected(haptic.error());
    auto wake = transport::WakeEvent::open();
    if (!wake) return tl::unexpected(wake.error());
    std::unique_ptr<MasterSession> session(
        new MasterSession(options, answered->slave, *std::move(haptic), std::move(answered->socket), *std::move(wake),
                          std::move(answered->client), std::move(answered->relayed)));
    if (auto ok = session->wait_for_scene(options, until_ns, should_stop); !ok) return tl::unexpected(ok.error());
    if (auto ok = session->adopt_scene(); !ok) return tl::unexpected(ok.error());
    return session;
  }
  return failed(transport::ErrorKind::kTimeout, "stopped while " + doing);
}

tl::expected<void, transport::Error> MasterSession::wait_for_scene(const Options& options, std::int64_t until_ns,
                                                                   const std::function<bool()>& should_stop) {
  const std::int64_t patience_ns = std::max<std::int64_t>(0, until_ns - transport::monotonic_ns());
  std::unique_lock lock(mutex_);
  double most_share = 0;
  while (!client_.has_offered_scene()) {
    const double share = client_.progress();
    const std::int64_t now_ns = transport::monotonic_ns();
    if (share > most_share) most_share = share, until_ns = std::max(until_ns, now_ns + patience_ns);
    const std::string trouble = client_.trouble(now_ns);
    const std::string doing = "receiving the scene" + (trouble.empty() ? "" : " (" + trouble + ")");
    const transport::SceneWait waited{1e-9 * static_cast<double>(patience_ns),
                                      most_share,
                                      milliseconds(client_.greeting_round_trip_ns()),
                                      bulk_arrivals_,
                                      longest_bulk_bytes_,
                                      trouble};
    lock.unlock();
    if (options.progress) options.progress(doing, share);
    if (should_stop && should_stop()) return failed(transport::ErrorKind::kTimeout, "stopped while " + doing);
    if (transport::monotonic_ns() > until_ns)
      return failed(transport::ErrorKind::kTimeout,
                    "gave up while receiving the scene: " + transport::why_no_scene(waited));
    lock.lock();
    changed_.wait_for(lock, kProgress);
  }
  greeting_ms_ = milliseconds(client_.greeting_round_trip_ns());
  return {};
}

MasterSession::MasterSession(const Options& options, const transport::Address& slave, transport::UdpSocket haptic,
                             transport::UdpSocket bulk, transport::WakeEvent wake, transport::SessionClient client,
                             std::optional<RelayedLanes> relayed)
    : decode_meshes_(options.decode_meshes),
      tell_status_(options.tell_status),
      bulk_(std::move(bulk)),
      wake_(std::move(wake)),
      lane_(std::move(haptic), wake_),
      client_(std::move(client)),
      relayed_(std::move(relayed)),
      slave_(slave),
      first_welcome_ns_(transport::monotonic_ns()),
      io_thread_([this](const std::stop_token& stop) { run_io(stop); }) {
  pthread_setname_np(io_thread_.native_handle(), "io");
}

MasterSession::~MasterSession() = default;

void MasterSession::send(transport::LaneKind lane, std::span<const std::byte> datagram) {
  if (relayed_) return send_to(lane, relayed_->path(lane), datagram);
  if (lane == transport::LaneKind::kHaptic) return lane_.send_handshake(datagram);
  bulk_.send(datagram);
}

void MasterSession::send_to(transport::LaneKind lane, const transport::Address& to,
                            std::span<const std::byte> datagram) {
  if (lane == transport::LaneKind::kHaptic) return lane_.send_to(to, datagram);
  bulk_.send_to(to, datagram);
}

void MasterSession::run_io(const std::stop_token& stop) {
  const transport::SessionClient::Send send = [this](transport::LaneKind lane, std::span<const std::byte> datagram) {
    this->send(lane, datagram);
  };
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  std::int64_t next_ns = 0;
  while (!stop.stop_requested()) {
    transport::WaitSet wait;
    wait.add(bulk_.descriptor());
    wait.add(wake_);
    wait.wait_until(std::min(next_ns, transport::monotonic_ns() + kWait_ns));
    const std::lock_guard lock(mutex_);
    for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
      const auto received = bulk_.receive(buffer);
      if (!received) break;
      bulk_meter_.on_datagram(*received);
      ++bulk_arrivals_;
      longest_bulk_bytes_ = std::max(longest_bulk_bytes_, received->bytes.size());
      if (relayed_ && relayed_->take(transport::LaneKind::kBulk, received->from, received->bytes, received->time_ns))
        continue;
      const auto message =
          client_.on_datagram(std::span(buffer).first(received->bytes.size()), received->time_ns, send);
      if (!message) continue;
      if (message->type == transport::MessageType::kSlaveStatus) take_status(message->payload);
      if (message->type == transport::MessageType::kCourse) take_course(message->payload);
      if (message->type == transport::MessageType::kTile && may_take_tiles()) tile_receiver_->on_tile(message->payload);
    }
    transport::RawDatagram handshake;
    while (lane_.take_handshake(handshake)) {
      const auto bytes = std::span(handshake.bytes).first(handshake.size);
      if (relayed_ &&
          relayed_->take(transport::LaneKind::kHaptic, handshake.received.from, bytes, handshake.received.time_ns))
        continue;
      client_.on_haptic_handshake(bytes, transport::monotonic_ns());
    }
    look_after(transport::monotonic_ns());
    if (is_adopted()) courses_.give(lane_);
    request_tiles(transport::monotonic_ns(), send);
    client_.on_time(transport::monotonic_ns(), send);
    next_ns = client_.next_time_ns(transport::monotonic_ns());
    if (relayed_) next_ns = std::min(next_ns, relayed_->next_time_ns());
    tell_status(transport::monotonic_ns());
    changed_.notify_all();
  }
  const std::lock_guard lock(mutex_);
  lane_.set_session({});
  client_.end(transport::monotonic_ns(), send);
}

// The haptic lane is open while the session lives and its scene is the one that the loop simulates; it is greeted on
// while the loop runs.
void MasterSession::look_after(std::int64_t now_ns) {
  if (const std::int64_t heard_ns = lane_.heard_ns(); heard_ns > 0) client_.haptic_heard_at(heard_ns);
  lane_.set_session(is_adopted() ? HapticLane::Session{client_.session(), grid_} : HapticLane::Session{});
  if (tile_receiver_ && is_adopted() && tiles_epoch_ != client_.epoch() && tile_receiver_->begin_epoch())
    tiles_epoch_ = client_.epoch();
  const std::int64_t used_ns = lane_.used_ns();
  if (const std::int64_t heard_ns = std::max(client_.bulk_heard_ns(), moved_ns_);
      !relayed_ && now_ns - heard_ns > kMoved_ns) {
    moved_ns_ = now_ns;
    bulk_moves_ += bulk_.follow_local_address(slave_) ? 1 : 0;
    haptic_moves_ += lane_.follow_local_address(slave_) ? 1 : 0;
  }
  const bool uses_haptic = is_adopted() && used_ns > 0 && now_ns - used_ns < kUnused_ns;
  look_after_relay(uses_haptic, now_ns);
  client_.use_haptic(uses_haptic && (!relayed_ || relayed_->is_open(transport::LaneKind::kHaptic, now_ns)));
  if (const auto keys = client_.take_haptic_keys()) (void)lane_.give_keys(*keys);  // lost, they are asked for again
}

// Each lane looks for its own direct way. The haptic thread is told of its own as it is of a session.
void MasterSession::look_after_relay(bool uses_haptic, std::int64_t now_ns) {
  using transport::LaneKind;
  if (!relayed_) return;
  relayed_->use_haptic(uses_haptic, now_ns);
  relayed_->heard_at(LaneKind::kBulk, client_.bulk_heard_ns(), now_ns);
  relayed_->heard_at(LaneKind::kHaptic, lane_.heard_ns(), now_ns);
  relayed_->on_time(now_ns, [this](LaneKind lane, const transport::Address& to, std::span<const std::byte> datagram) {
    send_to(lane, to, datagram);
  });
  lane_.set_path(relayed_->path(LaneKind::kHaptic));
}

std::string MasterSession::way() const {
  const std::lock_guard lock(mutex_);
  if (!relayed_) return "to " + transport::to_string(slave_);
  if (!relayed_->is_direct(transport::LaneKind::kHaptic)) return "over the relay at " + transport::to_string(slave_);
  return "directly to " + transport::to_string(relayed_->path(transport::LaneKind::kHaptic)) + ", past the relay";
}

transport::Suite MasterSession::suite() const {
  const std::lock_guard lock(mutex_);
  return client_.bulk_greeting().suite();
}

double MasterSession::clock_difference_s() const {
  const std::lock_guard lock(mutex_);
  return 1e-9 * static_cast<double>(client_.bulk_greeting().clock_difference_ns());
}

bool MasterSession::is_adopted() const {
  return adopted_ && client_.has_offered_scene() && client_.scene()->hash == adopted_->hash;
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

void MasterSession::take_course(std::span<const std::byte> payload) {
  courses_.follow(client_.session());
  courses_.on_course(payload);
}

std::vector<motion::ObjectCourse> MasterSession::courses() const {
  const std::lock_guard lock(mutex_);
  return courses_.newest();
}

/// What arrives is not sent again: tiles are asked for only while they can be taken.
bool MasterSession::may_take_tiles() const {
  return tile_receiver_ && is_adopted() && tiles_epoch_ == client_.epoch();
}

void MasterSession::request_tiles(std::int64_t now_ns, const transport::SessionClient::Send& send) {
  if (!may_take_tiles()) return;
  tile_receiver_->put_waiting();
  if (!wants_tiles_ || !tell_held(now_ns, send) || now_ns - requested_ns_ < kRequest_ns) return;
  requested_ns_ = now_ns;
  std::array<std::byte, codecs::kTileRequestBytes> payload;
  (void)codecs::write(codecs::TileRequest{tiles_round_}, payload);
  client_.send_message(transport::MessageType::kTileRequest, payload, now_ns, send);
}

/// What is held from sessions before, ahead of this one's first request: whether all is told.
bool MasterSession::tell_held(std::int64_t now_ns, const transport::SessionClient::Send& send) {
  if (client_.session() == 0) return false;
  if (std::exchange(held_told_to_, client_.session()) != client_.session()) tile_receiver_->begin_telling();
  std::array<std::byte, codecs::kMostTilesHeldBytes> payload;
  for (int i = 0; i < kMostHeldAtOnce; ++i) {
    const auto held = tile_receiver_->next_held();
    if (!held) return true;
    const std::size_t size = codecs::write(*held, payload);
    client_.send_message(transport::MessageType::kTilesHeld, std::span(payload).first(size), now_ns, send);
  }
  return false;
}

void MasterSession::want_tiles() {
  const std::lock_guard lock(mutex_);
  wants_tiles_ = true;
}

MasterSession::State MasterSession::state() const {
  const std::lock_guard lock(mutex_);
  if (!client_.is_heard(transport::monotonic_ns()) || !client_.has_offered_scene()) return State::kLost;
  return client_.scene()->hash == adopted_->hash ? State::kConnected : State::kOtherScene;
}

std::string MasterSession::trouble() const {
  const std::lock_guard lock(mutex_);
  const std::int64_t now_ns = transport::monotonic_ns();
  const std::string trouble = client_.trouble(now_ns);
  const std::string at_relay = relayed_ && !trouble.empty() ? relayed_->trouble(now_ns) : std::string();
  return at_relay.empty() ? trouble : trouble + "; " + at_relay;
}

codecs::SlaveStatus MasterSession::told_by_slave() const {
  codecs::SlaveStatus sums = before_;
  if (status_) add(sums, *status_);
  return sums;
}

LinkReport MasterSession::report() {
  const std::lock_guard lock(mutex_);
  const HapticLane::Counters& here = lane_.counters();
  const realtime::Histogram& trips = lane_.meters().round_trips;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  LinkReport report;
  report.round_trip = {kNone, kNone, trips.count()};
  if (trips.count() > 0) {
    report.round_trip.p50_ms = milliseconds(trips.quantile_ns(0.5));
    report.round_trip.p99_ms = milliseconds(trips.quantile_ns(0.99));
  }
  const codecs::SlaveStatus there = told_by_slave();
  report.up = {here.poses_sent, there.poses_received, there.poses_lost, there.poses_late, there.poses_duplicate};
  report.down = here.contact_sets;
  // The slave's count is as old as its last status.
  report.down.sent = std::max(there.contacts_sent, report.down.received + report.down.lost);
  report.malformed = here.malformed + there.poses_malformed;
  report.contacts_left_out = here.contacts_left_out;
  report.doubts = here.doubts;
  report.sessions = client_.counters().sessions;
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
  std::optional<transport::ReceivedObject> received;
  std::int64_t began_ns = 0;
  {
    const std::lock_guard lock(mutex_);
    if (client_.has_offered_scene()) received = client_.scene();
    began_ns = first_welcome_ns_;
  }
  if (!received)
    return failed(transport::ErrorKind::kProtocol, "there is no scene to adopt yet: wait until it is here");
  const std::span<const std::byte> bytes = received->object->bytes();
  codecs::PoseGrid grid;
  if (bytes.size() < codecs::kPoseGridBytes ||
      codecs::read(bytes.first(codecs::kPoseGridBytes), grid) != codecs::Fault::kNone)
    return failed(transport::ErrorKind::kProtocol, "what the slave sent begins with no grid of poses");
  const auto parts = codecs::session_object_in(bytes.subspan(codecs::kPoseGridBytes));
  if (!parts) return failed(transport::ErrorKind::kProtocol, "what the slave sent is cut short");
  auto scene = codecs::read_scene(parts->scene, decode_meshes_);
  if (!scene)
    return failed(transport::ErrorKind::kProtocol, "the scene from " + transport::to_string(slave()) +
                                                       " could not be decoded: " + scene.error().message);
  std::unique_ptr<local_model::TileCache> tiles;
  if (!parts->felt.empty()) {
    auto felt = codecs::read_felt_outline(parts->felt);
    if (!felt) return failed(transport::ErrorKind::kProtocol, felt.error());
    if (felt->bodies.size() != scene->objects.size() + 1)
      return failed(transport::ErrorKind::kProtocol, "the slave tells of other objects to feel than to see");
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      felt->bodies[i + 1].motion = scene->objects[i].motion;
      felt->bodies[i + 1].may_change = scene->objects[i].may_change;
      felt->bodies[i + 1].is_there = scene->objects[i].is_there;
    }
    tiles = std::make_unique<local_model::TileCache>(std::move(*felt));
  }
  scene_ = std::move(*scene);
  scene_bytes_ = bytes.size();
  scene_ms_ = milliseconds(transport::monotonic_ns() - began_ns);
  const std::lock_guard lock(mutex_);
  adopted_ = std::move(received);
  courses_.follow(client_.session());
  courses_.begin_scene(scene_, lane_);
  grid_ = grid;
  tile_receiver_.reset();
  tiles_ = std::move(tiles);
  if (tiles_) tile_receiver_.emplace(*tiles_);
  tiles_epoch_ = client_.epoch();
  ++tiles_round_;
  look_after(transport::monotonic_ns());
  return {};
}

}  // namespace farfeel::master_station
