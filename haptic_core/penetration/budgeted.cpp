// A contact's last answer is kept in S: depth, gradient g and T's pose then. With d how far To has moved in S since,
// and theta how T has turned,
//   depth = depth_then + g_rotation . theta + g_translation . d,
// and the contact point rides on T.
#include "haptic_core/penetration/budgeted.h"

#include <algorithm>
#include <array>
#include <utility>

namespace farfeel::penetration {
namespace {

using spatial::Pose;

struct Answer {
  std::uint32_t contact = 0;
  const FeltSurface *s = nullptr, *t = nullptr;
  std::uint32_t carried = 0;                      // calls since it was searched
  Pose X_ST;                                      // then
  glm::dvec3 p_TQ{0}, turning_S{0}, moving_S{0};  // contact point; the gradient's halves
  Penetration found;

  [[nodiscard]] bool is_of(const Query& query) const {
    return contact == query.contact && s == query.s.surface && t == query.t.surface;
  }
  [[nodiscard]] Pose then_in_now(const Query& query) const { return query.s.X_CO * X_ST; }
  [[nodiscard]] bool can_be_carried(const Query& query) const {
    if (!is_of(query) || query.wants_hessian || query.contact == 0 || !found.is_known() || carried >= kMostCarries) {
      return false;
    }
    const glm::dvec3 way =
        spatial::transform_point(query.t.X_CO, p_TQ) - spatial::transform_point(then_in_now(query), p_TQ);
    return glm::dot(way, way) < kMostCarried_m * kMostCarried_m;
  }
  void keep(const Query& query, const Penetration& answer) {
    contact = query.contact, s = query.s.surface, t = query.t.surface;
    carried = 0;
    X_ST = spatial::inverse(query.s.X_CO) * query.t.X_CO;
    p_TQ = spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C);
    const spatial::Wrench g_C = spatial::wrench_from(answer.gradient);
    turning_S = spatial::rotate_back(query.s.X_CO, g_C.torque_Nm);
    moving_S = spatial::rotate_back(query.s.X_CO, g_C.force_N);
    found = answer;
  }
  [[nodiscard]] Penetration carried_to(const Query& query) const {
    const Pose now = spatial::inverse(query.s.X_CO) * query.t.X_CO;
    const glm::dvec3 turned_S = spatial::vector_from_rotation(now.R * glm::conjugate(X_ST.R));
    Penetration answer = found;
    answer.depth_m += glm::dot(turning_S, turned_S) + glm::dot(moving_S, now.p - X_ST.p);
    answer.gradient = spatial::to_vector6(
        spatial::Wrench{spatial::rotate(query.s.X_CO, turning_S), spatial::rotate(query.s.X_CO, moving_S)});
    answer.p_CQ_C = spatial::transform_point(query.t.X_CO, p_TQ);
    return answer;
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
      Answer& last = slot_of(queries[carry[k]]);
      ++last.carried;
      answers[carry[k]] = last.carried_to(queries[carry[k]]);
    }
    for (std::size_t k = 0; k < searched; ++k) asked_[k] = queries[search[k]];
    inner_->evaluate({asked_.data(), searched}, {found_.data(), searched});
    for (std::size_t k = 0; k < searched; ++k) {
      answers[search[k]] = found_[k];
      if (found_[k].is_known()) slot_of(asked_[k]).keep(asked_[k], found_[k]);
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
