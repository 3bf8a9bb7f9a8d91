#include "deploy/front/build_tree.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "deploy/front/elapsed.h"

namespace farfeel::front {
namespace {

/// Runs it with standard error as its standard output, and waits for it.
tl::expected<void, FrontError> run_to_the_end(std::vector<std::string> words, const std::string& told) {
  std::vector<char*> raw;
  for (std::string& word : words) raw.push_back(word.data());
  raw.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  pid_t pid = -1;
  const int failed = posix_spawnp(&pid, raw[0], &actions, nullptr, raw.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return tl::unexpected(FrontError{fmt::format("could not run {}: {}", told, std::strerror(failed))});
  int status = 0;
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) return tl::unexpected(FrontError{fmt::format("{}: {}", told, std::strerror(errno))});
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return tl::unexpected(FrontError{fmt::format("this failed, and said why above: {}", told)});
  return {};
}

}  // namespace

tl::expected<void, FrontError> bring_up_to_date(const std::string& name, const std::string& bin_folder) {
  const std::filesystem::path tree = std::filesystem::path(bin_folder).parent_path();
  std::error_code error;
  if (!std::filesystem::exists(tree / "CMakeCache.txt", error)) return {};
  if (access((bin_folder + "/" + name).c_str(), X_OK) != 0)
    fmt::print(stderr, "building {}: minutes the first time, seconds later\n", name);
  const Elapsed elapsed("building " + name);
  return run_to_the_end({"cmake", "--build", tree, "--target", name, "--", "--quiet"},
                        fmt::format("cmake --build {} --target {}", tree.string(), name));
}

}  // namespace farfeel::front
