// A remote node in the same process: an analytic surface z = h(x), touched by points of the tool, answering at a rate
// and across a link in simulated time. Deterministic.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <glm/glm.hpp>
#include <numbers>
#include <vector>

#include "haptic_core/contact/contact_set.h"
#include "master_station/haptic_loop/remote.h"
#include "transport/link/impairment.h"

namespace farfeel::test_support {

struct AnalyticWorld {
  double level_m = 0;       ///< of the mean surface
  double amplitude_m = 0;   ///< of ridges along y; 0: a plane
  double period_m = 0.002;  ///< of the ridges
  double near_m = 0.005;    ///< contacts nearer than this are sent
  std::vector<glm::dvec3> points_T{{0, 0, 0}};
  contact::Material material;

  [[nodiscard]] contact::ContactSet contacts(const spatial::Pose& X_WT) const {
    contact::ContactSet set;
    set.X_WT = X_WT;
    const double wave = 2 * std::numbers::pi / period_m;
    for (std::size_t i = 0; i < points_T.size(); ++i) {
      const glm::dvec3 p = spatial::transform_point(X_WT, points_T[i]);
      const double depth_m = level_m + amplitude_m * std::cos(wave * p.x) - p.z;
      if (depth_m < -near_m) continue;
      contact::Contact& contact = set.contacts[set.count++];
      contact.id = static_cast<std::uint32_t>(i);
      contact.p_WC_W = p;
      contact.nhat_ST_W = {0, 0, 1};
      contact.depth_m = depth_m;
      const glm::dvec3 by_translation{-amplitude_m * wave * std::sin(wave * p.x), 0, -1};
      contact.gradient = spatial::to_vector6(spatial::Twist{glm::cross(p - X_WT.p, by_translation), by_translation});
      contact.lateral_range_m = amplitude_m > 0 ? period_m / 8 : 1;
      contact.material = material;
    }
    set.pairs_near = set.count;
    return set;
  }
};

class AnalyticRemote final : public master_station::Remote {
 public:
  AnalyticWorld world;
  std::int64_t answer_period_ns = 1'000'000;
  bool is_silent = false;                    ///< poses and answers are lost
  std::deque<motion::ObjectCourse> courses;  ///< that have come
  std::function<void(contact::ContactSet&)>
      on_answer;  ///< may spoil an answer; std::function itself never allocates here

  /// From now on poses and answers go over such a link.
  void set_link(const transport::LinkSpec& spec, std::uint64_t seed = 1) {
    up_ = {spec, 2 * seed};
    down_ = {spec, 2 * seed + 1};
  }
  bool take_course(motion::ObjectCourse& next) noexcept override {
    if (courses.empty()) return false;
    next = courses.front();
    courses.pop_front();
    return true;
  }
  void send(const master_station::ToolState& state) noexcept override {
    now_ns_ = state.time_ns;
    sent = state;
    if (now_ns_ < next_answer_ns_) return;
    next_answer_ns_ = now_ns_ + answer_period_ns;
    if (is_silent) return;
    contact::ContactSet set = world.contacts(state.X_WT);
    set.pose_sequence = state.sequence;
    set.pose_time_ns = state.time_ns;
    if (on_answer) on_answer(set);
    constexpr std::size_t kBytes = 200;  // of either message, about
    for (const std::int64_t there_ns : up_.releases(now_ns_, kBytes)) {
      for (const std::int64_t due_ns : down_.releases(there_ns, kBytes)) {
        const auto before = std::upper_bound(under_way_.begin(), under_way_.end(), due_ns,
                                             [](std::int64_t t, const UnderWay& other) { return t < other.due_ns; });
        under_way_.insert(before, {due_ns, set});
      }
    }
  }
  bool poll(contact::ContactSet& newest) noexcept override {
    bool has_any = false;
    while (!under_way_.empty() && under_way_.front().due_ns <= now_ns_) {
      newest = under_way_.front().set;
      under_way_.pop_front();
      has_any = !is_silent;
    }
    return has_any;
  }

  master_station::ToolState sent;

 private:
  struct UnderWay {
    std::int64_t due_ns;
    contact::ContactSet set;
  };
  transport::Impairment up_{{}, 0}, down_{{}, 0};
  std::deque<UnderWay> under_way_;
  std::int64_t now_ns_ = 0, next_answer_ns_ = 0;
};

}  // namespace farfeel::test_support
