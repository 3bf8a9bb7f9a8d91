// The simd back end with its workspace: what it remembers of contacts, and the two maxima that it searches for.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>

#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/cell_search.h"

namespace farfeel::penetration {

/// Of the step that would do: a new one is a little finer.
inline constexpr double kNewShare = 0.87;

/// See make_simd.
class SimdBackEnd final : public BackEnd {
 public:
  SimdBackEnd(const Limits& limits, const simd::Kernels& kernels)
      : kernels_(kernels), grids_(make_reference(limits)), search_(limits, kernels) {}

  [[nodiscard]] Traits traits() const noexcept override {
    return {.finds_extent = true, .may_substitute = true, .has_hessian = true};
  }
  void evaluate(std::span<const Query>, std::span<Penetration>) noexcept override;
  [[nodiscard]] std::uint64_t searches() const noexcept override { return searches_; }
  void restart() noexcept override {
    for (Memory& memory : memories_) memory.s = nullptr;
  }

 private:
  static constexpr std::size_t kMemories = 64;
  /// Cells are divided no further: slopes that run away at an edge ask for any.
  static constexpr double kLeastStep_m = 3e-6;
  static constexpr std::size_t kLeastCells = 10;  ///< of weight that a peak is summed from
  /// What a patch covers anew at its edge was never seen. Where some weighs there, it may rise by so much of that.
  static constexpr double kHiddenAtEdge = 3.0 / 7;
  /// A cell may hide a hard peak so much higher than the one found; left-out cells may come so much nearer until the
  /// hard maximum is searched anew.
  static constexpr double kHidden_m = 50e-9, kMostNearerHard_m = 10e-6;
  static constexpr double kNoWidth_m = 1e-9;  ///< for a search in which the fade at edges does not count

  /// What the last answer to the same contact may be good for now. It decides where a search begins, or that nothing is
  /// searched; so a wrong one costs time. What a search sums does not depend on it, but for how far its tail reaches
  /// and for second derivatives.
  struct Memory {
    std::uint32_t contact = 0;
    bool is_second = false;
    const FeltSurface *s = nullptr, *t = nullptr;  // null: nobody's
    glm::dvec3 p_TQ{0};
    double step_m = 0;             // of the last sum; 0: none
    double step_of_hessian_m = 0;  // resolved the peak, or will, where second derivatives were asked for
    double tail_more = 0;          // soft widths that its tail is longer than others
    KeptCells cells;

    [[nodiscard]] bool is_of(std::uint32_t number, const Query& query) const {
      return contact == number && is_second == query.is_second && s == query.s.surface && t == query.t.surface;
    }
    [[nodiscard]] double& step_for(const Query& query) { return query.wants_hessian ? step_of_hessian_m : step_m; }
    void begin(std::uint32_t number, const Query& query) {
      contact = number, is_second = query.is_second, s = query.s.surface, t = query.t.surface;
      step_m = step_of_hessian_m = tail_more = 0;
      cells.drop();
    }
    /// Where the peak is narrow and what lies below it wide, the depth is below the peak, and cells count that are as
    /// much further below, but for one width. Follows what an answer says of that; too short by less than kTailSpare,
    /// or too long by less than kTailTooLong, is not changed. False where the tail was too short for it.
    bool was_tail_enough(double best_m, double depth_m, double soft_width_m) {
      constexpr double kDepthBelowPeak = 1, kMostTailMore = 9, kTailSpare = 1, kTailTooLong = 2;
      const double wanted = std::clamp((best_m - depth_m) / soft_width_m - kDepthBelowPeak, 0.0, kMostTailMore);
      const bool is_short = wanted > tail_more + kTailSpare;
      if (is_short || wanted < tail_more - kTailTooLong) tail_more = wanted;
      return !is_short;
    }
  };

  /// Of patches that the search has projected.
  Penetration answer(const Query&, std::uint32_t contact, Memory&) noexcept;
  Penetration searched(const Query&, Memory&, double& target_m) noexcept;
  /// How far below the peak cells still count.
  [[nodiscard]] double tail_of(const Query&) const noexcept;
  /// The step that resolves a peak of that width.
  [[nodiscard]] double step_for_width(const Query&, double width_m) const noexcept;
  [[nodiscard]] bool resolves(double step_m) const noexcept {
    return search_.step_m() <= step_m && search_.sampled() >= kLeastCells;
  }
  /// From the cells that the last answer was summed from; unknown where they will not do.
  Penetration summed_again(const Query&, KeptCells&, double& target_m) noexcept;
  /// From nodes of a lattice that suits the peak, in the cells that a level has kept; unknown where they are too many
  /// yet.
  struct Laying {
    double step_m;   ///< the first
    double drawn_m;  ///< see Spread
    std::size_t most;
  };
  Penetration summed_in_kept(const Query&, const Laying&, KeptCells&, double& target_m) noexcept;
  /// From the middles of those cells; unknown where what is known of the best is too far off.
  Penetration summed_at_middles(const Query&, const Spread&, KeptCells&) noexcept;
  void keep(const Query&, const Penetration&, const CellSearch::Summed&, const Spread&, const simd::CellStore&,
            KeptCells&) noexcept;
  /// target_m: the step that is expected to resolve the peak; what did.
  Penetration soft_maximum(const Query&, KeptCells&, double& target_m) noexcept;
  /// known_m: the last step of the last search; 0: none.
  Penetration hard_maximum(const Query&, KeptCells&, double known_m) noexcept;
  [[nodiscard]] simd::SumTask sum_task(const Query&, std::size_t count) const noexcept;
  Penetration sum_up(const Query&, const Spread&) noexcept;

  const simd::Kernels& kernels_;
  std::unique_ptr<BackEnd> grids_;  // answers what asks for a raw grid
  CellSearch search_;
  std::array<Memory, kMemories> memories_;
  std::uint64_t searches_ = 0;
  double tail_more_ = 0;  // soft widths; of the contact at hand
};

}  // namespace farfeel::penetration
