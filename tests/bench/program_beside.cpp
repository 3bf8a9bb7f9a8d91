#include "tests/bench/program_beside.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace farfeel::bench {

void become_program_beside(const std::string& name, std::vector<std::string> arguments) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").replace_filename(name).string();
  std::vector<char*> words{const_cast<char*>(program.c_str())};
  for (std::string& word : arguments) words.push_back(word.data());
  words.push_back(nullptr);
  ::execv(program.c_str(), words.data());
  fmt::print(stderr, "could not start {}: {}\n", program, std::strerror(errno));
}

}  // namespace farfeel::bench
