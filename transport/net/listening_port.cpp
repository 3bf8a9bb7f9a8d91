#include "transport/net/listening_port.h"

#include <utility>

namespace farfeel::transport {

ListeningPort::ListeningPort(UdpSocket socket, const Options& options, std::shared_ptr<WakeEvent> wake)
    : socket_(std::move(socket)), options_(options), wake_(std::move(wake)) {}

tl::expected<ListeningPort, Error> ListeningPort::open(const Address& local, const Options& options) {
  auto socket = UdpSocket::open(
      local, {.dscp = options.dscp, .also_ipv4 = options.also_ipv4, .port_use = UdpSocket::Options::Port::kFounds});
  if (!socket) return tl::unexpected(socket.error());
  auto wake = WakeEvent::open();
  if (!wake) return tl::unexpected(wake.error());
  return ListeningPort(std::move(*socket), options, std::make_shared<WakeEvent>(std::move(*wake)));
}

tl::expected<LaneSocket, Error> ListeningPort::make_lane(Dscp dscp, Ecn ecn) {
  std::size_t number = 0;
  while (number < posts_.size() && !posts_[number]->lane_is_gone.load(std::memory_order_acquire)) ++number;
  if (number == kMostLanes)
    return tl::unexpected(
        Error{ErrorKind::kSocket, "no room for another lane on " + to_string(local()) + ": end a session first."});
  auto wake = WakeEvent::open();
  if (!wake) return tl::unexpected(wake.error());
  auto post = std::make_shared<LanePost>(static_cast<std::uint32_t>(number), std::move(*wake), wake_);
  if (number == posts_.size()) posts_.emplace_back();
  posts_[number] = post;
  return LaneSocket(std::move(post), local().port, dscp, ecn);
}

std::optional<Received> ListeningPort::receive_stray(std::span<std::byte> buffer) noexcept {
  for (const auto& post : posts_) {
    while (post->to_listener.pop(stray_)) {
      if (stray_.size > buffer.size()) continue;
      Received received = stray_.received;
      std::copy_n(stray_.bytes.begin(), stray_.size, buffer.begin());
      received.bytes = buffer.first(stray_.size);
      return received;
    }
  }
  return std::nullopt;
}

std::optional<Received> ListeningPort::receive(std::span<std::byte> buffer) noexcept {
  // In turn, so that a flood on either side does not silence the other.
  strays_first_ = !strays_first_;
  if (strays_first_) {
    if (auto stray = receive_stray(buffer)) return stray;
    return socket_.receive(buffer);
  }
  if (auto received = socket_.receive(buffer)) return received;
  return receive_stray(buffer);
}

bool ListeningPort::answer(const Received& question, std::span<const std::byte> datagram) noexcept {
  return socket_.send_from(question.to, question.from, datagram);
}

bool ListeningPort::pass_on(std::uint32_t lane, const Received& received) noexcept {
  if (lane >= posts_.size() || received.bytes.size() > kMostDatagramBytes) return false;
  LanePost& post = *posts_[lane];
  if (post.lane_is_gone.load(std::memory_order_acquire) || !post.to_lane.push(RawDatagram(received))) return false;
  post.wake_lane.signal();
  return true;
}

void ListeningPort::add_to(WaitSet& set) const noexcept {
  set.add(socket_.descriptor());
  set.add(*wake_);
}

bool ListeningPort::wait_until(std::int64_t until_ns) const noexcept {
  WaitSet set;
  add_to(set);
  return set.wait_until(until_ns);
}

}  // namespace farfeel::transport
