// The fast back end: the reference's method in float, a vector of nodes at a time.
#pragma once

#include <string_view>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

enum class InstructionSet { kBest, kAvx512, kAvx2, kPlain };

/// Soft and hard maxima, with second derivatives where asked; raw grids (Query::refines false) are answered by the
/// reference it carries. What the machine lacks falls back to the next narrower set; all sets agree within 20 nm and
/// 1e-3 of the direction. The query's window is a limit only: the search ends at the contact's own extent, and
/// Query::samples bounds the number of cells along a side that it starts from. Time follows the area within some soft
/// widths of the peak. The soft maximum is summed over a lattice that S's origin holds, with a step that is kept while
/// it suits: with S held in C, the gradient is the derivative of the depth (1e-3), however coarse the sum. Where more
/// touches than can be summed, some of it is drawn by lot to stand for all, and kCoarseSteps is set where the draw's
/// spread says that the depth may be off by more than 0.5 um and 0.5 %. What is apart by more than 0.3 mm for certain
/// is summed coarsely and has no such flag. C's axes should be off those of S's texture: a lattice along a periodic
/// texture meets the same phases again and again. What is remembered of a contact's last answers (Query::contact) saves
/// most of the time, as long as the contact moves by less than a peak's width from answer to answer. A search begins
/// with nothing of it but how far the tail reaches: so a contact that has slid to a pose and one that is asked afresh
/// there differ by less than 0.5 um or 0.5 %, or say so.
[[nodiscard]] std::unique_ptr<BackEnd> make_simd(const Limits&, InstructionSet = InstructionSet::kBest);

/// From now on kBest is no wider than this, in the whole process: each set rounds its own way, so a program that
/// compares runs to the last bit holds all machines to one.
void hold_best_to(InstructionSet) noexcept;

/// "avx512", "avx2" or "plain": what make_simd would take on this machine.
[[nodiscard]] std::string_view instruction_set_name(InstructionSet = InstructionSet::kBest);

namespace simd {
struct Kernels;
}  // namespace simd
/// Likewise, its loops.
[[nodiscard]] const simd::Kernels& simd_kernels(InstructionSet = InstructionSet::kBest);

}  // namespace farfeel::penetration
