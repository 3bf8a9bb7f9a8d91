#include "master_station/feed/session_feed.h"

#include <unistd.h>

#include <array>
#include <cmath>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::master_station {
namespace {

constexpr std::size_t kMostClients = 8;
constexpr int kTilesEvery = 12;  // flushes: ten times a second
constexpr int kMostPieces = 64;  // a client gets so many messages in a flush: a scene is on its way, others wait

using codecs::ViewSeries;

}  // namespace

SessionFeed::SessionFeed(std::string path, FeedSocket listening, const local_model::TileCache* tiles, Ask ask)
    : path_(std::move(path)), listening_(std::move(listening)), ask_(std::move(ask)), tiles_(tiles) {}

SessionFeed::~SessionFeed() {
  ::unlink(path_.c_str());
}

tl::expected<std::unique_ptr<SessionFeed>, std::string> SessionFeed::open(const codecs::SceneDescription& scene,
                                                                          const local_model::TileCache* tiles,
                                                                          Ask ask) {
  const auto path = feed_path(::getpid());
  if (!path) return tl::unexpected(path.error());
  auto listening = listen_at(*path);
  if (!listening) return tl::unexpected(listening.error());
  std::unique_ptr<SessionFeed> feed(new SessionFeed(*path, *std::move(listening), tiles, std::move(ask)));
  const auto add = [&](const auto& message) { feed->parts_.push_back(codecs::framed(codecs::write_view(message))); };
  add(codecs::ViewScene{scene.name, static_cast<std::uint16_t>(scene.objects.size() + 1), scene.exploration.p_TWork_T,
                        scene.exploration.nhat_work_T});
  add(codecs::view_body(0, scene.tool.name, {}, scene.tool.visible_T, scene.tool.colours));
  std::vector<motion::MovingObject> moving;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto index = static_cast<std::uint16_t>(i + 1);
    add(codecs::view_body(index, scene.objects[i].name, scene.objects[i].X_WO, scene.objects[i].visible_O,
                          scene.objects[i].colours));
    if (scene.objects[i].motion || scene.objects[i].may_change)
      moving.push_back({static_cast<std::uint32_t>(i), scene.objects[i].motion,
                        motion::at_rest(scene.objects[i].X_WO, scene.objects[i].is_there)});
  }
  feed->moving_ = motion::MovingObjects(std::move(moving));
  for (const codecs::ViewTiles& where : feed->tiles_.where()) add(where);
  return feed;
}

void SessionFeed::tell(const codecs::ViewStatus& status, const BesideTicks& beside) {
  std::vector<std::byte> message = codecs::framed(codecs::write_view(status));
  const std::lock_guard lock(mutex_);
  beside_ = beside;
  if (message == status_) return;
  status_ = std::move(message);
  ++statuses_;
}

void SessionFeed::add(const TickRecord& tick) {
  if (!std::isnan(tick.rtt_ms)) {
    newest_rtt_ms_ = tick.rtt_ms;
    answered_ns_ = tick.time_ns;
  }
  if (clients_.empty()) return;
  const auto bin = [this](ViewSeries series, double value) { next_.bins[static_cast<std::size_t>(series)].add(value); };
  bin(ViewSeries::kForce_N, glm::length(tick.F_hand_W.force_N));
  bin(ViewSeries::kTorque_Nm, glm::length(tick.F_hand_W.torque_Nm));
  bin(ViewSeries::kDepth_m, tick.depth_max_m);
  bin(ViewSeries::kTank_J, tick.tank_J);
  bin(ViewSeries::kCoupling_J, tick.coupling_energy_J);
  bin(ViewSeries::kContacts_J, tick.contact_energy_J);
  bin(ViewSeries::kWork_us, static_cast<double>(tick.work_us));
  bin(ViewSeries::kRoundTrip_ms, tick.rtt_ms);
  bin(ViewSeries::kAge_ms, newest_rtt_ms_ + 1e-6 * static_cast<double>(tick.time_ns - answered_ns_));
  next_.number = tick.number;
  next_.time_ns = tick.time_ns;
  next_.state = static_cast<std::uint8_t>(tick.state);
  next_.rung = tick.rung;
  next_.flags = tick.is_resting ? codecs::ViewTick::kResting : std::uint8_t{0};
  next_.X_WT = tick.X_WT;
  next_.X_WI = tick.X_WI;
  next_.F_hand_W = tick.F_hand_W;
  next_.F_contact_To_W = tick.F_contact_To_W;
  next_.depth_max_m = tick.depth_max_m;
  next_.pressing = tick.contacts;
  next_.pushes = tick.pushes;
  ++next_.ticks;
  has_next_ = true;
}

void SessionFeed::flush() {
  while (auto socket = accepted(listening_)) {
    if (clients_.size() >= kMostClients) continue;  // closed again
    clients_.push_back(std::make_unique<Client>());
    clients_.back()->socket = *std::move(socket);
  }
  if (has_next_) {
    {
      const std::lock_guard lock(mutex_);
      next_.fault = beside_.fault;
      next_.view_yaw_rad = beside_.view_yaw_rad;
      for (const motion::ObjectCourse& told : beside_.courses) (void)moving_.set_out(told);
      next_.bins[static_cast<std::size_t>(ViewSeries::kNetwork_ms)].add(beside_.network_ms);
      next_.bins[static_cast<std::size_t>(ViewSeries::kNode_ms)].add(beside_.node_ms);
    }
    next_.told_ns = realtime::monotonic_now_ns();
    next_.moving.clear();
    for (const motion::Moved& moved : moving_.moved()) {
      const motion::Placement now = moving_.at(moved, 1e-9 * static_cast<double>(next_.time_ns));
      next_.moving.push_back({static_cast<std::uint16_t>(moved.object + 1), now.X_WO, now.is_there});
    }
    for (const auto& client : clients_) {
      codecs::ViewTick waited = next_;
      if (client->has_tick) waited.absorb(client->waiting);
      client->waiting = std::move(waited);
      client->has_tick = true;
    }
    next_ = {};
    has_next_ = false;
  }
  look_at_tiles();
  std::erase_if(clients_, [this](const auto& client) { return !hear(*client) || !serve(*client); });
}

void SessionFeed::look_at_tiles() {
  if (clients_.empty() || tiles_.where().empty() || ++flushes_ < kTilesEvery) return;
  flushes_ = 0;
  std::vector<std::byte> message = codecs::framed(codecs::write_view(tiles_.presence()));
  if (message == presence_) return;
  presence_ = std::move(message);
  ++presences_;
}

/// False once it is gone, or says what no one understands.
bool SessionFeed::hear(Client& client) {
  std::array<std::byte, codecs::kMostViewRequestBytes> bytes;
  const auto got = client.socket.receive(bytes);
  if (!got) return false;
  client.asked.put(std::span(bytes).first(*got));
  while (const auto message = client.asked.next()) {
    const auto verb = codecs::read_view_control(*message);
    if (!verb) return false;
    client.answer = codecs::framed(codecs::write_view(ask_(*verb)));
  }
  return !client.asked.is_broken();
}

/// Puts the next message into client.sending: an answer, the scene's parts, then words and tiles that are new, then
/// the newest tick.
bool SessionFeed::find_next(Client& client) {
  client.sent = 0;
  client.sending.clear();
  if (!client.answer.empty()) {
    std::swap(client.sending, client.answer);
    return true;
  }
  if (client.parts_told < parts_.size()) {
    client.sending = parts_[client.parts_told++];
    return true;
  }
  {
    const std::lock_guard lock(mutex_);
    if (client.status_told != statuses_) {
      client.status_told = statuses_;
      client.sending = status_;
      return true;
    }
  }
  if (client.presence_told != presences_) {
    client.presence_told = presences_;
    client.sending = presence_;
    return true;
  }
  if (!client.has_tick) return false;
  client.sending = codecs::framed(codecs::write_view(client.waiting));
  client.has_tick = false;
  return true;
}

bool SessionFeed::serve(Client& client) {
  for (int piece = 0; piece < kMostPieces; ++piece) {
    if (client.sent == client.sending.size() && !find_next(client)) return true;
    const auto taken = client.socket.send(std::span(client.sending).subspan(client.sent));
    if (!taken) return false;
    if (*taken == 0) return true;
    client.sent += *taken;
  }
  return true;
}

}  // namespace farfeel::master_station
