#include "transport/side_sessions.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

bool may_come(const Operator& who) {
  return !who.is_expired && (who.may_watch || who.may_edit);
}

}  // namespace

SideSessions::SideSessions(const std::shared_ptr<const Object>& scene) {
  if (!scene) return;
  for (Place& place : places_) place.peer.bulk().outbox().offer(kSceneSlot, scene, kSceneUrgency, 0);
}

Admission SideSessions::decide(const Applicant& applicant, std::int64_t now_ns) {
  if (!may_come(applicant.allowed)) return {Verdict::kNotAllowed, 0};
  const auto own = std::ranges::find_if(places_, [&](const Place& place) {
    return place.session && place.session->key == applicant.key && place.session->process == applicant.master;
  });
  if (own != places_.end()) return {Verdict::kWelcome, own->session->id};
  const auto of_key = std::ranges::count_if(
      places_, [&](const Place& place) { return !is_free(place, now_ns) && place.session->key == applicant.key; });
  if (of_key >= static_cast<std::ptrdiff_t>(kMostOfOneKey)) return {Verdict::kBusy, 0};
  const auto free = std::ranges::find_if(places_, [&](const Place& place) { return is_free(place, now_ns); });
  if (free == places_.end()) return {Verdict::kBusy, 0};
  free->leave();
  free->session = {
      random_session(), applicant.key, applicant.allowed.name, applicant.allowed.may_edit, applicant.master,
      now_ns,           false};
  return {Verdict::kWelcome, free->session->id};
}

void SideSessions::on_keys(const LaneKeys& keys, const Address& asked_from, std::int64_t now_ns) {
  for (Place& place : places_) {
    if (!place.session || place.session->id != keys.session) continue;
    if (place.session->is_live) return place.peer.renew(keys, asked_from);
    SealedLane seal(SealedLane::Role::kResponder);
    seal.adopt(keys);
    return place.peer.begin(std::move(seal), asked_from, 0, now_ns);
  }
}

std::optional<SideSessions::Heard> SideSessions::on_datagram(const Address& from, std::span<std::byte> datagram,
                                                             std::int64_t now_ns, const Send& send) {
  const auto at = std::ranges::find_if(
      places_, [&](const Place& place) { return place.session && place.peer.seal().knows(datagram); });
  if (at == places_.end()) return std::nullopt;
  Heard heard{static_cast<std::size_t>(at - places_.begin()), std::nullopt};
  const auto opened = at->peer.open(datagram, now_ns);
  if (!opened) return heard;
  at->session->heard_ns = now_ns;
  at->session->is_live = true;
  at->peer.follow(from, datagram.size(), *opened);
  const BulkPeer::Read read = at->peer.read(from, *opened, now_ns);
  if (at->peer.bulk().peer_lies()) {
    at->peer.say_bye(ByeReason::kDisbelieved, now_ns, send);
    at->leave();
  } else if (read.message && read.message->type == MessageType::kBye) {
    if (read_bye(read.message->payload)) at->leave();
  } else if (read.message && (read.message->type == MessageType::kSaveRequest ||
                              (read.message->type == MessageType::kEditRequest && at->session->may_edit))) {
    heard.message = read.message;
  }
  return heard;
}

void SideSessions::on_time(std::int64_t now_ns, const Send& send) {
  for (Place& place : places_) {
    if (!place.session) continue;
    if (is_free(place, now_ns)) {
      place.leave();
    } else if (place.session->is_live) {
      place.peer.on_time(now_ns, send);
    }
  }
}

std::int64_t SideSessions::next_time_ns(std::int64_t now_ns) {
  std::int64_t next = std::numeric_limits<std::int64_t>::max();
  for (Place& place : places_) {
    if (!place.session) continue;
    next = std::min(next, place.session->heard_ns + kSilence_ns + 1);
    if (place.session->is_live) next = std::min(next, place.peer.next_time_ns(now_ns));
  }
  return std::max(next, now_ns);
}

void SideSessions::send(std::size_t place, MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                        const Send& send) {
  if (live(place)) places_[place].peer.send(type, payload, now_ns, send);
}

void SideSessions::on_changed_list(const HandshakeServer::Find& find, std::int64_t now_ns, const Send& send) {
  for (Place& place : places_) {
    if (!place.session) continue;
    const auto found = find(place.session->key);
    if (found && may_come(*found)) {
      place.session->may_edit = found->may_edit;
      continue;
    }
    place.peer.say_bye(ByeReason::kRevoked, now_ns, send);
    place.leave();
  }
}

void SideSessions::end_all(std::int64_t now_ns, const Send& send) {
  for (Place& place : places_) {
    if (place.session && place.session->is_live) place.peer.say_bye(ByeReason::kDone, now_ns, send);
    place.leave();
  }
}

}  // namespace farfeel::transport
