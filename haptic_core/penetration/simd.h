// The fast back end: the reference's method in float, a vector of nodes at a time.
#pragma once

#include <string_view>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

enum class InstructionSet { kBest, kAvx512, kAvx2, kPlain };

/// Soft maxima, with second derivative where asked; the hard maximum is answered by the reference it carries. What the
/// machine lacks falls back to the next narrower set; all sets agree within 20 nm and 1e-3 of the direction. The
/// query's window is a limit only: the search ends at the contact's own extent, and Query::samples bounds the number of
/// cells along a side that it starts from. Wall times follow the area within some soft widths of the peak.
[[nodiscard]] std::unique_ptr<BackEnd> make_simd(const Limits&, InstructionSet = InstructionSet::kBest);

/// "avx512", "avx2" or "plain": what make_simd would take on this machine.
[[nodiscard]] std::string_view instruction_set_name(InstructionSet = InstructionSet::kBest);

}  // namespace farfeel::penetration
