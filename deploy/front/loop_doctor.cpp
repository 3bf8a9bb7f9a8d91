#include "deploy/front/loop_doctor.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

namespace farfeel::front {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastRealTime = 0.95;  // the kernel's own share: a loop that spins on a core takes nearly as much

std::string line_of(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

Finding governor(const MachineRoot& root) {
  std::set<std::string> names;
  std::error_code none;
  for (const fs::directory_entry& cpu : fs::directory_iterator(root.folder + "/sys/devices/system/cpu", none))
    if (const std::string name = line_of(cpu.path() / "cpufreq/scaling_governor"); !name.empty()) names.insert(name);
  if (names.empty()) return {"clock governor", Health::kGood, "none to be seen (fixed, or a virtual machine)", ""};
  std::string seen;
  for (const std::string& name : names) seen += (seen.empty() ? "" : ", ") + name;
  if (names == std::set<std::string>{"performance"}) return {"clock governor", Health::kGood, seen, ""};
  return {"clock governor", Health::kLimited, seen,
          "a core that slept is slow to wake; as root: cpupower frequency-set --governor performance (Debian's "
          "linux-cpupower)"};
}

// Nothing is wrong without: it is what is left to do where ticks are late all the same.
Finding isolated_cores(const MachineRoot& root) {
  const std::string cores = line_of(root.folder + "/sys/devices/system/cpu/isolated");
  if (cores.empty())
    return {"isolated cores", Health::kGood,
            "none; where ticks stay late, boot with  isolcpus=N  (in GRUB_CMDLINE_LINUX of /etc/default/grub, then "
            "update-grub), and start with  taskset -c N",
            ""};
  return {"isolated cores", Health::kGood, fmt::format("{}; start the master with  taskset -c {}", cores, cores), ""};
}

Finding throttle(const MachineRoot& root) {
  const std::string folder = root.folder + "/proc/sys/kernel/sched_rt_";
  const std::string runtime = line_of(folder + "runtime_us"), period = line_of(folder + "period_us");
  if (runtime.empty() || period.empty()) return {"real-time throttle", Health::kGood, "the kernel tells of none", ""};
  const double runtime_us = std::strtod(runtime.c_str(), nullptr), period_us = std::strtod(period.c_str(), nullptr);
  if (runtime_us < 0) return {"real-time throttle", Health::kGood, "off", ""};
  const double share = period_us > 0 ? runtime_us / period_us : 0;
  const std::string seen =
      fmt::format("real-time threads get {:.0f} % of each {:.0f} ms", 100 * share, 1e-3 * period_us);
  if (share >= kLeastRealTime) return {"real-time throttle", Health::kGood, seen, ""};
  return {"real-time throttle", Health::kLimited, seen,
          "the loop stands still for the rest; as root: sysctl kernel.sched_rt_runtime_us=950000 "
          "kernel.sched_rt_period_us=1000000"};
}

}  // namespace

std::vector<Finding> examine_loop(const MachineRoot& root) {
  return {governor(root), isolated_cores(root), throttle(root)};
}

}  // namespace farfeel::front
