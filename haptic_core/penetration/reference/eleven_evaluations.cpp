#include "haptic_core/penetration/reference/eleven_evaluations.h"

namespace farfeel::penetration {
namespace {

constexpr std::array<int, 5> kCoordinates{0, 1, 2, 3, 4};  // three rotations, then across the direction

}  // namespace

std::array<Query, 11> queries_around(const Query& query, const DifferenceSteps& steps) noexcept {
  std::array<Query, 11> queries;
  queries.fill(query);
  for (std::size_t i = 0; i < kCoordinates.size(); ++i) {
    const int k = kCoordinates[i];
    for (const int turn : {1, -1}) {
      spatial::Pose& X_CT = queries[2 * i + (turn > 0 ? 1 : 2)].t.X_CO;
      glm::dvec3 along{0};
      along[k % 3] = turn * (k < 3 ? steps.rotation_rad : steps.translation_m);
      if (k < 3) {
        X_CT.R = glm::normalize(spatial::rotation_from_vector(along) * X_CT.R);
      } else {
        X_CT.p += along;
      }
    }
  }
  return queries;
}

Penetration gradient_from(const std::array<Penetration, 11>& answers, const DifferenceSteps& steps) noexcept {
  Penetration answer = answers[0];
  for (std::size_t i = 0; i < kCoordinates.size(); ++i) {
    const int k = kCoordinates[i];
    const double step = k < 3 ? steps.rotation_rad : steps.translation_m;
    answer.gradient[k] = (answers[2 * i + 1].depth_m - answers[2 * i + 2].depth_m) / (2 * step);
  }
  answer.gradient[5] = -1;
  return answer;
}

Penetration eleven_evaluations(BackEnd& back_end, const Query& query, const DifferenceSteps& steps) noexcept {
  const std::array<Query, 11> queries = queries_around(query, steps);
  std::array<Penetration, 11> answers;
  back_end.evaluate(queries, answers);
  return gradient_from(answers, steps);
}

}  // namespace farfeel::penetration
