#include "master_station/view/newest_session.h"

#include <poll.h>

#include <array>

#include "codecs/view/message_stream.h"

namespace farfeel::master_station {
namespace {

constexpr int kLook_ms = 100;  // how soon an end is noticed, of the master or of this program
constexpr std::size_t kPiece = 64 * 1024;

}  // namespace

NewestSession::NewestSession(FeedSocket socket, std::function<void()> changed)
    : socket_(std::move(socket)),
      changed_(std::move(changed)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::vector<NewestSession::Bytes> NewestSession::parts() const {
  const std::lock_guard lock(mutex_);
  return parts_;
}

NewestSession::Bytes NewestSession::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

std::optional<codecs::ViewTick> NewestSession::take_tick() {
  const std::lock_guard lock(mutex_);
  return std::exchange(tick_, std::nullopt);
}

bool NewestSession::is_over() const {
  const std::lock_guard lock(mutex_);
  return is_over_;
}

void NewestSession::ask(codecs::ViewVerb verb) const {
  const std::vector<std::byte> message = codecs::framed(codecs::write_view(verb));
  (void)socket_.send(message);
}

void NewestSession::take(std::span<const std::byte> message) {
  const auto kind = codecs::kind_of_view(message);
  const auto kept = [&] { return std::make_shared<const std::vector<std::byte>>(message.begin(), message.end()); };
  if (kind == codecs::ViewKind::kTick) {
    auto tick = codecs::read_view_tick(message);
    const std::lock_guard lock(mutex_);
    if (!tick) {
      is_over_ = true;
      return;
    }
    if (tick_) tick->absorb(*tick_);
    tick_ = *std::move(tick);
  } else if (kind == codecs::ViewKind::kStatus && codecs::read_view_status(message)) {
    const std::lock_guard lock(mutex_);
    status_ = kept();
  } else if ((kind == codecs::ViewKind::kScene && codecs::read_view_scene(message)) ||
             (kind == codecs::ViewKind::kBody && codecs::read_view_body(message))) {
    const std::lock_guard lock(mutex_);
    if (parts_.size() <= codecs::kMostViewBodies) parts_.push_back(kept());
  } else {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
}

void NewestSession::run(const std::stop_token& stop) {
  codecs::MessageStream stream(codecs::kMostViewBytes);
  std::vector<std::byte> piece(kPiece);
  while (!stop.stop_requested() && !is_over()) {
    pollfd wait{socket_.fd(), POLLIN, 0};
    ::poll(&wait, 1, kLook_ms);
    const auto got = socket_.receive(piece);
    if (got && *got == 0) {
      changed_();  // whoever waits for it may have been asked to end meanwhile
      continue;
    }
    if (got) stream.put(std::span(piece).first(*got));
    while (const auto message = stream.next()) take(*message);
    if (!got || stream.is_broken()) {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    changed_();
  }
}

}  // namespace farfeel::master_station
