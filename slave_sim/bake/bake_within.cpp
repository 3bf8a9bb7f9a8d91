// The deviation falls with the number of triangles n about as n^-p, and the near pairs grow with it: from what was
// tried last, and the slope between two trials, follows what to try next, and what the error would take where the
// loop's bound rules. What texels lose is told apart from what triangles do, and then the texture doubles instead. Then
// smaller textures. All that is for a part of the error; at last heights follow from a mesh that takes the rest.
#include "slave_sim/bake/bake_within.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "slave_sim/bake/detail.h"
#include "slave_sim/bake/edge_collapse.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::uint32_t kFirstTriangles = 700, kFewestTriangles = 32, kMostTriangles = 5'600;
constexpr std::uint32_t kFirstTexture = 1024, kLeastTexture = 64;
/// Of what every trial simplifies: some hundred times what it leaves.
constexpr std::uint32_t kMostToSimplify = 200'000;
/// Of the error that is asked for: what triangles and texels are to take, and what they may where that is not met. The
/// squares of what they and the detail are off by add up.
constexpr double kShare = 0.6, kEnough = 0.8;
constexpr int kMostDetails = 5;
constexpr std::uint32_t kFirstDetail = 5;  // times as many triangles as the coarse mesh has
constexpr double kDetailStep = 1.15;       // times as many: not worth a further trial
constexpr double kLeastOwn = 0.01;         // of the error's square: less is not told from chance
constexpr double kSpareOfDetail = 0.97;    // of what is left to it: where to aim
constexpr double kBeyond = 1.05;           // of what is off already, where that is more than was asked for
constexpr double kLost = 0.7;  // of the error that is asked for: when texels alone lose that, triangles do not help
constexpr double kNearEnough = 1.33;                // times as many triangles: not worth a further trial
constexpr double kLeastStep = 1.15, kMostStep = 4;  // times as many, from one trial to the next
constexpr double kSpare = 0.9;                      // of a bound: where to aim
constexpr double kSlope = 1, kLeastSlope = 0.25,
                 kMostSlope = 2;   // p, where one trial says nothing of it yet; its limits
constexpr double kNone_m = 1e-12;  // less than any deviation that is found

struct Trial {
  std::uint32_t triangles, texture;  ///< as asked for
  std::uint32_t coarse_triangles, pairs;
  double rms_m;
  [[nodiscard]] std::string words() const {
    return fmt::format("{:.3g} um rms with {} coarse triangles and texture {}, {} near pairs", 1e6 * rms_m,
                       coarse_triangles, texture, pairs);
  }
};

class Search {
 public:
  Search(const std::string& name, const geometry::TriangleMesh& full, BakeOptions options, double rms_m,
         const Progress& progress, std::uint32_t most_near_pairs, std::uint32_t most_texture)
      : name_(name),
        full_(full),
        options_(std::move(options)),
        asked_m_(rms_m),
        rms_m_(kShare * rms_m),
        progress_(progress),
        most_near_pairs_(most_near_pairs),
        most_texture_(most_texture),
        most_triangles_(std::min(kMostTriangles, static_cast<std::uint32_t>(full.triangles.size()))) {
    options_.height_step_m = rms_m / kHeightSteps;
  }

  tl::expected<BakedWithin, BakeError> run() {
    if (full_.triangles.size() > kMostToSimplify) {
      if (progress_) progress_("fewer triangles", 0);
      options_.to_simplify = edges_swept(full_, kMostToSimplify);
    }
    std::uint32_t texture = std::min(kFirstTexture, most_texture_);
    constexpr int kForTexture = 2;
    for (std::optional<std::uint32_t> next = std::min(kFirstTriangles, most_triangles_);
         next && trials_.size() < kMostTrials - kForTexture; next = next_triangles()) {
      if (!bake(*next, texture)) return tl::unexpected(error_);
      while (!met(trials_.back()) && is_texture_short_ && texture < most_texture_ && is_carried(trials_.back()) &&
             trials_.size() < kMostTrials - kForTexture) {
        texture *= 2;
        if (!bake(*next, texture)) return tl::unexpected(error_);
      }
    }
    if (!shrink_texture()) return tl::unexpected(error_);
    take_detail();
    return chosen();
  }

 private:
  [[nodiscard]] bool met(const Trial& trial) const { return trial.rms_m <= rms_m_; }
  [[nodiscard]] bool is_carried(const Trial& trial) const { return trial.pairs <= most_near_pairs_; }

  [[nodiscard]] bool is_better(const Trial& one, const Trial& other) const {
    if (is_carried(one) != is_carried(other)) return is_carried(one);
    if (!is_carried(one)) return std::pair(one.pairs, one.rms_m) < std::pair(other.pairs, other.rms_m);
    if (met(one) != met(other)) return met(one);
    if (!met(one)) {  // what leaves enough to a detail may have fewer triangles
      const double enough_m = kEnough * asked_m_;
      return std::pair(std::max(one.rms_m, enough_m), one.triangles) <
             std::pair(std::max(other.rms_m, enough_m), other.triangles);
    }
    return std::pair(one.triangles, one.texture) < std::pair(other.triangles, other.texture);
  }

  /// Keeps what was baked only while it is the best: trials are large.
  [[nodiscard]] bool bake(std::uint32_t triangles, std::uint32_t texture) {
    options_.coarse_triangles = triangles, options_.texture = texture;
    const double before = static_cast<double>(trials_.size()) / kMostTrials;
    auto baked = bake_asset(name_, full_, options_, [&](const std::string& stage, double done) {
      if (progress_) progress_(fmt::format("bake {}: {}", trials_.size() + 1, stage), before + done / kMostTrials);
    });
    if (!baked) {
      error_ = baked.error();
      return false;
    }
    const BakeReport& report = baked->report;
    const Trial trial{.triangles = triangles,
                      .texture = texture,
                      .coarse_triangles = report.coarse_triangles,
                      .pairs = report.near_pairs_p95,
                      .rms_m = rms_of(report)};
    is_texture_short_ = report.relief_rms_m * std::sqrt(report.lost_share) > kLost * rms_m_;
    if (trials_.empty() || is_better(trial, best_)) best_ = trial, best_baked_ = *std::move(baked);
    trials_.push_back(trial);
    return true;
  }

  /// By quarters, and where one is too few by a half.
  [[nodiscard]] bool shrink_texture() {
    std::uint32_t times = 4;
    for (bool is_last = false; !is_last && trials_.size() < kMostTrials;) {
      if (!met(best_) || !is_carried(best_) || best_.texture / times < kLeastTexture) return true;
      if (!bake(best_.triangles, best_.texture / times)) return false;
      is_last = times == 2;
      if (!met(trials_.back()) || !is_carried(trials_.back())) times = 2;
    }
    return true;
  }

  /// The fewest triangles that heights may follow from, if that takes fewer bytes. What such a mesh is off by falls
  /// with the number of its triangles.
  void take_detail() {
    const double base_m = best_.rms_m, most_m = std::max(asked_m_, kBeyond * base_m);
    const Details details(best_baked_, full_, options_);
    std::optional<Baked> least;
    double enough = std::numeric_limits<double>::infinity(), few = 0;
    double next = kFirstDetail * static_cast<double>(best_.coarse_triangles);
    for (int tried = 0; tried < kMostDetails && enough > kDetailStep * few; ++tried) {
      const auto triangles = static_cast<std::uint32_t>(std::min<double>(next, details.most_triangles()));
      if (triangles <= few) break;
      if (progress_) progress_(fmt::format("detail {}", tried + 1), static_cast<double>(trials_.size()) / kMostTrials);
      auto with = details.with(triangles, most_m);
      if (!with) break;
      const double rms_m = rms_of(with->report);
      const double own_m = std::sqrt(std::max(rms_m * rms_m - base_m * base_m, kLeastOwn * most_m * most_m));
      if (rms_m <= most_m) {
        enough = triangles, least = std::move(with);
      } else {
        few = triangles;
      }
      const double aim = triangles * own_m / (kSpareOfDetail * std::sqrt(most_m * most_m - base_m * base_m));
      next = std::isfinite(enough)
                 ? std::clamp(aim, std::max(few * kDetailStep, enough / kMostStep), enough / kDetailStep)
                 : std::max(aim, few * kDetailStep);
    }
    if (!least || felt_bytes(least->asset) >= felt_bytes(best_baked_.asset)) return;
    best_.rms_m = rms_of(least->report);
    best_baked_ = *std::move(least);
  }
  static double rms_of(const BakeReport& report) {
    return std::max(report.full_to_felt.rms_m, report.felt_to_full.rms_m);
  }

  /// Of those tried with the newest texture that the rule takes, the one with the most triangles, or with the fewest;
  /// null if there is none.
  template <typename Takes>
  [[nodiscard]] const Trial* most_of(const Takes& takes) const {
    return extreme_of(takes, [](const Trial& t, const Trial& than) { return t.triangles > than.triangles; });
  }
  template <typename Takes>
  [[nodiscard]] const Trial* fewest_of(const Takes& takes) const {
    return extreme_of(takes, [](const Trial& t, const Trial& than) { return t.triangles < than.triangles; });
  }
  template <typename Takes, typename IsMore>
  [[nodiscard]] const Trial* extreme_of(const Takes& takes, const IsMore& is_more) const {
    const Trial* found = nullptr;
    for (const Trial& t : trials_) {
      if (t.texture == trials_.back().texture && takes(t) && (found == nullptr || is_more(t, *found))) found = &t;
    }
    return found;
  }

  /// By how the deviation fell between the trials with the fewest and the most triangles.
  [[nodiscard]] double triangles_for_error() const {
    const auto any = [](const Trial&) { return true; };
    const Trial &few = *fewest_of(any), &many = *most_of(any);
    const auto times = [](double one, double other) {
      return std::log(std::max(one, kNone_m) / std::max(other, kNone_m));
    };
    double slope = kSlope;
    if (many.triangles > few.triangles)
      slope = std::clamp(times(few.rms_m, many.rms_m) / std::log(1.0 * many.triangles / few.triangles), kLeastSlope,
                         kMostSlope);
    const Trial& near = std::abs(times(few.rms_m, rms_m_)) < std::abs(times(many.rms_m, rms_m_)) ? few : many;
    return near.triangles * std::exp(times(near.rms_m, kSpare * rms_m_) / slope);
  }
  [[nodiscard]] double triangles_for_pairs() const {
    const Trial& last = trials_.back();
    return kSpare * most_near_pairs_ / std::max(1U, last.pairs) * last.triangles;
  }

  /// What to try next, between the most that are too few and the fewest that are enough, or more than the loop carries;
  /// nothing where that would hardly be better.
  [[nodiscard]] std::optional<std::uint32_t> next_triangles() const {
    const Trial* few = most_of([this](const Trial& t) { return !met(t) && is_carried(t); });
    const Trial* many = fewest_of([this](const Trial& t) { return met(t); });
    const Trial* beyond = fewest_of([this](const Trial& t) { return !is_carried(t); });
    const bool is_bound = beyond != nullptr && (many == nullptr || !is_carried(*many));
    if (is_bound) many = beyond;
    if (few != nullptr && many != nullptr && many->triangles <= kNearEnough * few->triangles) return std::nullopt;
    const double least = few != nullptr ? kLeastStep * few->triangles : many->triangles / kMostStep;
    const double most = many != nullptr ? many->triangles / kLeastStep : kMostStep * few->triangles;
    const double low = std::max<double>(kFewestTriangles, least), high = std::min<double>(most_triangles_, most);
    if (many == nullptr && few->triangles < most_triangles_ && low > high) return most_triangles_;
    if (low > high) return std::nullopt;
    const double aim = is_bound ? triangles_for_pairs() : std::min(triangles_for_error(), triangles_for_pairs());
    return static_cast<std::uint32_t>(std::lround(std::clamp(aim, low, high)));
  }

  [[nodiscard]] BakedWithin chosen() {
    std::string verdict = fmt::format("{:.3g} um rms asked: {} (p95; the loop carries {})", 1e6 * asked_m_,
                                      best_.words(), most_near_pairs_);
    if (const std::size_t triangles = best_baked_.asset.detail.mesh.triangles.size(); triangles > 0)
      verdict += fmt::format("; heights follow from {} triangles", triangles);
    const bool is_met = best_.rms_m <= asked_m_;
    const Trial* meets = nullptr;
    for (const Trial& t : trials_) {
      if (met(t) && (meets == nullptr || t.pairs < meets->pairs)) meets = &t;
    }
    const bool is_bound =
        std::any_of(trials_.begin(), trials_.end(), [this](const Trial& t) { return !is_carried(t); });
    if (!is_met && meets != nullptr) {
      verdict += "; the loop's bound ruled, the error would take " + meets->words();
    } else if (!is_met && is_bound) {
      const double triangles = triangles_for_error();
      verdict += fmt::format(
          "; the loop's bound ruled, the error would take about {:.2g} coarse triangles and {:.2g} near pairs, by how "
          "both went so far",
          triangles, triangles * trials_.back().pairs / trials_.back().triangles);
    } else if (!is_met) {
      verdict += fmt::format(
          "; nothing up to {} triangles meets the error: the mesh is rougher than texels keep, or parts of it are left "
          "out",
          std::max_element(trials_.begin(), trials_.end(), [](const Trial& a, const Trial& b) {
            return a.triangles < b.triangles;
          })->triangles);
    }
    return {std::move(best_baked_), std::move(verdict), is_met};
  }

  const std::string& name_;
  const geometry::TriangleMesh& full_;
  BakeOptions options_;
  double asked_m_, rms_m_;  ///< what was asked for, and what triangles and texels are chosen for
  const Progress& progress_;
  std::uint32_t most_near_pairs_, most_texture_, most_triangles_;
  std::vector<Trial> trials_;
  Trial best_{};
  Baked best_baked_;
  bool is_texture_short_ = false;  ///< of the last trial
  BakeError error_;
};

}  // namespace

double error_unasked_m(const geometry::TriangleMesh& mesh) {
  return kErrorShare * glm::length(geometry::bounding_box(mesh).size());
}

tl::expected<BakedWithin, BakeError> bake_within(const std::string& name, const geometry::TriangleMesh& full,
                                                 BakeOptions options, double rms_m, const Progress& progress,
                                                 std::uint32_t most_near_pairs, std::uint32_t most_texture) {
  return Search(name, full, std::move(options), rms_m, progress, most_near_pairs, most_texture).run();
}

}  // namespace farfeel::slave_sim
