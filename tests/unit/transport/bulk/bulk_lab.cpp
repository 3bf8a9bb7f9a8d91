#include "tests/unit/transport/bulk/bulk_lab.h"

#include <algorithm>
#include <cmath>

namespace farfeel::transport {
namespace {

constexpr std::size_t kWireOverhead = kSealedBytes + 28;
constexpr std::int64_t kPosePeriod_ns = 1'000'000;

}  // namespace

BulkLab::BulkLab(const LabOptions& options)
    : scene(std::make_shared<ByteBudget>(options.scene_bytes)),
      answer_bytes(options.answer_bytes),
      options_(options),
      random_(options.seed) {
  options_.slave.seed = random_(), options_.master.seed = random_();
  ends_[kSlave].lane = std::make_unique<BulkLane>(options_.slave, scene);
  ends_[kMaster].lane = std::make_unique<BulkLane>(options_.master, scene);
  set_link(options.link);
}

void BulkLab::set_link(const LabLink& link) {
  options_.link = link;
  LinkSpec rest = link.path;
  rest.rate_bit_per_s = 0;
  for (Way& way : ways_) way.impairment = std::make_unique<Impairment>(rest, random_());
}

void BulkLab::new_session(bool has_new_slave, bool has_new_master) {
  under_way_.clear();
  for (Node& node : ends_) node.waiting.clear();
  const auto renew = [&](End end, const BulkOptions& options, bool is_new) {
    if (is_new) {
      BulkOptions fresh = options;
      fresh.seed = random_();
      ends_[end].lane = std::make_unique<BulkLane>(fresh, scene);
    } else {
      ends_[end].lane->restart(random_(), 0, now_ns_);
    }
    ends_[end].wake_ns = now_ns_;
  };
  renew(kSlave, options_.slave, has_new_slave);
  renew(kMaster, options_.master, has_new_master);
}

std::int64_t BulkLab::lateness_ns() {
  if (options_.slice_share > 0 && uniform() < options_.slice_share) return options_.slice_ns;
  return static_cast<std::int64_t>(-static_cast<double>(options_.late_ns) * std::log(1 - uniform()));
}

void BulkLab::send(End from, Datagram datagram, std::size_t wire_bytes) {
  const LabLink& link = options_.link;
  if (is_cut_ || wire_bytes - 28 > link.mtu_bytes) return;
  Way& way = ways_[from];
  std::int64_t departs_ns = std::max(now_ns_, way.free_ns);
  if (link.path.rate_bit_per_s > 0) {
    if (departs_ns - now_ns_ > link.path.queue_ns) return;
    departs_ns += std::llround(static_cast<double>(wire_bytes) * 8e9 / link.path.rate_bit_per_s);
    way.free_ns = departs_ns;
  }
  for (const std::int64_t at_ns : way.impairment->releases(departs_ns, wire_bytes)) under_way_.emplace(at_ns, datagram);
}

void BulkLab::wake_by(End end, std::int64_t at_ns) {
  if (at_ns == kNever_ns) return;
  // A thread that is asleep is woken late; one that will be up before then sees it then.
  Node& node = ends_[end];
  if (at_ns < node.wake_ns) node.wake_ns = std::min(node.wake_ns, at_ns + lateness_ns());
}

void BulkLab::wake(End end) {
  Node& node = ends_[end];
  node.wake_ns = kNever_ns;
  if (options_.has_haptic) node.lane->on_haptic_bytes(node.haptic_bytes, now_ns_);
  for (auto& [arrival_ns, bytes] : node.waiting) {
    const auto body = node.lane->on_message(bytes, arrival_ns);
    if (body && on_body) on_body(*body);
    while (auto object = node.lane->inbox().take_object())
      if (on_object) on_object(std::move(*object));
  }
  node.waiting.clear();
  MessageBuffer buffer;
  while (const std::size_t size = node.lane->next(buffer, now_ns_)) {
    Datagram datagram{end == kSlave ? kMaster : kSlave, -1, {buffer.begin(), buffer.begin() + size}};
    if (end == kMaster && options_.receipt_loss > 0 && uniform() < options_.receipt_loss) continue;
    if (on_wire && !on_wire(end, datagram.bytes)) continue;
    send(end, std::move(datagram), size + kWireOverhead);
  }
  while (auto object = node.lane->inbox().take_object())
    if (on_object) on_object(std::move(*object));
  wake_by(end, node.lane->next_time_ns(now_ns_));
}

void BulkLab::run_until(std::int64_t end_ns) {
  // What was asked of a lane meanwhile is seen now.
  for (const End end : {kSlave, kMaster}) wake_by(end, now_ns_);
  while (true) {
    std::int64_t next_ns = std::min(ends_[kSlave].wake_ns, ends_[kMaster].wake_ns);
    if (options_.has_haptic) next_ns = std::min(next_ns, pose_ns_);
    if (!under_way_.empty()) next_ns = std::min(next_ns, under_way_.begin()->first);
    if (next_ns > end_ns) break;
    now_ns_ = std::max(now_ns_, next_ns);
    while (!under_way_.empty() && under_way_.begin()->first <= now_ns_) {
      Datagram datagram = std::move(under_way_.begin()->second);
      under_way_.erase(under_way_.begin());
      if (is_cut_) continue;
      if (datagram.haptic_ns < 0) {
        ends_[datagram.to].waiting.emplace_back(now_ns_, std::move(datagram.bytes));
        wake_by(datagram.to, now_ns_);
      } else if (datagram.to == kSlave) {
        ends_[kSlave].haptic_bytes += answer_bytes;
        send(kSlave, {kMaster, datagram.haptic_ns, {}}, answer_bytes);
      } else {
        round_trips_.push_back(now_ns_ - datagram.haptic_ns);
      }
    }
    if (options_.has_haptic && pose_ns_ <= now_ns_) {
      pose_ns_ += kPosePeriod_ns;
      ends_[kMaster].haptic_bytes += options_.pose_bytes;
      send(kMaster, {kSlave, now_ns_, {}}, options_.pose_bytes);
    }
    for (const End end : {kSlave, kMaster})
      if (ends_[end].wake_ns <= now_ns_) wake(end);
  }
  now_ns_ = end_ns;
}

std::vector<std::int64_t> BulkLab::take_round_trips() {
  auto taken = std::exchange(round_trips_, {});
  std::sort(taken.begin(), taken.end());
  return taken;
}

}  // namespace farfeel::transport
