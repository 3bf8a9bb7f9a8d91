#include "tests/bench/penetration_slid.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "haptic_core/contact/depth/contact_frame.h"
#include "haptic_core/penetration/simd/simd.h"
#include "tests/support/plate_patterns.h"
#include "tests/support/plate_truth.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using nlohmann::json;
using penetration::BackEnd;
using penetration::Penetration;
using penetration::Query;
using spatial::Pose;
using support::PlatePattern;
using support::PlateTruth;

constexpr penetration::Limits kLimits{.coarse_triangles = 16};
constexpr double kLeastOverlap_m = 60e-6, kMostOverlap_m = 300e-6;
constexpr int kSlidAnswers = 60, kFineSteps = 20;
constexpr double kSlidStep_m = 2e-6, kFineStep_m = 1e-6;
constexpr double kStiffness_N_per_m = 4000;  // of the steps
/// An answer is right that is off by no more than the greater of the two.
constexpr double kRight_m = 0.5e-6, kRightShare = 0.005;

bool is_right(double depth_m, double truth_m) {
  return std::abs(depth_m - truth_m) <= std::max(kRight_m, kRightShare * std::abs(truth_m));
}

bool is_flagged(const Penetration& answer) {
  return (answer.doubts & penetration::kCoarseSteps) != 0;
}

glm::dvec3 force_N(const Penetration& answer) {
  return -kStiffness_N_per_m * std::max(answer.depth_m, 0.0) *
         glm::dvec3{answer.gradient[3], answer.gradient[4], answer.gradient[5]};
}

/// S lies with its normal along z, as a cluster of a contact would say.
Pose frame_over_plate() {
  contact::Cluster cluster{};
  cluster.nhat_ST_S = {0, 0, 1};
  return spatial::inverse(contact::contact_frame(cluster));
}

/// A pose, and the way by which T comes to it.
struct Place {
  Pose X_ST;
  glm::dvec3 along_S;
};

std::vector<Place> places_of(const PlatePattern& pattern, const PlateTruth& truth, const SlidOptions& options) {
  std::mt19937 random(options.seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Place> places;
  for (std::size_t i = 0; i < options.poses; ++i) {
    Pose X_ST = pattern.random_pose(random);
    const double wanted_m = kLeastOverlap_m + (kMostOverlap_m - kLeastOverlap_m) * share(random);
    X_ST.p.z += truth.hard_depth_m(X_ST) - wanted_m;
    const double way = 2 * M_PI * share(random);
    places.push_back({X_ST, {std::cos(way), std::sin(way), 0}});
  }
  return places;
}

/// What is said of one pattern at one width and N.
struct Seen {
  std::vector<double> error_um, apart_um, us;
  std::size_t pair_unflagged = 0, truth_unflagged = 0, right = 0, flagged_right = 0, flagged = 0;
  double step_N = 0, force_error = 0;

  void compare(const Penetration& answer, const PlateTruth::Soft& truth) {
    error_um.push_back(1e6 * std::abs(answer.depth_m - truth.depth_m));
    const bool is_off = !is_right(answer.depth_m, truth.depth_m);
    right += is_off ? 0 : 1;
    flagged += is_flagged(answer) ? 1 : 0;
    flagged_right += !is_off && is_flagged(answer) ? 1 : 0;
    truth_unflagged += is_off && !is_flagged(answer) ? 1 : 0;
  }
};

class Slider {
 public:
  Slider(const PlatePattern& pattern, double width_m, std::uint32_t samples)
      : pattern_(pattern), width_m_(width_m), samples_(samples), simd_(make_simd(kLimits)) {
    pattern.prepare(*simd_);
  }

  void slide(const Place& place, const PlateTruth::Soft& truth, Seen& seen) {
    const Penetration fresh = ask(place.X_ST, ++contact_);
    ++contact_;
    Penetration slid;
    for (int k = kSlidAnswers; k >= 0; --k) {
      const auto start = std::chrono::steady_clock::now();
      slid = ask(moved(place, -k * kSlidStep_m), contact_);
      if (k < kSlidAnswers) {
        seen.us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
      }
    }
    seen.compare(fresh, truth), seen.compare(slid, truth);
    seen.apart_um.push_back(1e6 * std::abs(slid.depth_m - fresh.depth_m));
    seen.pair_unflagged += !is_right(slid.depth_m, fresh.depth_m) && !is_flagged(slid) && !is_flagged(fresh) ? 1 : 0;
    const glm::dvec3 true_N = -kStiffness_N_per_m * truth.depth_m * truth.gradient_S;
    seen.force_error = std::max(seen.force_error, glm::distance(in_S(force_N(fresh)), true_N) / glm::length(true_N));
    glm::dvec3 last_N = force_N(slid);
    for (int k = 1; k <= kFineSteps; ++k) {
      const glm::dvec3 now_N = force_N(ask(moved(place, k * kFineStep_m), contact_));
      seen.step_N = std::max(seen.step_N, glm::distance(now_N, last_N));
      last_N = now_N;
    }
  }

 private:
  [[nodiscard]] static Pose moved(const Place& place, double way_m) {
    return {place.X_ST.R, place.X_ST.p + way_m * place.along_S};
  }
  [[nodiscard]] glm::dvec3 in_S(const glm::dvec3& v_C) const { return spatial::rotate_back(X_CS_, v_C); }
  [[nodiscard]] Penetration ask(const Pose& X_ST, std::uint32_t contact) const {
    Query query = pattern_.query(X_CS_, X_ST, width_m_, samples_);
    query.contact = contact;
    Penetration answer;
    simd_->evaluate({&query, 1}, {&answer, 1});
    return answer;
  }

  const PlatePattern& pattern_;
  double width_m_;
  std::uint32_t samples_;
  std::unique_ptr<BackEnd> simd_;
  Pose X_CS_ = frame_over_plate();
  std::uint32_t contact_ = 0;
};

json row_of(const std::string& name, double width_m, std::uint32_t samples, const Seen& seen) {
  const double right = static_cast<double>(std::max<std::size_t>(seen.right, 1));
  return {{"pattern", name},
          {"width_um", 1e6 * width_m},
          {"n", samples},
          {"answers", seen.error_um.size()},
          {"right", seen.right},
          {"flagged", seen.flagged},
          {"depth_err_um", {{"p50", quantile(seen.error_um, 0.5)}, {"p99", quantile(seen.error_um, 0.99)}}},
          {"force_err_max", seen.force_error},
          {"slid_minus_fresh_um", {{"p99", quantile(seen.apart_um, 0.99)}}},
          {"pair_unflagged", seen.pair_unflagged},
          {"truth_unflagged", seen.truth_unflagged},
          {"flagged_right", static_cast<double>(seen.flagged_right) / right},
          {"step_N_max", seen.step_N},
          {"us", {{"p50", quantile(seen.us, 0.5)}, {"p99", quantile(seen.us, 0.99)}}}};
}

void print(const json& row) {
  fmt::print(
      "{:16} w {:3.0f} um, N {:3}: off {:7.3f} um (worst), force {:6.2f} %, slid from fresh {:7.3f} um; unflagged {} "
      "pairs, {} answers; {} of {} flagged; {:.3f} N in 1 um; {:.0f} us (p99 {:.0f})\n",
      row["pattern"].get<std::string>(), row["width_um"].get<double>(), row["n"].get<int>(),
      row["depth_err_um"]["p99"].get<double>(), 100 * row["force_err_max"].get<double>(),
      row["slid_minus_fresh_um"]["p99"].get<double>(), row["pair_unflagged"].get<int>(),
      row["truth_unflagged"].get<int>(), row["flagged"].get<int>(), row["answers"].get<int>(),
      row["step_N_max"].get<double>(), row["us"]["p50"].get<double>(), row["us"]["p99"].get<double>());
}

}  // namespace

json slid_rows(const SlidOptions& options) {
  json rows = json::array();
  std::size_t answers = 0, right = 0, flagged_right = 0, pairs = 0, unflagged = 0;
  double step_N = 0;
  for (const std::string& name : options.patterns.empty() ? support::plate_pattern_names() : options.patterns) {
    const std::unique_ptr<PlatePattern> pattern = support::plate_pattern(name);
    const PlateTruth truth(pattern->s(), pattern->t());
    const std::vector<Place> places = places_of(*pattern, truth, options);
    for (const double width_m : options.widths_m) {
      std::vector<PlateTruth::Soft> truths;
      for (const Place& place : places) truths.push_back(truth.soft(place.X_ST, width_m));
      for (const std::uint32_t n : options.samples) {
        Slider slider(*pattern, width_m, n);
        Seen seen;
        for (std::size_t i = 0; i < places.size(); ++i) slider.slide(places[i], truths[i], seen);
        rows.push_back(row_of(name, width_m, n, seen));
        print(rows.back());
        answers += seen.error_um.size(), right += seen.right, flagged_right += seen.flagged_right;
        pairs += seen.pair_unflagged, unflagged += seen.truth_unflagged;
        step_N = std::max(step_N, seen.step_N);
      }
    }
  }
  fmt::print(
      "{} answers on hard patterns: {} pairs and {} answers off without a flag, {:.0f} % of the right ones "
      "flagged, at most {:.3f} N in 1 um at {:.0f} N/mm\n",
      answers, pairs, unflagged,
      100.0 * static_cast<double>(flagged_right) / std::max<double>(1, static_cast<double>(right)), step_N,
      1e-3 * kStiffness_N_per_m);
  return rows;
}

}  // namespace farfeel::bench
