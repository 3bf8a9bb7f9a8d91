// Depths that do not grow with the width that softens their direction.
//
// Where two peaks compete, the soft maximum's gradient turns from the one to the other within a few of its widths W:
// the wider, the softer the contact. But over an area A that touches evenly its value is W ln(A / a0) above the peak,
// so it grows with W by several widths. With w the width that was asked for,
//   depth = w ln[(1 / a0) integral exp(d / w)],   gradient, point and Hessian = those of W ln[(1 / a0) integral exp(d /
//   W)]:
// W says where a force points, and not how large it is. The two agree at W = w, so both are continuous in W.
#pragma once

#include <array>
#include <memory>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

/// Another back end's answers, but for the depth of queries whose depth_width_m is less than their soft_width_m: that
/// one is asked for by itself, and costs a second search.
class TwoWidths final : public BackEnd {
 public:
  explicit TwoWidths(std::unique_ptr<BackEnd> back_end) : back_end_(std::move(back_end)) {}

  [[nodiscard]] Traits traits() const noexcept override { return back_end_->traits(); }
  void prepare(const FeltSurface& surface) override { back_end_->prepare(surface); }
  void evaluate(std::span<const Query>, std::span<Penetration>) noexcept override;
  [[nodiscard]] std::uint64_t searches() const noexcept override { return back_end_->searches(); }
  void restart() noexcept override { back_end_->restart(); }

 private:
  static constexpr std::size_t kMost = 32;  ///< at a time

  std::unique_ptr<BackEnd> back_end_;
  std::array<Query, 2 * kMost> asked_;
  std::array<Penetration, 2 * kMost> found_;
  std::array<std::size_t, kMost> depth_of_;  ///< whose depth the further ones are
};

}  // namespace farfeel::penetration
