// A master and a slave with both lanes, on a simulated clock: what the programs' threads do, without threads or
// sockets.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/transport/simulated_network.h"
#include "transport/bytes/byte_cursor.h"
#include "transport/session_client.h"
#include "transport/session_server.h"

namespace farfeel::transport {

inline std::shared_ptr<const Object> some_object(unsigned seed = 1, std::size_t bytes = 50'000) {
  std::mt19937 random(seed);
  std::vector<std::byte> content(bytes);
  for (std::byte& b : content) b = static_cast<std::byte>(random());
  return make_object(std::move(content));
}

/// Counts on, as one kept beside a key would.
inline std::function<std::uint64_t()> counting() {
  return [next = std::make_shared<std::uint64_t>(1)] { return (*next)++; };
}

struct SimulatedSession {
  static constexpr std::int64_t kStep_ns = 1'000'000;  ///< also the period of poses

  explicit SimulatedSession(const std::string& link = "rtt=20ms", std::uint64_t seed = 1)
      : networks{SimulatedNetwork(parse_link_spec(link).value(), seed),
                 SimulatedNetwork(parse_link_spec(link).value(), seed + 100)} {
    addresses = {loopback().with_port(5000), loopback().with_port(5001)};
    slave_key = new_key_pair();
    greeter.own = new_key_pair();
    greeter.slave = slave_key.public_key;
    greeter.master = 77;
    greeter.next_counter = counting();
    greeter.wall_clock_ns = [this] { return now(); };
    trusted.push_back({greeter.own.public_key, {"anna", {}, false}});
    to_master = [this](const Address& to, std::span<const std::byte> d) {
      sent_to.push_back(to);
      sent.emplace_back(d.begin(), d.end());
      for (const std::size_t lane : {0u, 1u}) {
        if (to == addresses[lane]) networks[lane].send(SimulatedNetwork::kDown, d);
      }
    };
    to_slave = [this](LaneKind lane, std::span<const std::byte> d) {
      networks[static_cast<std::size_t>(lane)].send(SimulatedNetwork::kUp, d);
    };
    start_slave();
    start_master();
  }

  void start_slave(std::shared_ptr<const Object> what = some_object()) {
    object = std::move(what);
    server = std::make_unique<SessionServer>(
        SessionServer::Settings{slave_key, random_identity(), [this](const Key32& key) { return find(key); }, object});
    slave_haptic = SealedLane(SealedLane::Role::kResponder);
    slave_path.forget();
    slave_session = 0;
  }
  void start_master() {
    client = std::make_unique<SessionClient>(greeter);
    client->use_haptic(true);
    master_haptic = SealedLane(SealedLane::Role::kInitiator);
  }
  [[nodiscard]] std::optional<Operator> find(const Key32& key) const {
    for (const auto& [trusted_key, who] : trusted) {
      if (trusted_key == key) return who;
    }
    return std::nullopt;
  }

  std::int64_t now() const { return networks[0].now_ns; }
  void step() {
    for (SimulatedNetwork& network : networks) network.now_ns += kStep_ns;
    if (slave_runs) step_slave();
    step_master();
  }
  void run(double seconds) {
    for (const std::int64_t until = now() + static_cast<std::int64_t>(seconds * 1e9); now() < until;) step();
  }
  template <typename Condition>
  double seconds_until(double limit, const Condition& is_so) {
    const std::int64_t began = now();
    while (!is_so() && now() - began < static_cast<std::int64_t>(limit * 1e9)) step();
    return static_cast<double>(now() - began) * 1e-9;
  }
  [[nodiscard]] bool is_bulk_up() const {
    return client->is_heard(now()) && server->session() && server->session()->id == client->session() &&
           client->has_offered_scene();
  }
  /// The scene that the master has.
  [[nodiscard]] std::vector<std::byte> scene_here() const {
    const auto bytes = client->scene().value().object->bytes();
    return {bytes.begin(), bytes.end()};
  }
  [[nodiscard]] bool is_up() const { return is_bulk_up() && now() - answered_ns < 50'000'000; }
  double seconds_until_up(double limit) {
    return seconds_until(limit, [&] { return is_up(); });
  }

  /// What arrives at the slave from an address, as its port would sort it.
  void at_slave(const Address& from, std::span<const std::byte> datagram) {
    std::vector<std::byte> bytes(datagram.begin(), datagram.end());
    const auto outcome = server->on_datagram(from, bytes, now(), now(), to_master);
    follow_session();
    if (const auto grant = server->take_haptic_grant()) {
      slave_haptic.adopt(grant->keys);
      slave_path.on_handshake(grant->asked_from, grant->keys.generation);
    }
    if (!outcome.is_for_haptic) return;
    const auto opened = slave_haptic.open(bytes, now());
    if (!opened || opened->session != slave_session) return;
    server->heard_at(now());
    slave_path.on_authentic(from, bytes.size(), opened->is_newest, opened->generation);
    if (opened->type == static_cast<std::uint8_t>(MessageType::kChallengeAnswer))
      slave_path.on_answer(from, opened->message);
    if (opened->type != static_cast<std::uint8_t>(MessageType::kPoseSample) || !opened->is_newest) return;
    ++poses;
    newest_pose.assign(opened->message.begin(), opened->message.end());
    send_haptic(MessageType::kContactSet, newest_pose);
  }
  void send_haptic(MessageType type, std::span<const std::byte> message) {
    std::array<std::byte, kMaxDatagramBytes> out;
    if (!slave_path.address() || !slave_path.may_send(message.size() + kSealBytes, type == MessageType::kChallenge))
      return;
    const std::size_t size = slave_haptic.seal(static_cast<std::uint8_t>(type), message, out, now());
    if (size == 0) return;
    slave_path.on_sent(size);
    to_master(*slave_path.address(), std::span(out).first(size));
  }

  std::array<SimulatedNetwork, 2> networks;  ///< by lane
  std::array<Address, 2> addresses;          ///< of the master, by lane
  KeyPair slave_key;
  Greeter greeter;
  std::vector<std::pair<Key32, Operator>> trusted;
  std::shared_ptr<const Object> object;
  std::unique_ptr<SessionServer> server;
  std::unique_ptr<SessionClient> client;
  SealedLane master_haptic{SealedLane::Role::kInitiator}, slave_haptic{SealedLane::Role::kResponder};
  PeerPath slave_path;
  std::uint32_t slave_session = 0, master_session = 0;
  bool slave_runs = true;
  SessionServer::Send to_master;
  SessionClient::Send to_slave;
  std::vector<std::byte> newest_pose;
  std::uint64_t poses = 0, answers = 0;
  std::int64_t answered_ns = -1'000'000'000;
  std::uint64_t newest_answer = 0;  ///< number of the pose that the newest answer was to
  std::uint64_t answers_back = 0;   ///< answers taken as newest that were to an older pose than one before
  std::uint64_t next_pose = 1;
  std::vector<Message> messages;
  std::vector<std::uint8_t> statuses;
  std::vector<Address> sent_to;
  std::vector<std::vector<std::byte>> sent;  ///< by the slave

 private:
  void follow_session() {
    const std::uint32_t id = server->session() ? server->session()->id : 0;
    if (id == slave_session) return;
    slave_session = id;
    slave_haptic = SealedLane(SealedLane::Role::kResponder);
    slave_path.forget();
  }
  void step_slave() {
    for (const std::size_t lane : {0u, 1u})
      networks[lane].deliver(SimulatedNetwork::kUp,
                             [&](std::span<const std::byte> d) { at_slave(addresses[lane], d); });
    server->on_time(now(), to_master);
    follow_session();
    if (const auto challenge = slave_path.challenge(now())) send_haptic(MessageType::kChallenge, *challenge);
  }
  void step_master() {
    networks[1].deliver(SimulatedNetwork::kDown, [&](std::span<const std::byte> d) {
      std::vector<std::byte> bytes(d.begin(), d.end());
      const auto message = client->on_datagram(bytes, now(), to_slave);
      if (message && message->type == MessageType::kSlaveStatus)
        statuses.push_back(static_cast<std::uint8_t>(message->payload[0]));
    });
    networks[0].deliver(SimulatedNetwork::kDown, [&](std::span<const std::byte> d) { haptic_at_master(d); });
    if (client->session() != master_session) {
      master_session = client->session();
      master_haptic.forget();
    }
    if (const auto keys = client->take_haptic_keys()) master_haptic.adopt(*keys);
    client->on_time(now(), to_slave);
    std::array<std::byte, 64> pose{};
    ByteWriter(pose).u64(next_pose++);
    send_from_master(MessageType::kPoseSample, pose);
  }
  void haptic_at_master(std::span<const std::byte> datagram) {
    std::vector<std::byte> bytes(datagram.begin(), datagram.end());
    if (receiver_index(bytes) == 0) return client->on_haptic_handshake(bytes, now());
    const auto opened = master_haptic.open(bytes, now());
    if (!opened) return;
    client->haptic_heard_at(now());
    if (opened->type == static_cast<std::uint8_t>(MessageType::kChallenge))
      send_from_master(MessageType::kChallengeAnswer, opened->message);
    if (opened->type != static_cast<std::uint8_t>(MessageType::kContactSet) || !opened->is_newest) return;
    ++answers;
    answered_ns = now();
    const std::uint64_t pose = ByteReader(opened->message).u64();
    if (pose < newest_answer) ++answers_back;
    newest_answer = std::max(newest_answer, pose);
  }
  void send_from_master(MessageType type, std::span<const std::byte> message) {
    std::array<std::byte, kMaxDatagramBytes> out;
    const std::size_t size = master_haptic.seal(static_cast<std::uint8_t>(type), message, out, now());
    if (size > 0) to_slave(LaneKind::kHaptic, std::span(out).first(size));
  }
};

}  // namespace farfeel::transport
