#include "haptic_core/penetration/search_budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "haptic_core/penetration/simd.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration {
namespace {

constexpr Limits kLimits{.coarse_triangles = 8};

/// Searches so many of a call's contacts, and counts.
class Budgeted {
 public:
  explicit Budgeted(std::size_t most_searches) : most_searches_(most_searches), back_end_(make_simd(kLimits)) {}

  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) {
    std::vector<std::size_t> order(queries.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return budget_.carries(queries[a]) > budget_.carries(queries[b]);
    });
    std::size_t searched = 0;
    for (const std::size_t i : order) {
      if (budget_.carries(queries[i]) != SearchBudget::kNever && searched >= most_searches_) {
        answers[i] = budget_.carried(queries[i]);
        continue;
      }
      back_end_->evaluate(queries.subspan(i, 1), answers.subspan(i, 1));
      budget_.keep(queries[i], answers[i]);
      ++searched;
    }
    asked_ += searched;
  }
  [[nodiscard]] std::size_t asked() const { return asked_; }

 private:
  std::size_t most_searches_, asked_ = 0;
  SearchBudget budget_;
  std::unique_ptr<BackEnd> back_end_;
};

struct Slide {
  Plates plates{waves({}, 1.5e-3, 0.1e-3, 0), waves({}, 12e-3, 0.3e-3, 0.4)};
  double turn_rad = 0;

  /// Contact `contact` of several that slide alike, shifted along the ridges' pattern; a step of 25 um is 0.1 m/s at 4
  /// kHz.
  Query query(std::uint32_t contact, int step, double step_m = 25e-6) {
    plates.X_CT.R = spatial::rotation_from_vector({0.01, 0.005, turn_rad * step}) * kTurnedOver;
    plates.X_CT.p = {step_m * step + 0.2e-3 * contact, 0.1e-3, 0.05e-3};
    Query query = plates.query();
    query.contact = contact;
    query.wants_hessian = false;
    return query;
  }
};

TEST(SearchBudget, CarriesWhatItMayNotSearchWithinAFewMicrometres) {
  Budgeted budgeted(2);
  const auto each = make_simd(kLimits);
  Slide slide;
  slide.turn_rad = 1e-4;
  double square = 0, worst_gradient = 0;
  int count = 0;
  for (int step = 0; step < 200; ++step) {
    std::array<Query, 7> queries;
    std::array<Penetration, 7> answers, exact;
    for (std::uint32_t c = 0; c < 7; ++c) queries[c] = slide.query(c + 1, step);
    const std::size_t before = budgeted.asked();
    budgeted.evaluate(queries, answers);
    EXPECT_EQ(budgeted.asked() - before, step == 0 ? 7u : 2u);
    for (std::size_t c = 0; c < 7; ++c) {
      each->evaluate({&queries[c], 1}, {&exact[c], 1});
      EXPECT_NEAR(answers[c].depth_m, exact[c].depth_m, 2e-6);
      square += std::pow(answers[c].depth_m - exact[c].depth_m, 2), ++count;
      worst_gradient = std::max(worst_gradient, (answers[c].gradient - exact[c].gradient).tail<3>().norm());
    }
  }
  RecordProperty("depth_rms_um", std::to_string(1e6 * std::sqrt(square / count)));
  EXPECT_LT(std::sqrt(square / count), 0.5e-6);
  EXPECT_LT(worst_gradient, 0.1);
}

TEST(SearchBudget, SearchesWhatIsNewNamelessOrHasGoneFar) {
  Budgeted budgeted(1);
  Slide slide;
  const auto asks = [&](const Query& query) {
    const std::size_t before = budgeted.asked();
    const Query other = slide.query(60, 0);  // takes the budget: it is older each time
    std::array<Query, 2> queries{query, other};
    std::array<Penetration, 2> answers;
    budgeted.evaluate(queries, answers);
    return budgeted.asked() - before;
  };
  EXPECT_EQ(asks(slide.query(1, 0)), 2u) << "new";
  EXPECT_EQ(asks(slide.query(1, 1)), 1u);
  EXPECT_EQ(asks(slide.query(1, 100)), 1u) << "it has gone far: the budget is its";
  EXPECT_EQ(asks(slide.query(2, 100)), 1u) << "new: likewise";
  EXPECT_EQ(asks(slide.query(0, 100)), 1u) << "nameless: likewise";
  Query curved = slide.query(2, 100);
  curved.wants_hessian = true;
  EXPECT_EQ(asks(curved), 1u);
  Plates far{waves({}, 1.5e-3, 0.1e-3, 0), waves({}, 12e-3, 0.3e-3, 0.4)};
  Query elsewhere = slide.query(2, 100);
  elsewhere.s.surface = &far.s;
  EXPECT_EQ(asks(elsewhere), 1u) << "another surface";
}

TEST(SearchBudget, TheBackEndSaysWhichAnswersWereCostly) {
  const auto back_end = make_simd(kLimits);
  Plates plates(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.005, .depth_m = 0.003}, 2e-3, 0.2e-3, 1));
  const auto searches = [&](double x_m) {
    plates.X_CT.p.x = x_m;
    const std::uint64_t before = back_end->searches();
    Query query = plates.query();
    query.wants_hessian = false;
    (void)evaluate(*back_end, query);
    return back_end->searches() - before;
  };
  EXPECT_EQ(searches(0), 1u);
  (void)searches(0);  // may settle on another step
  EXPECT_EQ(searches(0), 0u) << "nothing has moved";
  EXPECT_EQ(searches(1e-3), 1u);
}

/// With one contact nothing is ever carried.
TEST(SearchBudget, OneContactIsSearchedEachTime) {
  Budgeted budgeted(2);
  Slide slide;
  for (int step = 0; step < 20; ++step) {
    const Query query = slide.query(5, step);
    Penetration answer;
    budgeted.evaluate({&query, 1}, {&answer, 1});
  }
  EXPECT_EQ(budgeted.asked(), 20u);
}

}  // namespace
}  // namespace farfeel::penetration
