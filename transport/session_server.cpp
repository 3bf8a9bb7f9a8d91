#include "transport/session_server.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kOfferAgain_ns = 100'000'000;
constexpr int kBurstChunks = 32;  // of one on_time(): bounds the time between two reads of the socket
constexpr int kByes = 3;

}  // namespace

SessionServer::SessionServer(std::uint64_t slave, std::shared_ptr<const Object> object)
    : slave_(slave), object_(std::move(object)) {}

void SessionServer::send_in_session(PacketType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                    const Send& send) {
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = write_packet({type, session_->id, ++sequence_}, payload, datagram);
  if (size == 0) return;
  sent_ns_ = now_ns;
  send(session_->address, std::span(datagram).first(size));
}

void SessionServer::refuse(const Address& to, RefusalReason reason, std::uint64_t master, std::uint32_t session,
                           std::string_view text, const Send& send) {
  ++counters_.refused;
  PayloadBuffer payload;
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size =
      write_packet({PacketType::kRefusal, session, 0}, write(Refusal{reason, master, text}, payload), datagram);
  send(to, std::span(datagram).first(size));
}

void SessionServer::start(const Address& from, const Hello& hello, std::int64_t now_ns) {
  session_.emplace();
  while (session_->id == 0) session_->id = static_cast<std::uint32_t>(random_identity());
  session_->master = hello.master;
  session_->attempt = hello.attempt;
  session_->address = from;
  session_->started_ns = session_->heard_ns = now_ns;
  sequence_ = 0;
  offered_ns_ = 0;
  sender_.reset();
  if (object_) sender_.emplace(1, object_);
  ++counters_.sessions;
}

void SessionServer::on_hello(const Address& from, const Hello& hello, std::int64_t now_ns, const Send& send) {
  if (session_ && session_->master != hello.master) {
    refuse(
        from, RefusalReason::kBusy, hello.master, 0,
        "another master has a session with this slave, which serves one at a time; it is free 2 s after that one ends",
        send);
    return;
  }
  // The same master again: late copies change nothing, a repeated greeting is welcomed to the same session, and one
  // that comes after the session was in use means that the master has lost it.
  if (session_ && hello.attempt < session_->attempt) {
    ++counters_.ignored;
    return;
  }
  if (!session_ || (session_->is_used && hello.attempt != session_->attempt)) {
    start(from, hello, now_ns);
  } else if (session_->is_used && from != session_->address) {
    ++counters_.ignored;
    return;
  }
  session_->attempt = hello.attempt;
  session_->address = from;
  PayloadBuffer payload;
  send_in_session(PacketType::kWelcome, write(Welcome{hello.master, hello.attempt, hello.t_send_ns, slave_}, payload),
                  now_ns, send);
}

std::optional<Packet> SessionServer::on_datagram(const Address& from, std::span<const std::byte> datagram,
                                                 std::int64_t now_ns, const Send& send) {
  const Packet packet = read_packet(datagram);
  if (packet.fault == HeaderFault::kOtherVersion && packet.header.type == PacketType::kHello &&
      datagram.size() == kMaxDatagramBytes) {
    refuse(from, RefusalReason::kOtherVersion, 0, 0,
           "this slave speaks version 1 of the protocol: run the same release of farfeel at both ends", send);
    return std::nullopt;
  }
  if (!packet.ok()) {
    ++counters_.ignored;
    return std::nullopt;
  }
  if (packet.header.type == PacketType::kHello) {
    if (const auto hello = read_hello(packet.payload)) {
      on_hello(from, *hello, now_ns, send);
      return std::nullopt;
    }
    ++counters_.ignored;
    return std::nullopt;
  }
  if (!session_ || packet.header.session != session_->id) {
    // Somebody's session that this process does not know, most likely from before a restart: say so, and it greets
    // again at once.
    if (packet.header.type == PacketType::kKeepAlive && packet.header.session != 0 && read_keep_alive(packet.payload)) {
      refuse(from, RefusalReason::kUnknownSession, 0, packet.header.session, "", send);
    } else {
      ++counters_.ignored;
    }
    return std::nullopt;
  }
  if (from != session_->address) {
    ++counters_.ignored;
    return std::nullopt;
  }
  switch (packet.header.type) {
    case PacketType::kKeepAlive:
    case PacketType::kTileAcknowledge:
      break;
    case PacketType::kAcknowledge:
      if (const auto ack = read_acknowledge(packet.payload); ack && sender_) {
        sender_->on_acknowledge(*ack, now_ns);
        break;
      }
      ++counters_.ignored;
      return std::nullopt;
    case PacketType::kBye:
      if (read_bye(packet.payload)) {
        session_.reset();
        sender_.reset();
        last_end_ = "the master said goodbye";
        return std::nullopt;
      }
      [[fallthrough]];
    default:
      ++counters_.ignored;
      return std::nullopt;
  }
  session_->is_used = true;
  session_->heard_ns = now_ns;
  if (packet.header.type == PacketType::kTileAcknowledge) return packet;
  return std::nullopt;
}

void SessionServer::on_time(std::int64_t now_ns, const Send& send) {
  if (!session_) return;
  if (now_ns - session_->heard_ns > kSilence_ns) {
    end(ByeReason::kSilence, send);
    return;
  }
  PayloadBuffer payload;
  if (sender_ && !sender_->is_wanted() && (offered_ns_ == 0 || now_ns - offered_ns_ >= kOfferAgain_ns)) {
    offered_ns_ = now_ns;
    send_in_session(PacketType::kOffer, write(sender_->offer(), payload), now_ns, send);
  }
  for (int i = 0; i < kBurstChunks && sender_; ++i) {
    const auto chunk = sender_->next_chunk(now_ns);
    if (!chunk) break;
    send_in_session(PacketType::kChunk, write(*chunk, payload), now_ns, send);
  }
  if (now_ns - sent_ns_ >= kKeepAlive_ns) {
    send_in_session(PacketType::kKeepAlive, write(KeepAlive{}, payload), now_ns, send);
  }
}

std::int64_t SessionServer::next_time_ns(std::int64_t now_ns) const {
  if (!session_) return std::numeric_limits<std::int64_t>::max();
  std::int64_t next = std::min(session_->heard_ns + kSilence_ns + 1, sent_ns_ + kKeepAlive_ns);
  if (sender_) {
    next = std::min(next, sender_->is_wanted() ? sender_->next_time_ns(now_ns) : offered_ns_ + kOfferAgain_ns);
  }
  return std::max(next, now_ns);
}

void SessionServer::heard_at(std::int64_t time_ns) {
  if (!session_) return;
  session_->is_used = true;
  session_->heard_ns = std::max(session_->heard_ns, time_ns);
}

void SessionServer::send_message(PacketType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                 const Send& send) {
  if (session_) send_in_session(type, payload, now_ns, send);
}

void SessionServer::end(ByeReason reason, const Send& send) {
  if (!session_) return;
  PayloadBuffer payload;
  const auto bye = write(Bye{reason}, payload);
  for (int i = 0; i < kByes; ++i) send_in_session(PacketType::kBye, bye, session_->heard_ns, send);
  last_end_ = reason == ByeReason::kSilence ? "nothing was heard from the master for 2 s" : "the slave ended it";
  session_.reset();
  sender_.reset();
}

}  // namespace farfeel::transport
