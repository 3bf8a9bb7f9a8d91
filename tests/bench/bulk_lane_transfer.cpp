#include <array>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"
#include "tests/bench/bulk_method.h"
#include "transport/bulk/bulk_lane.h"
#include "transport/lane/sealed_lane.h"
#include "transport/net/udp_socket.h"

namespace farfeel::bench {
namespace {

using namespace transport;

constexpr std::size_t kObjectBytes = 4'000'000;
constexpr std::uint32_t kSlots = 3;             // so that one is agreed on before the last is complete
constexpr std::uint32_t kObjects = 2 * kSlots;  // they take turns: a slot's next object is another one
constexpr std::size_t kBurst = 16;              // datagrams handed to the kernel in one call
constexpr std::int64_t kNap_ns = 2'000'000;

constexpr std::uint8_t kHello = 0xFF;  // the responder seals nothing before it has opened something

std::shared_ptr<const Object> new_object(std::uint32_t number) {
  std::mt19937_64 random(number + 1);
  std::vector<std::byte> bytes(kObjectBytes);
  for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
    const std::uint64_t word = random();
    std::memcpy(&bytes[i], &word, sizeof word);
  }
  return make_object(std::move(bytes));
}

/// One end: what arrives is opened and told, what may leave is sealed and sent.
class End {
 public:
  End(UdpSocket socket, SealedLane::Role role, const LaneKeys& keys, std::uint64_t seed)
      : lane_(options(seed), std::make_shared<ByteBudget>(4 * kMaxObjectBytes)),
        sealed_(role),
        is_initiator_(role == SealedLane::Role::kInitiator),
        socket_(std::move(socket)) {
    sealed_.adopt(keys);
    lane_.restart(seed, 0, monotonic_ns());
  }
  void work() {
    std::array<std::byte, kMaxDatagramBytes> buffer;
    while (const auto received = socket_.receive(buffer)) {
      const auto opened = sealed_.open(std::span(buffer).first(received->bytes.size()), received->time_ns);
      has_heard_ = has_heard_ || opened;
      if (opened && opened->type != kHello)
        (void)lane_.on_message({opened->message.data() - 1, opened->message.size() + 1}, received->time_ns);
    }
    if (!has_heard_ && is_initiator_) {
      const std::size_t size = sealed_.seal(kHello, {}, buffer, monotonic_ns());
      (void)socket_.send(std::span(buffer).first(size));
    }
    std::array<std::array<std::byte, kMaxDatagramBytes>, kBurst> datagrams;
    for (;;) {
      std::array<std::span<const std::byte>, kBurst> burst;
      std::size_t count = 0;
      for (; count < kBurst; ++count) {
        const std::int64_t now_ns = monotonic_ns();
        auto& datagram = datagrams[count];
        const auto plain = std::span(datagram).subspan(kDataHeaderBytes, kMaxMessageBytes + 1);
        const std::size_t size = lane_.next(plain, now_ns);
        if (size == 0) break;
        const std::size_t sealed =
            sealed_.seal(static_cast<std::uint8_t>(plain[0]), plain.subspan(1, size - 1), datagram, now_ns);
        burst[count] = std::span(datagram).first(sealed);
      }
      (void)socket_.send_burst(std::span(burst).first(count));
      if (count < kBurst) return;
    }
  }
  void wait() {
    const std::int64_t now_ns = monotonic_ns();
    socket_.wait_until(std::min(now_ns + kNap_ns, lane_.next_time_ns(now_ns)));
  }
  BulkLane& lane() { return lane_; }

 private:
  static BulkOptions options(std::uint64_t seed) {
    BulkOptions options;
    options.seed = seed;
    return options;
  }
  BulkLane lane_;
  SealedLane sealed_;
  bool is_initiator_, has_heard_ = false;
  UdpSocket socket_;
};

class BulkLaneTransfer final : public BulkTransfer {
 public:
  BulkLaneTransfer(std::unique_ptr<End> master, std::unique_ptr<End> slave,
                   const std::atomic<std::uint64_t>& haptic_bytes)
      : master_(std::move(master)), slave_(std::move(slave)), haptic_bytes_(haptic_bytes) {
    static const std::vector<std::shared_ptr<const Object>> objects = [] {
      std::vector<std::shared_ptr<const Object>> made;
      for (std::uint32_t i = 0; i < kObjects; ++i) made.push_back(new_object(i));
      return made;
    }();
    objects_ = &objects;
    slave_thread_ = std::thread([this] { send(); });
    master_thread_ = std::thread([this] { receive(); });
  }
  ~BulkLaneTransfer() override {
    is_over_ = true;
    slave_thread_.join();
    master_thread_.join();
  }
  std::uint64_t arrived_bytes() const override { return arrived_.load(); }

 private:
  void send() {
    (void)realtime::use_fifo(kBulkFifoPriority);
    std::uint32_t offered = 0;
    while (!is_over_.load(std::memory_order_relaxed)) {
      BulkLane& lane = slave_->lane();
      const std::int64_t now_ns = monotonic_ns();
      while (offered < kSlots || lane.outbox().status(offered % kSlots) == ObjectOutbox::Status::kComplete) {
        // The one that was begun first goes first.
        lane.outbox().offer(offered % kSlots, (*objects_)[offered % kObjects],
                            static_cast<std::uint8_t>(100 + offered % 100), now_ns);
        ++offered;
      }
      lane.on_haptic_bytes(haptic_bytes_.load(std::memory_order_relaxed), now_ns);
      slave_->work();
      slave_->wait();
    }
  }
  void receive() {
    (void)realtime::use_fifo(kBulkFifoPriority);
    std::uint64_t whole = 0;
    while (!is_over_.load(std::memory_order_relaxed)) {
      master_->work();
      while (const auto object = master_->lane().inbox().take_object()) whole += object->object->bytes().size();
      arrived_.store(whole + master_->lane().inbox().progress().here);
      master_->wait();
    }
  }

  std::unique_ptr<End> master_, slave_;
  const std::atomic<std::uint64_t>& haptic_bytes_;
  const std::vector<std::shared_ptr<const Object>>* objects_ = nullptr;
  std::atomic<bool> is_over_{false};
  std::atomic<std::uint64_t> arrived_{0};
  std::thread slave_thread_, master_thread_;
};

}  // namespace

MadeTransfer begin_bulk_lane(const TwoEnds& ends, const std::atomic<std::uint64_t>& haptic_bytes) {
  const Suite suite = is_available(Suite::kAesGcm) ? Suite::kAesGcm : Suite::kChaChaPoly;
  LaneKeys keys;
  keys.generation = 1;
  keys.suite = suite;
  keys.local_index = new_local_index(LaneKind::kBulk);
  keys.remote_index = new_local_index(LaneKind::kBulk);
  fill_randomly(keys.send);
  fill_randomly(keys.receive);
  keys.made_ns = monotonic_ns();
  LaneKeys other = keys;
  std::swap(other.local_index, other.remote_index);
  std::swap(other.send, other.receive);

  std::unique_ptr<End> master, slave;
  std::string failed;
  std::optional<UdpSocket> slave_socket, master_socket;
  const auto keep = [&](tl::expected<UdpSocket, Error> opened, std::optional<UdpSocket>& kept) {
    if (!opened) return void(failed = opened.error().message);
    kept.emplace(std::move(*opened));
  };
  ends.in(TwoEnds::End::kSlave, [&] { keep(UdpSocket::open(ends.address(TwoEnds::End::kSlave)), slave_socket); });
  if (!failed.empty()) return tl::unexpected(failed);
  ends.in(TwoEnds::End::kMaster, [&] { keep(UdpSocket::open_towards(slave_socket->local(), {}), master_socket); });
  if (!failed.empty()) return tl::unexpected(failed);
  if (const auto connected = slave_socket->connect(master_socket->local()); !connected)
    return tl::unexpected(connected.error().message);
  master = std::make_unique<End>(std::move(*master_socket), SealedLane::Role::kInitiator, keys, 1);
  slave = std::make_unique<End>(std::move(*slave_socket), SealedLane::Role::kResponder, other, 2);
  return std::make_unique<BulkLaneTransfer>(std::move(master), std::move(slave), haptic_bytes);
}

}  // namespace farfeel::bench
