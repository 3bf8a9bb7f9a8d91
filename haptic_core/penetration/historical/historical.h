// The algorithm of the source, through EGL, to be compared with: Otaduy, Jain, Sud and Lin 2004, section 5. Both
// patches are rendered orthographically along the direction into 16-bit depth buffers, S where it is outermost and T
// where it is innermost; their difference is taken at every pixel and its maximum found by reduction; the gradient
// comes from eleven such evaluations.
//
// What the text leaves open is done the plain way: a fragment looks its height up once, where its coarse point lies
// over the chart; the depth range is the patches' own within the window; the eleven evaluations lie beside each other
// in one buffer; steps are those of eleven_evaluations.h.
#pragma once

#include <tl/expected.hpp>

#include "haptic_core/headless_gl/headless_context.h"
#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/reference/eleven_evaluations.h"

namespace farfeel::penetration::historical {

/// Always the hard maximum of the raw N x N grid, whatever soft width the query asks for; no Hessian. Waits for the
/// device, contact by contact, and reads pixels back, as its model did: a comparator, not realtime-safe. Surfaces that
/// prepare() was not given, and patches too large for its buffers, are answered by the reference's grid, eleven times.
/// prepare() before the first evaluate(), which binds the context to its thread.
[[nodiscard]] tl::expected<std::unique_ptr<BackEnd>, headless_gl::Failure> make_historical(
    const Limits&, const DifferenceSteps& = {}, const std::string& vendor = {});

/// For ContactOptions::maker. Where no context can be had it makes the reference, grid by grid.
[[nodiscard]] BackEndMaker historical_maker();

}  // namespace farfeel::penetration::historical
