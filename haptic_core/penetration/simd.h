// The fast back end: the reference's method in float, a vector of nodes at a time.
#pragma once

#include <string_view>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

enum class InstructionSet { kBest, kAvx512, kAvx2, kPlain };

/// Soft maxima only: the hard maximum, and whoever wants the Hessian, is answered by the reference it carries. What the
/// machine lacks falls back to the next narrower set.
[[nodiscard]] std::unique_ptr<BackEnd> make_simd(const Limits&, InstructionSet = InstructionSet::kBest);

/// "avx512", "avx2" or "plain": what make_simd would take on this machine.
[[nodiscard]] std::string_view instruction_set_name(InstructionSet = InstructionSet::kBest);

}  // namespace farfeel::penetration
