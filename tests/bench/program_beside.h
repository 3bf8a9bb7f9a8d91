// Measurements that need a program of their own: built beside farfeel-bench, and run by it.
#pragma once

#include <string>
#include <vector>

namespace farfeel::bench {

/// This process becomes that program, in the folder of this one, with those arguments. Returns where it can't, and has
/// said why to standard error.
void become_program_beside(const std::string& name, std::vector<std::string> arguments);

}  // namespace farfeel::bench
