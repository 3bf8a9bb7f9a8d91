#include "master_station/view/newest_session.h"

#include <poll.h>

#include <array>

#include "codecs/view/message_stream.h"
#include "codecs/view/view_shapes.h"

namespace farfeel::master_station {
namespace {

constexpr int kLook_ms = 100;  // how soon an end is noticed, of the master or of this program
constexpr std::size_t kPiece = 64 * 1024;
constexpr std::size_t kMostParts = 1 + 2 * codecs::kMostViewBodies;  // the scene, its bodies and their tiles

}  // namespace

NewestSession::NewestSession(FeedSocket socket, std::function<void()> changed)
    : socket_(std::move(socket)),
      changed_(std::move(changed)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::vector<NewestSession::Bytes> NewestSession::parts() const {
  const std::lock_guard lock(mutex_);
  return parts_;
}

NewestSession::Newest NewestSession::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

codecs::ViewHistory NewestSession::history() const {
  const std::lock_guard lock(mutex_);
  return recent_.history();
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

void NewestSession::keep(codecs::ViewTick tick) {
  recent_.add(tick);
  if (tick_) tick.absorb(*tick_);
  tick_ = std::move(tick);
}

/// What is no message of a master ends it.
void NewestSession::take(std::span<const std::byte> message) {
  using codecs::ViewKind;
  const auto kept = [&] { return std::make_shared<const std::vector<std::byte>>(message.begin(), message.end()); };
  const auto kind = codecs::kind_of_view(message);
  if (kind == ViewKind::kTick) {
    auto tick = codecs::read_view_tick(message);
    const std::lock_guard lock(mutex_);
    if (tick)
      keep(*std::move(tick));
    else
      is_over_ = true;
    return;
  }
  const bool is_part = kind == ViewKind::kScene   ? codecs::read_view_scene(message).has_value()
                       : kind == ViewKind::kBody  ? codecs::read_view_body(message).has_value()
                       : kind == ViewKind::kTiles ? codecs::read_view_tiles(message).has_value()
                                                  : false;
  const bool is_news = kind == ViewKind::kStatus     ? codecs::read_view_status(message).has_value()
                       : kind == ViewKind::kPresence ? codecs::read_view_presence(message).has_value()
                       : kind == ViewKind::kAnswer   ? codecs::read_view_answer(message).has_value()
                                                     : false;
  const std::lock_guard lock(mutex_);
  if (is_news) {
    newest_[kind == ViewKind::kStatus ? 0 : kind == ViewKind::kPresence ? 1 : kAnswer] = kept();
  } else if (is_part && parts_.size() < kMostParts) {
    parts_.push_back(kept());
  } else {
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
