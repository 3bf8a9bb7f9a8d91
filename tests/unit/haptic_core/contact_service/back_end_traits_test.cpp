// What the contact service does in a back end's place is what the back end's traits allow.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/penetration/simd/simd.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

namespace farfeel::contact_service {
namespace {

using penetration::Penetration;
using penetration::Query;
using penetration::Traits;

/// What was asked, call by call.
using Calls = std::vector<std::vector<Query>>;

/// Simd by other traits.
class Asked final : public penetration::BackEnd {
 public:
  Asked(const penetration::Limits& limits, const Traits& traits, Calls& calls)
      : traits_(traits), calls_(calls), simd_(penetration::make_simd(limits)) {}
  [[nodiscard]] Traits traits() const noexcept override { return traits_; }
  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    calls_.emplace_back(queries.begin(), queries.end());
    simd_->evaluate(queries, answers);
  }

 private:
  Traits traits_;
  Calls& calls_;
  std::unique_ptr<penetration::BackEnd> simd_;
};

/// The queries of each answer: a tool whose underside is at its origin, at some depths in two objects of one place.
std::vector<Calls> asked(const geometry::HapticSurface& table, const geometry::HapticSurface& tool,
                         const Traits& traits, std::span<const double> depths_m, ContactOptions options = {}) {
  Calls calls;
  options.maker = [&](const penetration::Limits& limits) { return std::make_unique<Asked>(limits, traits, calls); };
  const TouchableObject object{.felt = &table, .material = {}, .X_WO = {}};
  const std::array both{object, object};
  ContactService service(both, {.felt = &tool, .material = {}, .X_WO = {}}, options);
  std::vector<Calls> all;
  for (std::uint32_t i = 0; i < depths_m.size(); ++i) {
    calls.clear();
    static_cast<void>(service.answer({.sequence = i,
                                      .time_ns = i * 1'000'000LL,
                                      .X_WT = {{0, 1, 0, 0}, {0.2e-3, 0.1e-3, -depths_m[i]}},
                                      .V_WT_W = {},
                                      .wants_curvature = true}));
    all.push_back(calls);
  }
  return all;
}

struct Plates {
  geometry::HapticSurface table = slave_sim::ridged_plate(3e-3, 0.5e-3),
                          tool = slave_sim::ridged_plate(2e-3, 0.3e-3, {.size_m = {0.01, 0.008, 0.004}});
};

std::size_t queries_of(const Calls& calls) {
  std::size_t count = 0;
  for (const auto& call : calls) count += call.size();
  return count;
}

TEST(BackEndTraits, TheAlgorithmItselfAnswersContactsWithoutTexture) {
  const geometry::HapticSurface table = support::untextured(support::box_mesh({0.03, 0.03, 0.01})),
                                tool = support::untextured(support::box_mesh({0.01, 0.008, 0.006}));
  const std::array pressed{-7.9e-3};
  EXPECT_EQ(queries_of(asked(table, tool, {.finds_extent = true}, pressed)[0]), 2u);
  EXPECT_EQ(queries_of(asked(table, tool, {.finds_extent = true, .may_substitute = true}, pressed)[0]), 0u)
      << "a closed form";
}

TEST(BackEndTraits, TheAlgorithmItselfAnswersFarContactsEveryTime) {
  const Plates plates;
  const std::array apart{-3e-3, -3e-3, -3e-3};
  for (const bool may_substitute : {false, true}) {
    const auto calls =
        asked(plates.table, plates.tool, {.finds_extent = true, .may_substitute = may_substitute}, apart);
    EXPECT_EQ(queries_of(calls[0]), may_substitute ? 1u : 2u) << "one in turn";
    EXPECT_EQ(queries_of(calls[2]), may_substitute ? 0u : 2u);
  }
}

TEST(BackEndTraits, TheAlgorithmItselfIsNotCarriedOnABudget) {
  const Plates plates;
  const std::array<double, 5> held{1e-4, 1e-4, 1e-4, 1e-4, 1e-4};
  for (const bool may_substitute : {false, true}) {
    const auto calls = asked(plates.table, plates.tool, {.finds_extent = true, .may_substitute = may_substitute}, held,
                             {.most_searches = 1});
    EXPECT_EQ(queries_of(calls[4]), may_substitute ? 1u : 2u);
  }
}

TEST(BackEndTraits, OnABudgetTooWhoBatchesIsAskedOnce) {
  const Plates plates;
  const std::array pressed{1e-4};
  for (const bool batches : {false, true}) {
    const auto calls =
        asked(plates.table, plates.tool, {.finds_extent = true, .may_substitute = true, .batches = batches}, pressed,
              {.most_searches = 2})[0];
    EXPECT_EQ(calls.size(), batches ? 1u : 2u);
    EXPECT_EQ(queries_of(calls), 2u);
  }
}

TEST(BackEndTraits, AWindowFitsTheContactForWhoDoesNotFindItsExtent) {
  const Plates plates;
  const std::array pressed{1e-4};
  for (const bool finds_extent : {false, true}) {
    const auto calls = asked(plates.table, plates.tool, {.finds_extent = finds_extent}, pressed)[0];
    ASSERT_EQ(queries_of(calls), 2u);
    const glm::dvec2 size_m = calls[0][0].window.high - calls[0][0].window.low;
    EXPECT_EQ(size_m.x < 0.02, !finds_extent) << size_m.x;
  }
}

TEST(BackEndTraits, ASecondDerivativeIsAskedOfWhoHasIt) {
  const Plates plates;
  const std::array pressed{1e-4};
  for (const bool has_hessian : {false, true}) {
    const auto calls = asked(plates.table, plates.tool, {.finds_extent = true, .has_hessian = has_hessian}, pressed)[0];
    EXPECT_EQ(calls[0][0].wants_hessian, has_hessian);
  }
}

}  // namespace
}  // namespace farfeel::contact_service
