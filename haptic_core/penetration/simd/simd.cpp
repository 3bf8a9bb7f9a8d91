// The soft maximum is summed over the cells that a search by branch and bound leaves, once their step resolves the
// peak: so the cost follows the area that touches, not the window. The hard maximum is climbed to from the best cell,
// and proven by cells whose bounds stay below it. While little moves neither is searched again: the soft maximum is
// summed over the cells that weighed the last time, the hard one looked for among those that came near the best.
#include "haptic_core/penetration/simd/simd.h"

#include <algorithm>
#include <atomic>
#include <bitset>

#include "haptic_core/counting/work.h"
#include "haptic_core/penetration/simd/simd_back_end.h"

namespace farfeel::penetration {
namespace {

/// Left-out cells may come so much nearer until contacts are searched anew: those on the flanks of what is summed have
/// about half a percent of the weight then.
constexpr double kMostNearerWidths = 3.5;
/// The step that a search with second derivatives begins with is kept while it is fine enough, but no finer than this.
constexpr double kMostTooFine = 1.35;

std::atomic<InstructionSet> widest{InstructionSet::kBest};  // that kBest may be

const simd::Kernels& kernels_of(InstructionSet wanted) {
  if (wanted == InstructionSet::kBest) wanted = widest.load(std::memory_order_relaxed);
#if defined(__x86_64__)
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if ((wanted == InstructionSet::kBest || wanted == InstructionSet::kAvx512) && has_avx512) return simd::kAvx512;
  if (wanted != InstructionSet::kPlain && has_avx2) return simd::kAvx2;
#endif
  return simd::kPlain;
}

/// The step to begin with the next time, after `step_m` was taken and target_m would have been fine enough.
double next_step_m(double step_m, double target_m) {
  return step_m <= target_m && target_m <= kMostTooFine * step_m ? step_m : kNewShare * target_m;
}

bool are_of_same_patches(const Query& a, const Query& b) {
  const auto are_same = [](const Patch& p, const Patch& q) {
    return p.surface == q.surface && p.X_CO.R == q.X_CO.R && p.X_CO.p == q.X_CO.p &&
           p.triangles.data() == q.triangles.data() && p.triangles.size() == q.triangles.size();
  };
  return are_same(a.s, b.s) && are_same(a.t, b.t) && a.window.low == b.window.low && a.window.high == b.window.high &&
         a.deepest_m == b.deepest_m;
}

/// The second question about a contact has a slot of its own.
std::size_t slot_of(std::uint32_t contact, bool is_second, std::size_t slots) {
  return (contact + (is_second ? slots / 2 : 0)) % slots;
}

}  // namespace

void SimdBackEnd::evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept {
  std::bitset<kMemories> is_answered;  // of the first so many, before their turn
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (i < is_answered.size() && is_answered[i]) continue;
    if (!queries[i].refines) {
      grids_->evaluate(queries.subspan(i, 1), answers.subspan(i, 1));
      continue;
    }
    const bool is_shared = search_.project(queries[i]);
    const auto answer_one = [&](std::size_t k) {
      counting::count(Work::kDepths);
      const std::uint32_t contact = queries[k].contact != 0 ? queries[k].contact : static_cast<std::uint32_t>(k);
      Memory& memory = memories_[slot_of(contact, queries[k].is_second, kMemories)];
      answers[k] = is_shared ? answer(queries[k], contact, memory) : Penetration{};
    };
    answer_one(i);
    // The same contact at another width is of the same patches, which have been projected.
    for (std::size_t k = i + 1; k < std::min(queries.size(), is_answered.size()); ++k) {
      if (is_answered[k] || !queries[k].refines || !are_of_same_patches(queries[i], queries[k])) continue;
      answer_one(k);
      is_answered[k] = true;
    }
  }
}

Penetration SimdBackEnd::searched(const Query& query, Memory& memory, double& target_m) noexcept {
  const bool is_soft = query.soft_width_m > 0;
  const double tail_m = is_soft ? tail_of(query) : 0, width_m = is_soft ? query.soft_width_m : kNoWidth_m;
  ++searches_;
  counting::count(Work::kSearches);
  search_.forget_best();
  if (memory.step_m > 0 || memory.step_of_hessian_m > 0) {
    search_.recall(spatial::transform_point(query.t.X_CO, memory.p_TQ),
                   std::max(memory.step_m, memory.step_of_hessian_m));
    search_.look(tail_m, width_m);
    if (!is_soft) search_.expect_best(search_.best_m() - kHidden_m);  // its own cell's bound may be rounded below it
  }
  // What a depth's nodes are must not depend on what they were.
  const bool forgets = is_soft && !query.wants_hessian;
  target_m = forgets ? 0 : memory.step_for(query);
  if (!is_soft) return hard_maximum(query, memory.cells, target_m);
  search_.tile(query.samples, target_m, tail_m, width_m);
  return soft_maximum(query, memory.cells, target_m);
}

Penetration SimdBackEnd::answer(const Query& query, std::uint32_t contact, Memory& memory) noexcept {
  const bool is_soft = query.soft_width_m > 0;
  search_.begin(is_soft ? kMostNearerWidths * query.soft_width_m : kMostNearerHard_m);
  if (!memory.is_of(contact, query)) memory.begin(contact, query);
  tail_more_ = memory.tail_more;
  double target_m = 0;
  Penetration answer;
  if (is_soft) answer = summed_again(query, memory.cells, target_m);
  if (!answer.is_known()) answer = searched(query, memory, target_m);
  if (answer.is_known() && is_soft && !query.wants_hessian &&
      !memory.was_tail_enough(search_.best_m(), answer.depth_m, query.soft_width_m)) {
    tail_more_ = memory.tail_more;
    answer = searched(query, memory, target_m);
  }
  if (!answer.is_known()) return answer;
  const glm::dvec2 Q{answer.p_CQ_C};
  if (search_.s().has_several_layers_at(Q) || search_.t().has_several_layers_at(Q)) answer.doubts |= kSeveralLayers;
  memory.p_TQ = spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C);
  if (query.wants_hessian || !is_soft) {
    memory.step_for(query) = std::max(next_step_m(search_.step_m(), target_m), kLeastStep_m);
  } else {
    memory.step_m = search_.step_m();
  }
  return answer;
}

std::unique_ptr<BackEnd> make_simd(const Limits& limits, InstructionSet set) {
  return std::make_unique<SimdBackEnd>(limits, kernels_of(set));
}

void hold_best_to(InstructionSet set) noexcept {
  widest.store(set, std::memory_order_relaxed);
}

const simd::Kernels& simd_kernels(InstructionSet set) {
  return kernels_of(set);
}

std::string_view instruction_set_name(InstructionSet set) {
  return kernels_of(set).name;
}

}  // namespace farfeel::penetration
