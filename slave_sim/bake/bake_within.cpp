// Triangles double from few on until the error is met; what texels lose is told apart from what triangles do, and then
// the texture doubles instead. Between the last that failed and the first that did not, two steps by halves; at last
// smaller textures.
#include "slave_sim/bake/bake_within.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace farfeel::slave_sim {
namespace {

constexpr std::uint32_t kFirstTriangles = 350, kMostTriangles = 22'400;
constexpr std::uint32_t kFirstTexture = 1024, kLeastTexture = 256, kMostTexture = 4096;
constexpr double kLost = 0.7;  // of the error that is asked for: when texels alone lose that, triangles do not help
constexpr int kHalvings = 2;

struct Trial {
  std::uint32_t triangles, texture;  ///< as asked for
  Baked baked;
  [[nodiscard]] double rms_m() const {
    return std::max(baked.report.full_to_felt.rms_m, baked.report.felt_to_full.rms_m);
  }
  [[nodiscard]] std::uint32_t pairs() const { return baked.report.near_pairs_p95; }
  [[nodiscard]] std::string words() const {
    return fmt::format("{:.3g} um rms with {} coarse triangles and texture {}, {} near pairs", 1e6 * rms_m(),
                       baked.report.coarse_triangles, texture, pairs());
  }
};

class Search {
 public:
  Search(const std::string& name, const geometry::TriangleMesh& full, BakeOptions options, double rms_m,
         const Progress& progress, std::uint32_t most_near_pairs)
      : name_(name),
        full_(full),
        options_(std::move(options)),
        rms_m_(rms_m),
        progress_(progress),
        most_near_pairs_(most_near_pairs) {}

  tl::expected<BakedWithin, BakeError> run() {
    if (!double_until_met()) return tl::unexpected(error_);
    const bool is_met = met(trials_[last_]);
    if (is_met && is_carried(trials_[last_])) {
      if (!halve([this](const Trial& trial) { return met(trial); }) || !shrink_texture()) return tl::unexpected(error_);
    } else if (!is_carried(trials_[last_])) {
      if (!halve([this](const Trial& trial) { return !is_carried(trial); })) return tl::unexpected(error_);
    }
    return chosen();
  }

 private:
  [[nodiscard]] bool met(const Trial& trial) const { return trial.rms_m() <= rms_m_; }
  [[nodiscard]] bool is_carried(const Trial& trial) const { return trial.pairs() <= most_near_pairs_; }

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
    trials_.push_back({triangles, texture, *std::move(baked)});
    return true;
  }

  [[nodiscard]] bool double_until_met() {
    const auto most = std::min(kMostTriangles, static_cast<std::uint32_t>(full_.triangles.size()));
    std::uint32_t triangles = std::min(kFirstTriangles, most), texture = kFirstTexture;
    while (true) {
      if (!bake(triangles, texture)) return false;
      last_ = trials_.size() - 1;
      const BakeReport& report = trials_[last_].baked.report;
      if (met(trials_[last_])) return true;
      const bool is_texture_short =
          texture < kMostTexture && report.relief_rms_m * std::sqrt(report.lost_share) > kLost * rms_m_;
      if (!is_texture_short && triangles >= most) return true;
      before_ = is_texture_short ? before_ : triangles;
      if (is_texture_short) {
        texture *= 2;
      } else {
        triangles = std::min(2 * triangles, most);
      }
    }
  }

  /// Between the number of triangles before the last doubling and the last, to the fewest that the rule takes.
  template <typename Takes>
  [[nodiscard]] bool halve(const Takes& takes) {
    for (int step = 0; step < kHalvings && before_ > 0; ++step) {
      const auto middle =
          static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(before_) * trials_[last_].triangles)));
      if (!bake(middle, trials_[last_].texture)) return false;
      if (takes(trials_.back())) {
        last_ = trials_.size() - 1;
      } else {
        before_ = middle;
      }
    }
    return true;
  }

  [[nodiscard]] bool shrink_texture() {
    while (trials_[last_].texture > kLeastTexture) {
      if (!bake(trials_[last_].triangles, trials_[last_].texture / 2)) return false;
      if (!met(trials_.back()) || !is_carried(trials_.back())) return true;
      last_ = trials_.size() - 1;
    }
    return true;
  }

  [[nodiscard]] BakedWithin chosen() {
    const auto is_better = [this](const Trial& one, const Trial& other) {
      if (is_carried(one) != is_carried(other)) return is_carried(one);
      if (!is_carried(one)) return std::pair(one.pairs(), one.rms_m()) < std::pair(other.pairs(), other.rms_m());
      if (met(one) != met(other)) return met(one);
      if (!met(one)) return one.rms_m() < other.rms_m();
      return std::pair(one.triangles, one.texture) < std::pair(other.triangles, other.texture);
    };
    Trial& best = *std::min_element(trials_.begin(), trials_.end(), is_better);
    std::string verdict =
        fmt::format("{:.3g} um rms asked: {} (p95; the loop carries {})", 1e6 * rms_m_, best.words(), most_near_pairs_);
    const auto meets = std::min_element(trials_.begin(), trials_.end(), [this](const Trial& one, const Trial& other) {
      return met(one) != met(other) ? met(one) : one.pairs() < other.pairs();
    });
    if (!met(best) && met(*meets)) {
      verdict += "; the loop's bound ruled, the error would take " + meets->words();
    } else if (!met(best)) {
      verdict += fmt::format(
          "; nothing up to {} triangles meets the error: the mesh is rougher than texels keep, or parts "
          "of it are left out",
          trials_[last_].triangles);
    }
    const bool is_met = met(best);
    return {std::move(best.baked), std::move(verdict), is_met};
  }

  const std::string& name_;
  const geometry::TriangleMesh& full_;
  BakeOptions options_;
  double rms_m_;
  const Progress& progress_;
  std::uint32_t most_near_pairs_;
  std::vector<Trial> trials_;
  std::size_t last_ = 0;      ///< of the trials, the one to go on from
  std::uint32_t before_ = 0;  ///< triangles of the one before; 0: there is none
  BakeError error_;
};

}  // namespace

tl::expected<BakedWithin, BakeError> bake_within(const std::string& name, const geometry::TriangleMesh& full,
                                                 BakeOptions options, double rms_m, const Progress& progress,
                                                 std::uint32_t most_near_pairs) {
  return Search(name, full, std::move(options), rms_m, progress, most_near_pairs).run();
}

}  // namespace farfeel::slave_sim
