// Fitted from above to what was measured (docs/measured.md): a base, what each triangle takes while edges are looked up
// and collapsed, and what each texel takes with its height, its place and its share of the felt mesh.
#include "slave_sim/bake/foreseen.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace farfeel::slave_sim {
namespace {

constexpr double kBase = 250e6, kPerTriangle = 600, kPerTexel = 32;           // bytes
constexpr double kBase_s = 1.5, kPerTriangle_s = 2.5e-6, kPerTexel_s = 4e-7;  // of one bake
constexpr double kOncePerTriangle_s = 1.2e-5;  // to read and mend, and to simplify at first
constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// What the machine has to give, as the kernel says.
double available_bytes() {
  std::ifstream file("/proc/meminfo");
  std::string key;
  double kilobytes = 0;
  while (file >> key >> kilobytes) {
    if (key == "MemAvailable:") return 1024 * kilobytes;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return kUnknown;
}

double limit_bytes() {
  rlimit space{};
  const bool is_limited = getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY;
  return is_limited ? static_cast<double>(space.rlim_cur) : kUnknown;
}

}  // namespace

Foreseen foreseen(std::size_t triangles, std::uint32_t texture, int bakes) {
  const double n = static_cast<double>(triangles), texels = 1.0 * texture * texture;
  return {.bytes = kBase + kPerTriangle * n + kPerTexel * texels,
          .seconds = kOncePerTriangle_s * n + bakes * (kBase_s + kPerTriangle_s * n + kPerTexel_s * texels)};
}

double memory_there() {
  return std::min(available_bytes(), limit_bytes());
}

std::optional<std::uint32_t> texture_within(double bytes, std::size_t triangles, std::uint32_t most) {
  constexpr std::uint32_t kLeast = 256;
  for (std::uint32_t texture = most; texture >= kLeast; texture /= 2) {
    if (foreseen(triangles, texture, 1).bytes <= bytes) return texture;
  }
  return std::nullopt;
}

std::optional<std::string> words_about_memory(const Foreseen& foreseen) {
  const double has = available_bytes(), may = limit_bytes(), least = std::min(has, may);
  if (foreseen.bytes <= least) return std::nullopt;
  return fmt::format(
      "it may take {:.2g} GB of memory, and {} {:.2g} GB; a smaller --texture or fewer triangles in the file take less",
      foreseen.bytes / 1e9, may < has ? "its limit (ulimit -v) is" : "the machine has", least / 1e9);
}

std::string in_words(const Foreseen& foreseen) {
  const double s = foreseen.seconds;
  return fmt::format("{:.2g} GB and about {}", foreseen.bytes / 1e9,
                     s < 90 ? fmt::format("{:.0f} s", s) : fmt::format("{:.0f} min", s / 60));
}

}  // namespace farfeel::slave_sim
