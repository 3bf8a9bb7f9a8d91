// Branch and bound over square cells of C's plane: where the overlap of two patches can still matter.
//
// Cells of the first level tile the window. The kernels sample the overlap at their centres and bound it inside them;
// cells that cannot matter are dropped, the others divided, and so on.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "haptic_core/penetration/simd/kept_cells.h"
#include "haptic_core/penetration/simd/lane_patch.h"

namespace farfeel::penetration {

/// Belongs to one thread; its functions allocate nothing.
class CellSearch {
 public:
  CellSearch(const Limits&, const simd::Kernels&);

  /// Projects a query's patches. False where they share no part of the window.
  bool project(const Query&) noexcept;
  /// Begins a search of those patches. nearer_m: what is left out may come so much nearer to the best later on.
  void begin(double nearer_m) noexcept;
  /// The part of C's plane that is searched.
  [[nodiscard]] const Window& window() const { return window_; }
  [[nodiscard]] double finest_texel_m() const;

  /// A few cells of this size where the peak was: against the best of them most of the window needs no close look.
  void recall(const glm::dvec3& p_CQ, double cell_m) noexcept;
  /// The first level: square cells over the window, about `samples` along a side at most; divided some times they come
  /// out at usual_step_m, if that is known (> 0). Blocks of them that cannot come within tail_m of the best are left
  /// out.
  void tile(std::uint32_t samples, double usual_step_m, double tail_m, double soft_width_m) noexcept;
  /// Keeps cells that the relief may lift to within tail_m of the best.
  void sift(double tail_m, double soft_width_m) noexcept;
  /// Samples and bounds the cells; those that cannot come within tail_m of the best are gone.
  void look(double tail_m, double soft_width_m) noexcept;
  /// Takes up cells that an earlier answer kept, and stores the kept ones.
  void resume(const KeptCells&, const KeptCells::Place&) noexcept;
  void store(simd::CellStore&) const noexcept;
  /// What a pass over the cells found.
  struct Summed {
    simd::Sums sums;
    double best_m;            ///< of cells; some may lie beyond the window
    double peak_width_m;      ///< 0 where no cell tells
    double least_way_m;       ///< until one of the cells has come nearer_m() nearer, or as near as none may,
    double least_near_way_m;  ///< and one of those that weigh
    bool is_at_edge;          ///< a patch's edge fades some of what weighs,
    bool is_at_very_edge;     ///< and some weighs within kVeryEdge_m of it
  };
  /// Samples the cells and adds them up in one pass. What may be wanted again is stored, if there is a store. False
  /// where what was known of the best was too far off to sum from.
  bool add_up_at_once(const simd::SumTask&, Summed&, simd::CellStore*) noexcept;
  /// Keeps cells that weigh in the soft maximum; those left out have less than a share of it, each at its bound.
  /// Returns how wide its peak is [m]; 0 while no cell tells.
  double keep_what_weighs(double tail_m, double soft_width_m, double left_out_share) noexcept;
  /// Whether nodes that far apart in the kept cells may miss a peak that rises above the best: one that is narrower
  /// than what weighs so far. is_trial: cells have not told that this step is fine enough.
  [[nodiscard]] bool may_hide_a_peak(double step_m, double soft_width_m, bool is_trial = false) const noexcept;
  /// Of the kept cells that may come near the best, the share where the overlap may bend by so much from node to node
  /// that the nodes see it by chance. The nodes are those of the last lay(), or, before there was one, the cells.
  [[nodiscard]] double rough_share(double soft_width_m) const noexcept;
  /// No overlap in the kept cells is more.
  [[nodiscard]] double most_m() const noexcept;
  /// Keeps cells that may reach above bound_m.
  void keep_above(double bound_m) noexcept;
  /// Keeps about `most` of the kept cells to stand for all: those that may weigh much for certain, others by chance,
  /// and each of these for so many as its chance was small. So a sum over them is right on average, and its spread is
  /// known: Sums::noise. A cell's fate follows from its place in S's lattice and from its chance.
  void draw(std::size_t most, double soft_width_m) noexcept;
  /// Every kept cell becomes four, but for those that cannot come within tail_m of the best; the others are gone.
  /// Precondition: 4 kept() <= kMostCells.
  void divide(double tail_m) noexcept;
  /// The nodes of a lattice of that step in the kept cells, which S's origin holds, but for the same; the cells are
  /// gone. False, and as before, where they may be more than `most`.
  bool lay(double step_m, double tail_m, std::size_t most) noexcept;
  /// The same anew in the cells that the last lay() was of, as long as nothing but add_up_at_once() came between.
  bool lay_again(double step_m, double tail_m, std::size_t most) noexcept;
  /// The middles of the kept cells as such nodes.
  void lay_middles() noexcept;
  /// The cells are back in place of the nodes in them; likewise.
  void take_up() noexcept;

  [[nodiscard]] const simd::LaneCells& cells() const { return cells_; }
  /// What was left out of the search so far comes within its tail less nearer_m of the best after the surfaces have
  /// moved by this along each other, at the earliest [m].
  [[nodiscard]] double least_way_m() const { return least_way_m_; }
  [[nodiscard]] double nearer_m() const { return nearer_m_; }
  /// The same for where an edge of S meets one of T: on either side of the gap between them there was nothing to see.
  /// fading_m: the soft width, if edges fade.
  [[nodiscard]] double way_to_edges_m(double tail_m, double fading_m) noexcept;
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const std::vector<std::uint32_t>& kept() const { return kept_; }
  /// How many cells weigh for certain.
  [[nodiscard]] std::size_t sampled() const { return sampled_; }
  /// How much of what weighs a patch's edge may fade, as the cells that were kept tell it.
  [[nodiscard]] double share_at_edge() const { return share_at_edge_; }
  [[nodiscard]] double step_m() const { return step_m_; }
  /// Steepest slope seen in the sampled cells, of either side; never quite level.
  [[nodiscard]] double steepest() const noexcept;
  /// Greatest overlap seen, with the fade at edges.
  [[nodiscard]] double best_m() const { return best_m_; }
  void expect_best(double overlap_m) { best_m_ = overlap_m; }
  void forget_best() { best_m_ = static_cast<double>(simd::kNowhere); }
  void raise_best(double overlap_m) { best_m_ = std::max(best_m_, overlap_m); }
  [[nodiscard]] const FacingPatch& s() const { return s_; }
  [[nodiscard]] const FacingPatch& t() const { return t_; }
  [[nodiscard]] simd::LaneSide s_side() const { return s_lanes_.side(); }
  [[nodiscard]] simd::LaneSide t_side() const { return t_lanes_.side(); }

  static constexpr std::size_t kMostCells = 16'000;  ///< of one level
  static constexpr double kNearWidths = 4;           ///< cells this near the best decide how sharp the peak is
  static constexpr double kVeryEdge_m = kEdgeFade_m / 4;
  static constexpr double kFadedWidths = 0.05;  ///< lost to the fade: then a cell is near an edge

 private:
  /// The columns of simd::LaneCells, with their memory.
  class Columns {
   public:
    Columns();
    [[nodiscard]] simd::LaneCells lanes();

   private:
    std::array<std::vector<float>, 17> columns_;
  };
  static constexpr std::int32_t kBins = 160;  ///< layers of overlap below the best that are told apart
  static constexpr double kBinsAWidth = 8;    ///< to a soft width

  [[nodiscard]] static double peak_width_m(const simd::Weights&, double soft_width_m) noexcept;
  void note_way(double way_m) noexcept { least_way_m_ = std::min(least_way_m_, way_m); }
  /// What a kernel is asked about `count` cells of that step.
  [[nodiscard]] simd::CellTask task_for(std::size_t count, double step_m, double tail_m, double soft_width_m) noexcept;
  /// Places on a lattice in the kept ones of some cells; false if they may be too many. half_m: of what they stand for.
  struct Laying {
    double cell_m, step_m, half_m, tail_m;
    std::size_t most;
  };
  bool lay_in(const simd::LaneCells& cells, const Laying&, const simd::LaneCells& places) noexcept;

  const simd::Kernels& kernels_;
  FacingPatch s_, t_;
  LanePatch s_lanes_, t_lanes_;
  Window window_;
  Window cut_;          // the query's window
  glm::dvec2 p_CS_{0};  // S's origin in C's plane
  double deepest_m_ = 0;
  std::array<Columns, 2> memory_;
  simd::LaneCells cells_ = memory_[0].lanes(), next_ = memory_[1].lanes();
  std::size_t count_ = 0, sampled_ = 0;
  std::vector<std::int32_t> listed_, bins_;  // cells that were weighed, and their layers below the best
  std::vector<float> at_bound_, at_sample_;  // what kept cells may weigh and what they seem to, in draw()
  std::vector<const PatchEdge*> t_edges_;    // near ones, in way_to_edges_m()
  std::vector<std::uint32_t> kept_;          // cells that can still matter
  std::array<double, kBins> fall_;           // what a cell weighs in each layer below the best
  double step_m_ = 0, laid_in_m_ = 0;        // a cell's side; of those that nodes were laid in
  std::size_t laid_in_ = 0;                  // how many those were
  bool are_sampled_ = false, has_parents_ = false, are_laid_ = false;
  double best_m_ = 0, nearer_m_ = 0, least_way_m_ = 0, share_at_edge_ = 0;
};

}  // namespace farfeel::penetration
