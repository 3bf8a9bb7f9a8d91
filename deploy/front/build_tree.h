// Programs that deploy/run does not build, and that are built when somebody asks for them.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "deploy/front/child.h"

namespace farfeel::front {

/// Builds the target `name` where `bin_folder` is the bin folder of a build tree, which takes a moment when nothing has
/// changed; what the build says goes to standard error. Elsewhere there is nothing to do. An error when the build
/// fails.
[[nodiscard]] tl::expected<void, FrontError> bring_up_to_date(const std::string& name, const std::string& bin_folder);

}  // namespace farfeel::front
