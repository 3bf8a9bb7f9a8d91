// `farfeel config`: what is set for which program and where, what is wrong with it, and docs/options.md. All of it is
// asked of the programs themselves, whose registered options are the only list.
#pragma once

#include <span>
#include <string_view>

namespace farfeel::front {

/// programs: what `farfeel NAME` runs. Exit status: 0, or 2 where a setting is wrong.
[[nodiscard]] int config_command(int argc, char** argv, std::span<const std::string_view> programs);

}  // namespace farfeel::front
