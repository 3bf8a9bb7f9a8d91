#include "tests/bench/figure_runs.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::bench {
namespace {

using contact::ContactSet;
using contact_service::ContactService;
using spatial::Pose;

/// Between two frames of 1 ms. In a valley a tool leans on two flanks in turn, and what turns the force from one to the
/// other, depth times the depth's second derivative, is explicit here: longer steps chatter. At eight of them force and
/// lag correlate by 0.88 instead of 0.95.
constexpr int kSteps = 16;
constexpr double kStep_s = 1e-3 / kSteps;
constexpr double kMass_kg = 0.01, kDamping_Ns_per_m = 3;  // creeps from valley to valley instead of flying
constexpr double kPull_N_per_m = 500;  ///< soft beside the contact, so that the tool catches and slips

ContactService service_of(const Laid& laid) {
  const contact::Material smooth{
      .stiffness_N_per_m = laid.stiffness_N_per_m, .static_friction = 0, .dynamic_friction = 0};
  const contact_service::TouchableObject object{.felt = laid.s, .material = smooth, .X_WO = {}};
  return {{&object, 1}, {.felt = laid.t, .material = smooth, .X_WO = {}}, {.tolerance_m = laid.tolerance_m}};
}

/// The tool's translation by implicit steps: the springs' and contacts' stiffness along g counts at the step's end.
class Slider {
 public:
  Slider(const Laid& laid, const glm::dvec3& free) : service_(service_of(laid)), free_(free), pose_{laid.R_WT, {}} {
    pose_.p = laid.above_W;
  }

  const ContactSet& answer() noexcept {
    return service_.answer({.sequence = step_,
                            .time_ns = static_cast<std::int64_t>(1'000'000 / kSteps) * step_,
                            .X_WT = pose_,
                            .V_WT_W = {.angular_rad_s = {0, 0, 0}, .linear_m_s = v_}});
  }
  /// force_N: of hand and weight, with this stiffness of its own.
  void step(const ContactSet& set, const glm::dvec3& force_N, double stiffness_N_per_m) noexcept {
    Eigen::Matrix3d A =
        (kMass_kg / kStep_s + kDamping_Ns_per_m + kStep_s * stiffness_N_per_m) * Eigen::Matrix3d::Identity();
    for (std::uint32_t i = 0; i < set.count; ++i) {
      if (!(set.contacts[i].depth_m > 0)) continue;
      const Eigen::Vector3d g = set.contacts[i].gradient.tail<3>();
      A += kStep_s * set.contacts[i].material.stiffness_N_per_m * g * g.transpose();
    }
    const glm::dvec3 push = force_N + set.F_To_W.force_N + (kMass_kg / kStep_s) * v_;
    Eigen::Vector3d b = spatial::to_eigen(push);
    for (int k = 0; k < 3; ++k) {
      if (free_[k] > 0) continue;
      A.row(k).setZero(), A.col(k).setZero();
      A(k, k) = 1, b[k] = 0;
    }
    v_ = spatial::to_glm(A.inverse() * b);
    pose_.p += kStep_s * v_;
    ++step_;
  }
  Pose& pose() { return pose_; }
  [[nodiscard]] const glm::dvec3& velocity_m_s() const { return v_; }

  /// Lowers the tool until it rests.
  void settle(const glm::dvec3& force_N, double stiffness_N_per_m) noexcept {
    const glm::dvec3 start = pose_.p;
    for (int i = 0; i < 600; ++i) {
      glm::dvec3 pull = -stiffness_N_per_m * (pose_.p - start);
      pull.z = 0;
      step(answer(), force_N + pull, stiffness_N_per_m);
    }
  }

 private:
  ContactService service_;
  glm::dvec3 free_;
  Pose pose_;
  glm::dvec3 v_{0};
  std::uint32_t step_ = 0;
};

}  // namespace

std::vector<Stroke> stroke_over_ridges(const Laid& laid, double length_m, double press_N, std::size_t frames) {
  Slider tool(laid, {1, 1, 1});
  const glm::dvec3 weight{0, 0, -press_N};
  tool.settle(weight, kPull_N_per_m);
  const glm::dvec3 start = tool.pose().p;
  std::vector<Stroke> strokes;
  for (std::size_t i = 0; i < frames * kSteps; ++i) {
    const double hand_m = length_m * static_cast<double>(i) / static_cast<double>(frames * kSteps);
    const ContactSet& set = tool.answer();
    const glm::dvec3 p = tool.pose().p - start;
    if (i % kSteps == 0) strokes.push_back({hand_m, p.x, p.z, 0, 0});
    strokes.back().across_N += set.F_To_W.force_N.x / kSteps;
    strokes.back().along_N += set.F_To_W.force_N.y / kSteps;
    const glm::dvec3 pull = kPull_N_per_m * (glm::dvec3{hand_m, 0, 0} - glm::dvec3{p.x, p.y, 0});
    tool.step(set, weight + pull, kPull_N_per_m);
  }
  return strokes;
}

std::vector<Twist> twist_interlocked(const Laid& laid, double most_rad, int twists, double press_N,
                                     std::size_t frames) {
  Slider tool(laid, {0, 0, 1});
  const glm::dvec3 weight{0, 0, -press_N};
  tool.settle(weight, 0);
  const double start_m = tool.pose().p.z;
  std::vector<Twist> made;
  for (std::size_t i = 0; i < frames * kSteps; ++i) {
    const double phase = twists * static_cast<double>(i) / static_cast<double>(frames * kSteps);
    const double angle = most_rad * std::sin(2 * std::numbers::pi * phase);
    tool.pose().R = spatial::rotation_from_vector({0, 0, angle}) * laid.R_WT;
    const ContactSet& set = tool.answer();
    if (i % kSteps == 0) made.push_back({angle, tool.pose().p.z - start_m, set.F_To_W.torque_Nm.z});
    tool.step(set, weight, 0);
  }
  return made;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  double mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) mean_a += a[i] / n, mean_b += b[i] / n;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - mean_a) * (a[i] - mean_a), bb += (b[i] - mean_b) * (b[i] - mean_b);
    ab += (a[i] - mean_a) * (b[i] - mean_b);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

StrokeFacts facts_of(const std::vector<Stroke>& strokes) {
  double across = 0, along = 0;
  std::vector<double> force, lag;
  int stairs = 0;
  bool was_slipping = false;
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    across += strokes[i].across_N * strokes[i].across_N, along += strokes[i].along_N * strokes[i].along_N;
    force.push_back(-strokes[i].across_N);
    lag.push_back(strokes[i].hand_m - strokes[i].tool_m);
    if (i < 10) continue;
    const double moved = strokes[i].tool_m - strokes[i - 10].tool_m, hand = strokes[i].hand_m - strokes[i - 10].hand_m;
    const bool is_slipping = moved > 2 * hand;
    stairs += is_slipping && !was_slipping;
    was_slipping = is_slipping;
  }
  return {std::sqrt(along / across), correlation(force, lag), stairs};
}

TwistFacts facts_of(const std::vector<Twist>& made, int twists) {
  const auto greatest = [](const auto& list, auto value) {
    double most = 0;
    for (const auto& item : list) most = std::max(most, value(item));
    return most;
  };
  const double most_rad = greatest(made, [](const Twist& t) { return std::abs(t.angle_rad); });
  const double most_m = greatest(made, [](const Twist& t) { return t.height_m; });
  std::vector<double> rises(2 * static_cast<std::size_t>(twists), 0);
  double twisted = 0, opposed = 0;
  for (std::size_t i = 0; i < made.size(); ++i) {
    double& rise = rises[i * rises.size() / made.size()];  // each half of a period is one twist
    rise = std::max(rise, made[i].height_m);
    if (std::abs(made[i].angle_rad) < 0.1 * most_rad) continue;
    twisted += 1;
    opposed += made[i].angle_rad * made[i].torque_Nm < 0;
  }
  TwistFacts facts{0, twisted > 0 ? opposed / twisted : 0, 0};
  for (const double rise : rises) {
    facts.rises += (rise > 0.1 * most_m) / static_cast<double>(rises.size());
    facts.rise_m += rise / static_cast<double>(rises.size());
  }
  return facts;
}

}  // namespace farfeel::bench
