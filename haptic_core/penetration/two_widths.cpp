#include "haptic_core/penetration/two_widths.h"

#include <algorithm>

#include "haptic_core/ablation/ablation.h"

namespace farfeel::penetration {
namespace {

bool wants_two(const Query& query) {
  return !ablated(Mechanism::kTwoWidths) && query.depth_width_m > 0 && query.depth_width_m < query.soft_width_m;
}

/// The same contact at the width of its depth.
Query for_depth(const Query& query, std::size_t place) {
  Query narrow = query;
  narrow.contact = query.contact != 0 ? query.contact : static_cast<std::uint32_t>(place);
  narrow.is_second = true;
  narrow.soft_width_m = query.depth_width_m;
  narrow.wants_hessian = narrow.estimates_hessian = false;
  return narrow;
}

}  // namespace

void TwoWidths::evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept {
  if (std::none_of(queries.begin(), queries.end(), wants_two)) return back_end_->evaluate(queries, answers);
  for (std::size_t first = 0; first < queries.size(); first += kMost) {
    const std::size_t count = std::min(kMost, queries.size() - first);
    std::size_t further = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Query& query = queries[first + i];
      asked_[i] = query;
      if (!wants_two(query)) continue;
      asked_[count + further] = for_depth(query, first + i);
      depth_of_[further++] = i;
    }
    back_end_->evaluate({asked_.data(), count + further}, {found_.data(), count + further});
    for (std::size_t k = 0; k < further; ++k) {
      Penetration& wide = found_[depth_of_[k]];
      const Penetration& narrow = found_[count + k];
      if (!wide.is_known() || !narrow.is_known()) continue;
      wide.depth_m = narrow.depth_m;
      wide.doubts |= narrow.doubts;
    }
    std::copy_n(found_.begin(), count, answers.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

}  // namespace farfeel::penetration
