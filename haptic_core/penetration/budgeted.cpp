#include "haptic_core/penetration/budgeted.h"

#include <algorithm>
#include <array>
#include <utility>

#include "haptic_core/penetration/carried.h"

namespace farfeel::penetration {
namespace {

struct Answer {
  Carried last;
  std::uint32_t carried = 0;  // calls since it was searched

  [[nodiscard]] bool can_be_carried(const Query& query) const {
    return last.is_of(query) && !query.wants_hessian && carried < kMostCarries && last.way_m(query) < kMostCarried_m;
  }
};

class Budgeted final : public BackEnd {
 public:
  Budgeted(std::unique_ptr<BackEnd> inner, std::uint32_t most_searches)
      : inner_(std::move(inner)), most_searches_(most_searches) {}

  void prepare(const FeltSurface& surface) override { inner_->prepare(surface); }

  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t begin = 0; begin < queries.size(); begin += kSlots) {
      const std::size_t count = std::min(kSlots, queries.size() - begin);
      evaluate_some(queries.subspan(begin, count), answers.subspan(begin, count));
    }
  }

 private:
  static constexpr std::size_t kSlots = 64;

  [[nodiscard]] Answer& slot_of(const Query& query) { return slots_[query.contact % kSlots]; }

  void evaluate_some(std::span<const Query> queries, std::span<Penetration> answers) noexcept {
    std::size_t carried = 0, searched = 0;
    std::array<std::size_t, kSlots> carry, search;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      (slot_of(queries[i]).can_be_carried(queries[i]) ? carry[carried++] : search[searched++]) = i;
    }
    // The rest of the budget goes to those that have been carried longest.
    const std::size_t more = std::min(carried, most_searches_ > searched ? most_searches_ - searched : 0);
    std::partial_sort(carry.begin(), carry.begin() + static_cast<std::ptrdiff_t>(more),
                      carry.begin() + static_cast<std::ptrdiff_t>(carried), [&](std::size_t a, std::size_t b) {
                        return slot_of(queries[a]).carried > slot_of(queries[b]).carried;
                      });
    for (std::size_t k = 0; k < more; ++k) search[searched++] = carry[k];
    for (std::size_t k = more; k < carried; ++k) {
      Answer& slot = slot_of(queries[carry[k]]);
      ++slot.carried;
      answers[carry[k]] = slot.last.carried_to(queries[carry[k]]);
    }
    for (std::size_t k = 0; k < searched; ++k) asked_[k] = queries[search[k]];
    inner_->evaluate({asked_.data(), searched}, {found_.data(), searched});
    for (std::size_t k = 0; k < searched; ++k) {
      answers[search[k]] = found_[k];
      if (!found_[k].is_known()) continue;
      slot_of(asked_[k]).last.keep(asked_[k], found_[k]);
      slot_of(asked_[k]).carried = 0;
    }
  }

  std::unique_ptr<BackEnd> inner_;
  std::size_t most_searches_;
  std::array<Answer, kSlots> slots_;
  std::array<Query, kSlots> asked_;
  std::array<Penetration, kSlots> found_;
};

}  // namespace

std::unique_ptr<BackEnd> make_budgeted(std::unique_ptr<BackEnd> inner, std::uint32_t most_searches) {
  return std::make_unique<Budgeted>(std::move(inner), most_searches);
}

}  // namespace farfeel::penetration
