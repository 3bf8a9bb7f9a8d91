#include "slave_sim/session/slave_session.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>

#include "codecs/felt/session_object.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::int64_t kStatus_ns = 200'000'000;
constexpr std::int64_t kWait_ns = 50'000'000;  // longest before a stop is noticed
constexpr int kMostDatagramsAtOnce = 256;      // between two looks at the clock
constexpr int kMostStrangersAtOnce = 64;
constexpr std::int64_t kLookAgain_ns = 2'000'000;  // after no new pose was found
constexpr std::chrono::milliseconds kCatchUp{1};   // between two looks whether a thread has
// A course begins when the master knows it. What the newest pose tells of scene time is older by the way up, and the
// course takes the way down: a round trip; one loss, told by a receipt, costs another and some milliseconds.
constexpr std::int64_t kTrips = 2, kLead_ns = 30'000'000;
// Between two looks at the allow-list: a revoked operator is out within 1 s.
constexpr std::int64_t kList_ns = 250'000'000;
constexpr std::int64_t kNews_ns = 250'000'000;  // between two tellings of the same news, of which some are lost

}  // namespace

tl::expected<std::unique_ptr<SlaveSession>, transport::Error> SlaveSession::start(const Options& options,
                                                                                  const std::vector<std::byte>& scene,
                                                                                  ContactSource& contacts,
                                                                                  const Felt& felt) {
  std::vector<std::byte> object(codecs::kPoseGridBytes);
  (void)codecs::write(options.grid, object);
  const std::vector<std::byte> parts = codecs::session_object({scene, felt.outline});
  object.insert(object.end(), parts.begin(), parts.end());
  if (scene.empty() || object.size() > transport::kMaxObjectBytes)
    return tl::unexpected(transport::Error{
        transport::ErrorKind::kProtocol,
        "cannot serve a scene of " + std::to_string(scene.size()) + " bytes: it must have between 1 byte and 64 MiB"});
  auto port = transport::ListeningPort::open(options.local, {.also_ipv4 = options.local.is_any()});
  if (!port) return tl::unexpected(port.error());
  auto bulk = port->make_lane(transport::Dscp::kLowerEffort);
  if (!bulk) return tl::unexpected(bulk.error());
  auto haptic = port->make_lane(transport::Dscp::kExpedited);
  if (!haptic) return tl::unexpected(haptic.error());
  std::optional<RelayedPorts> relayed;
  if (options.relay) {
    auto opened = RelayedPorts::open(*options.relay);
    if (!opened) return tl::unexpected(opened.error());
    relayed.emplace(std::move(*opened));
  }
  auto changed = transport::WakeEvent::open();
  if (!changed) return tl::unexpected(changed.error());
  return std::unique_ptr<SlaveSession>(new SlaveSession(options, std::move(object), contacts, felt, *std::move(changed),
                                                        *std::move(port), *std::move(bulk), *std::move(haptic),
                                                        std::move(relayed)));
}

SlaveSession::SlaveSession(const Options& options, std::vector<std::byte> object, ContactSource& contacts,
                           const Felt& felt, transport::WakeEvent changed, transport::ListeningPort port,
                           transport::LaneSocket bulk, transport::LaneSocket haptic,
                           std::optional<RelayedPorts> relayed)
    : log_(options.log ? options.log : [](const std::string&) {}),
      look_at_list_(options.look_at_list ? options.look_at_list : [] {}),
      tell_status_(options.tell_status),
      port_(std::move(port)),
      local_(port_.local()),
      bulk_(std::move(bulk)),
      relayed_(std::move(relayed)),
      lane_(std::move(haptic), contacts, options.grid, options.body),
      tiles_(felt.tiles),
      changed_(std::move(changed)),
      server_({options.own, transport::random_identity(), options.find, transport::make_object(std::move(object))}),
      courses_(felt.may_change),
      send_([this](const transport::Address& to, std::span<const std::byte> datagram) { send(to, datagram); }) {
  for (const ObjectChange& change : felt.changed) (void)courses_.change(change, 0);
  server_.bulk().add_source(courses_to_master_);
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    sides_[i].courses = std::make_unique<CourseFeed>(courses_);
    server_.sides().bulk(i).add_source(*sides_[i].courses);
  }
  if (tiles_) server_.bulk().add_source(*tiles_);
  // A thread names itself: the name of another one is a file to be written, and a confined slave writes none.
  contact_thread_ = std::jthread([this](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "contact");
    lane_.run(stop);
  });
  io_thread_ = std::jthread([this](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "io");
    run_io(stop);
  });
}

SlaveSession::~SlaveSession() = default;

void SlaveSession::edit(const SurfaceEdit& edit) {
  while (!lane_.edit(edit)) std::this_thread::sleep_for(kCatchUp);
  while (tiles_ && !tile_edits_.push(edit)) std::this_thread::sleep_for(kCatchUp);
  changed_.signal();
}

void SlaveSession::change(const ObjectChange& change) {
  while (!changes_.push(change)) std::this_thread::sleep_for(kCatchUp);
  changed_.signal();
}

void SlaveSession::set_out(const motion::ObjectCourse& told) {
  while (!lane_.set_out(told)) std::this_thread::sleep_for(kCatchUp);
  if (tiles_) tiles_->set_out(told);
}

/// What was changed is told at once, and the tiles that it needs are looked for at once.
void SlaveSession::take_changes(std::int64_t now_ns) {
  const ContactLane::SceneTime newest = lane_.scene_time();
  const std::int64_t scene_ns = newest.arrived_ns == 0 ? 0 : newest.scene_ns + now_ns - newest.arrived_ns;
  scene_ns_.store(scene_ns, std::memory_order_relaxed);
  bool is_changed = false;
  SurfaceEdit edit;
  for (; tile_edits_.pop(edit); is_changed = true) tiles_->edit(edit);
  const std::int64_t lead_ns = scene_ns == 0 ? 0 : kTrips * server_.bulk().pacer().time_away_ns() + kLead_ns;
  ObjectChange change;
  for (; changes_.pop(change); is_changed = true) {
    const auto told = courses_.change(change, 1e-9 * static_cast<double>(scene_ns + lead_ns));
    if (told) set_out(*told);
  }
  if (!is_changed || !tiles_) return;
  tiles_->hurry();
  looked_ns_ = 0;
}

void SlaveSession::tell_of_changes(std::int64_t now_ns) {
  const std::uint32_t id = server_.session() ? server_.session()->id : 0;
  const bool is_silent = server_.is_silent(now_ns);
  has_master_.store(id != 0 && !is_silent, std::memory_order_relaxed);
  if (id == live_ && is_silent != is_silent_) {
    log_(is_silent ? "nothing was heard from the master for 2 s; it may come back" : "the master is heard again");
  }
  is_silent_ = is_silent;
  if (id == live_) return;
  if (live_ != 0) log_("session ended: " + server_.last_end());
  live_ = id;
  status_ns_ = 0;
  lane_.set_session(id);
  if (id == 0) return;
  if (tiles_) tiles_->restart();
  courses_to_master_.restart();
  for (const motion::ObjectCourse& told : courses_.begin_session()) set_out(told);
  log_("session started with " + server_.session()->operator_name + " at " +
       transport::to_string(*server_.bulk_address()));
}

codecs::SlaveStatus SlaveSession::status() {
  const ContactLane::Report& report = lane_.report();
  codecs::SlaveStatus status;
  if (report.session != live_) return status;  // the contact thread has not taken the session over yet
  if (const std::int64_t span_ns = report.last_answer_ns - report.first_answer_ns; span_ns > 0)
    status.contact_hz = static_cast<double>(report.answered - 1) * 1e9 / static_cast<double>(span_ns);
  status.contact_us_p50 = static_cast<double>(report.answer_time.quantile_ns(0.5)) * 1e-3;
  status.contact_us_p99 = static_cast<double>(report.answer_time.quantile_ns(0.99)) * 1e-3;
  status.contact_us_max = static_cast<double>(report.answer_time.max_ns()) * 1e-3;
  status.waiting_us_p50 = static_cast<double>(report.waiting.quantile_ns(0.5)) * 1e-3;
  status.waiting_us_p99 = static_cast<double>(report.waiting.quantile_ns(0.99)) * 1e-3;
  status.waiting_us_max = static_cast<double>(report.waiting.max_ns()) * 1e-3;
  status.poses_received = report.poses.received;
  status.poses_lost = report.poses.lost;
  status.poses_late = report.poses.late;
  status.poses_duplicate = report.poses.duplicate;
  status.poses_malformed = report.malformed;
  status.contacts_sent = report.sent;
  status.contacts_left_out = report.left_out;
  return status;
}

/// Which tiles will be needed; the bulk lane sends them as it may.
void SlaveSession::look_ahead(std::int64_t now_ns) {
  if (now_ns - looked_ns_ < TileFeed::kAim_ns) return;
  const contact_service::ToolPose* look = lane_.newest_look();
  looked_ns_ = look ? now_ns : now_ns - TileFeed::kAim_ns + kLookAgain_ns;
  if (look && lane_.heard_ns() > 0) tiles_->aim(*look, lane_.widest_m(), server_.bulk().pacer().time_away_ns(), now_ns);
}

// To the master from its lane's socket; to others from the address that they asked. Both lanes of a relayed master have
// the relay's address, so there the port that was asked decides.
void SlaveSession::send(const transport::Address& to, std::span<const std::byte> datagram) {
  if (relayed_ && question_ != nullptr && question_->from == to && relayed_->answer(*question_, datagram)) return;
  const auto side = std::ranges::find_if(sides_, [&](const Side& s) { return s.from && s.from->from == to; });
  if (bulk_.peer() == to) {
    bulk_.send(datagram);
  } else if (side != sides_.end()) {
    port_.answer(*side->from, datagram);
  } else if (question_ != nullptr && question_->from == to) {
    port_.answer(*question_, datagram);
  }
}

// The bulk lane's socket goes where the master is, and to whichever of this machine's addresses it sends; without one
// it hears nobody.
void SlaveSession::follow_master(const transport::Received* opened) {
  const auto& master = server_.bulk_address();
  if (!master && bulk_.peer()) bulk_.disconnect();
  if (!master || opened == nullptr || opened->from != *master || bulk_.is_connected_to(*master, opened->to)) return;
  const bool has_moved = bulk_.peer() && bulk_.peer() != *master;
  if (!bulk_.connect_to(*master, opened->to)) return;
  if (has_moved) log_("the master is at " + transport::to_string(*master) + " now");
}

void SlaveSession::take(const transport::Received& received, std::span<std::byte> bytes) {
  if (relayed_ && relayed_->take(received, transport::monotonic_ns())) return;
  question_ = &received;
  const auto outcome = server_.on_datagram(received.from, bytes, received.time_ns, transport::wall_clock_ns(), send_);
  question_ = nullptr;
  if (outcome.side) return take_of_side(received, *outcome.side);
  if (outcome.is_for_haptic) port_.pass_on(lane_.number(), received);
  if (outcome.is_opened) bulk_meter_.on_datagram(received);
  follow_master(outcome.is_opened ? &received : nullptr);
  tell_of_changes(transport::monotonic_ns());  // first: with this datagram a session may begin
  if (outcome.message && tiles_) {
    const bool is_request = outcome.message->type == transport::MessageType::kTileRequest;
    is_request ? tiles_->on_request(outcome.message->payload) : tiles_->on_held(outcome.message->payload);
  }
  if (const auto grant = server_.take_haptic_grant()) lane_.give_keys(*grant);
}

void SlaveSession::take_of_side(const transport::Received& received, const transport::SideSessions::Heard& heard) {
  const transport::SideSession* const session = server_.sides().live(heard.place);
  if (session == nullptr) return;
  sides_[heard.place].from = received;
  sides_[heard.place].from->bytes = {};
  if (!heard.message) return;
  if (heard.message->type == transport::MessageType::kSaveRequest) {
    if (const auto request = codecs::read_save_request(heard.message->payload))
      desk_.ask(SaveQuestion{session->name, session->id, request->number});
  } else if (auto request = codecs::read_edit_request(heard.message->payload)) {
    (void)desk_.ask(EditQuestion{session->key, session->name, session->id, *std::move(request)});
  }
}

/// Who came and who went is said; answers and news go out.
void SlaveSession::look_after_sides(std::int64_t now_ns) {
  const std::vector<EditDesk::Answered> answers = desk_.take_answers();
  const std::vector<EditDesk::SaveAnswered> saves = desk_.take_save_answers();
  const codecs::SceneNews news = desk_.news();
  const bool is_news_due = news.version != std::exchange(told_version_, news.version) || now_ns - told_ns_ >= kNews_ns;
  if (is_news_due) told_ns_ = now_ns;
  std::array<std::byte, codecs::kMostEditBytes> payload;
  const auto send = [&](std::size_t place, transport::MessageType type, std::size_t size) {
    server_.sides().send(place, type, std::span(payload).first(size), now_ns, send_);
  };
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    Side& side = sides_[i];
    const transport::SideSession* const session = server_.sides().live(i);
    if (const std::uint32_t id = session ? session->id : 0; id != std::exchange(side.live, id)) {
      side.courses->restart();
      server_.sides().bulk(i).outbox().withdraw(transport::kSavedSlot, now_ns);  // of who was here before
      if (session) {
        log_(fmt::format("{} {} the scene, from {}", session->name, session->may_edit ? "may edit" : "watches",
                         side.from ? transport::to_string(side.from->from) : "somewhere"));
      } else {
        side.from.reset();
      }
      if (session) send(i, transport::MessageType::kSceneNews, codecs::write(news, payload));
    }
    if (session == nullptr) continue;
    for (const EditDesk::Answered& answered : answers) {
      if (answered.session == session->id)
        send(i, transport::MessageType::kEditAnswer, codecs::write(answered.answer, payload));
    }
    for (const EditDesk::SaveAnswered& answered : saves) {
      if (answered.session != session->id) continue;
      if (answered.saved.object)
        server_.sides().bulk(i).outbox().offer(transport::kSavedSlot, answered.saved.object, transport::kSceneUrgency,
                                               now_ns);
      send(i, transport::MessageType::kSaveAnswer, codecs::write(answered.saved.answer, payload));
    }
    if (is_news_due) send(i, transport::MessageType::kSceneNews, codecs::write(news, payload));
  }
}

void SlaveSession::answer(const EditQuestion& question, const codecs::EditAnswer& answer) {
  desk_.answer(question.session, answer);
  changed_.signal();
}

void SlaveSession::answer(const SaveQuestion& question, Saved saved) {
  desk_.answer(question.session, std::move(saved));
  changed_.signal();
}

void SlaveSession::tell(const codecs::SceneNews& news) {
  desk_.set_news(news);
  changed_.signal();
}

void SlaveSession::look_after_relay(std::int64_t now_ns) {
  if (!relayed_) return;
  if (server_.session() && !server_.is_silent(now_ns)) {
    if (bulk_heard_ns_ > 0) relayed_->heard_at(transport::LaneKind::kBulk, bulk_heard_ns_, now_ns);
    if (lane_.heard_ns() > 0) relayed_->heard_at(transport::LaneKind::kHaptic, lane_.heard_ns(), now_ns);
  }
  relayed_->on_time(now_ns);
}

void SlaveSession::run_io(const std::stop_token& stop) {
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  while (!stop.stop_requested()) {
    const std::int64_t before_ns = transport::monotonic_ns();
    std::int64_t until_ns = std::min(server_.next_time_ns(before_ns), before_ns + kWait_ns);
    if (tiles_ && has_master()) until_ns = std::min(until_ns, looked_ns_ + TileFeed::kAim_ns);
    transport::WaitSet wait;
    port_.add_to(wait);
    bulk_.add_to(wait);
    wait.add(changed_);
    if (relayed_) {
      relayed_->add_to(wait);
      until_ns = std::min(until_ns, relayed_->next_time_ns());
    }
    wait.wait_until(until_ns);
    // The master's own datagrams first, and a bounded number of strangers' after them.
    for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
      const auto received = bulk_.receive(buffer);
      if (!received) break;
      bulk_heard_ns_ = received->time_ns;
      take(*received, std::span(buffer).first(received->bytes.size()));
    }
    for (int i = 0; i < kMostStrangersAtOnce; ++i) {
      const auto received = port_.receive(buffer);
      if (!received) break;
      take(*received, std::span(buffer).first(received->bytes.size()));
    }
    for (int i = 0; relayed_ && i < kMostStrangersAtOnce; ++i) {
      const auto received = relayed_->receive(buffer);
      if (!received) break;
      take(*received, std::span(buffer).first(received->bytes.size()));
    }
    const std::int64_t now_ns = transport::monotonic_ns();
    take_changes(now_ns);
    if (const std::int64_t heard_ns = lane_.heard_ns(); heard_ns > 0 && lane_.report().session == live_)
      server_.heard_at(heard_ns);
    if (now_ns - list_ns_ >= kList_ns) {
      list_ns_ = now_ns;
      look_at_list_();
      if (tell_status_) tell_status_(link_status(now_ns));
      if (relayed_) {
        if (const std::string news = relayed_->news(now_ns); !news.empty()) log_(news);
      }
      server_.on_changed_list(now_ns, send_);
    }
    if (tiles_ && has_master()) look_ahead(now_ns);
    server_.bulk().on_haptic_bytes(lane_.sent_bytes(), now_ns);
    look_after_sides(now_ns);
    server_.on_time(now_ns, send_);
    look_after_relay(now_ns);
    follow_master(nullptr);
    tell_of_changes(now_ns);
    if (live_ != 0 && now_ns - status_ns_ >= kStatus_ns) {
      std::array<std::byte, codecs::kSlaveStatusBytes> payload;
      const std::size_t size = codecs::write(status(), payload);
      status_ns_ = now_ns;
      server_.send_message(transport::MessageType::kSlaveStatus, std::span(payload).first(size), now_ns, send_);
    }
  }
  server_.end(transport::ByeReason::kDone, transport::monotonic_ns(), send_);
  server_.sides().end_all(transport::monotonic_ns(), send_);
  tell_of_changes(transport::monotonic_ns());
}

}  // namespace farfeel::slave_sim
