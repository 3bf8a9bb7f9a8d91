#include "tests/bench/remote_across_link.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "codecs/felt/felt_outline.h"
#include "transport/lane/lane_keys.h"

namespace farfeel::bench {

namespace {

constexpr std::int64_t kRequest_ns = 100'000'000;  // between two requests for tiles, as a master's session has it

bool is_newer(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) > 0;
}

}  // namespace

void Lane::send(std::int64_t now_ns, std::vector<std::byte> payload) {
  for (const std::int64_t at_ns : link_.releases(now_ns, payload.size())) {
    const auto before = std::upper_bound(due_.begin(), due_.end(), at_ns,
                                         [](std::int64_t t, const Datagram& other) { return t < other.at_ns; });
    due_.insert(before, {at_ns, payload});
  }
}

RemoteAcrossLink::RemoteAcrossLink(const FeltPair& pair, const contact::Material& material,
                                   const transport::LinkSpec& link, const Options& options, std::uint64_t seed)
    : RemoteAcrossLink(std::array{pair.tool(material), pair.object(material)}, pair.options(), link, options, seed) {}

RemoteAcrossLink::RemoteAcrossLink(std::span<const contact_service::TouchableObject> bodies,
                                   const contact_service::ContactOptions& felt_options, const transport::LinkSpec& link,
                                   const Options& options, std::uint64_t seed)
    : options_(options),
      service_(bodies.subspan(1), bodies.front(), felt_options),
      bulk_there_({.inbox = {}, .seed = seed}, std::make_shared<transport::ByteBudget>(0)),
      bulk_here_({.inbox = {}, .seed = seed}, std::make_shared<transport::ByteBudget>(0)),
      poses_up_(link, 4 * seed),
      tiles_up_(link, 4 * seed + 1),
      contacts_down_(link, 4 * seed + 2),
      tiles_down_(link, 4 * seed + 3) {
  if (!options.has_outline) return;
  const bool is_textured =
      std::any_of(bodies.begin(), bodies.end(), [](const auto& b) { return b.felt->is_textured(); });
  if (options.has_tiles && is_textured)
    bulk_there_.add_source(feed_.emplace(bodies.subspan(1), bodies.front(), felt_options, options.feed, options.edits));
  const auto outline = codecs::write_felt_outline(bodies, felt_options);
  if (!outline) throw std::runtime_error(outline.error());
  outline_bytes_ = outline->size();
  contact_service::FeltScene scene = codecs::read_felt_outline(*outline).value();
  for (std::size_t i = 0; i < bodies.size(); ++i)  // which comes with the picture of the scene
    if (bodies[i].motion) scene.bodies[i].motion = *bodies[i].motion;
  cache_ = std::make_unique<local_model::TileCache>(std::move(scene));
  if (options.knows_heights) {
    for (std::uint32_t surface = 0; surface < bodies.size(); ++surface) {
      const auto& tiles = bodies[surface].felt->tiles;
      for (std::uint32_t i = 0; i < tiles.size(); ++i) {
        (void)cache_->put({surface, i}, tiles[i]);
        cache_->take_arrived(1);
      }
    }
  }
  contacts_.emplace(*cache_);
  if (options.has_tiles) receiver_.emplace(*cache_);
}

void RemoteAcrossLink::edit(const slave_sim::SurfaceEdit& edit) {
  if (feed_) return feed_->edit(edit);
  if (options_.edits) (void)options_.edits->apply(edit);
}

void RemoteAcrossLink::send(const master_station::ToolState& tool) noexcept {
  std::vector<std::byte> payload(transport::kMaxMessageBytes);
  codecs::PoseMessage pose;
  pose.sequence = tool.sequence;
  pose.time_us = tool.time_ns / 1000;
  pose.X_WT = tool.X_WT;
  pose.V_WT_W = tool.V_WT_W;
  pose.wants_curvature = options_.has_curvature;
  pose.ahead_us = options_.has_curvature ? ahead_us_ : 0;
  pose.heard = answers_here_.heard(poses_here_);
  payload.resize(poses_here_.write(pose, payload));
  poses_up_.send(now_ns_, std::move(payload));
  if (!receiver_) return;
  receiver_->put_waiting();
  send_from(bulk_here_, tiles_up_, now_ns_);
  if (now_ns_ - requested_ns_ < kRequest_ns) return;
  requested_ns_ = now_ns_;
  std::vector<std::byte> request(codecs::kTileRequestBytes);
  (void)codecs::write(codecs::TileRequest{1}, request);
  tiles_up_.send(now_ns_, std::move(request));
}

void RemoteAcrossLink::send_from(transport::BulkLane& end, Lane& lane, std::int64_t now_ns) {
  transport::MessageBuffer message;
  while (const std::size_t size = end.next(message, now_ns))
    lane.send(now_ns, {message.begin(), message.begin() + static_cast<std::ptrdiff_t>(size)});
}

/// The far end answers the newest pose that has come, at its own rate, up to the master's time.
void RemoteAcrossLink::live_far_end() {
  for (; far_ns_ <= now_ns_; far_ns_ += options_.answer_period_ns) {
    poses_up_.deliver(far_ns_, [&](const std::vector<std::byte>& payload) {
      codecs::PoseMessage pose;
      if (codecs::read(payload, poses_here_.grid(), pose) != codecs::Fault::kNone) return;
      answers_there_.acknowledge(pose.heard);
      if (has_pose_ && !is_newer(pose.number, pose_there_.sequence)) return;
      has_pose_ = true;
      asked_there_ = pose.X_WT;
      const spatial::Pose X_WT =
          pose.ahead_us == 0
              ? pose.X_WT
              : codecs::on_grid(spatial::integrate(pose.X_WT, pose.V_WT_W, 1e-6 * pose.ahead_us), poses_here_.grid());
      pose_there_ = {pose.number, 1000 * pose.time_us, X_WT, pose.V_WT_W, pose.wants_curvature};
    });
    if (!has_pose_) continue;
    std::vector<std::byte> payload(transport::kMaxMessageBytes);
    codecs::AnswerMessage answer;
    const contact_service::Answer& found = service_.answer(pose_there_);
    answer.set = found;
    if (options_.watch) options_.watch->on_answered(pose_there_, found);
    payload.resize(answers_there_.write(answer, asked_there_, payload));
    contacts_down_.send(far_ns_, std::move(payload));
    if (!feed_) continue;
    tiles_up_.deliver(far_ns_, [&](const std::vector<std::byte>& bytes) {
      if (bytes.size() == codecs::kTileRequestBytes) return feed_->on_request(bytes);
      (void)bulk_there_.on_message(bytes, far_ns_);
    });
    feed_->aim(found.at_proxy(pose_there_), found.times.widest_m, bulk_there_.pacer().time_away_ns(), far_ns_);
    send_from(bulk_there_, tiles_down_, far_ns_);
  }
}

bool RemoteAcrossLink::poll(contact::ContactSet& newest) noexcept {
  live_far_end();
  if (receiver_)
    tiles_down_.deliver(now_ns_, [&](const std::vector<std::byte>& bytes) {
      const auto body = bulk_here_.on_message(bytes, now_ns_);
      if (!body) return;
      if (options_.watch) options_.watch->on_tile(body->bytes);
      receiver_->on_tile(body->bytes);
    });
  bool has_any = false;
  contacts_down_.deliver(now_ns_, [&](const std::vector<std::byte>& payload) {
    codecs::AnswerMessage answer;
    if (options_.watch) options_.watch->on_answer(payload);
    if (answers_here_.read(payload, poses_here_, answer) != codecs::Fault::kNone) return;
    has_any = true;
    newest = answer.set;
    ahead_us_ = static_cast<std::uint32_t>(
        std::clamp<std::int64_t>((now_ns_ - answer.set.pose_time_ns) / 1000, 0, codecs::kMostAhead_us));
  });
  return has_any;
}

}  // namespace farfeel::bench
