#include "deploy/front/doctor.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "deploy/front/child.h"
#include "deploy/front/device_doctor.h"
#include "deploy/front/loop_doctor.h"
#include "haptic_core/realtime/histogram.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/display/picture.h"
#include "master_station/report/this_machine.h"

namespace farfeel::front {
namespace {

double microseconds(const realtime::Histogram& times, double share) {
  return static_cast<double>(times.quantile_ns(share)) * 1e-3;
}

constexpr const char* kRealTimeLimits =
    "as root, put \"@audio - rtprio 80\" and \"@audio - memlock unlimited\" in /etc/security/limits.d/farfeel.conf, "
    "join "
    "that group and log in again";

Finding processor() {
  const master_station::Machine m = master_station::this_machine("");
  const unsigned usable = std::max(1u, std::thread::hardware_concurrency());
  Finding finding{"processor", Health::kGood, fmt::format("{}, {} cores", m.cpu.empty() ? "unknown" : m.cpu, usable),
                  ""};
  if (usable < 4) {
    finding.health = Health::kLimited;
    finding.remedy =
        "both stations on one machine want 4 cores: the loop spins on one while the contact service works on another";
  }
  return finding;
}

Finding simd() {
#if defined(__x86_64__)
  std::string sets;
  for (const auto& [has, name] :
       {std::pair(__builtin_cpu_supports("avx2"), "AVX2"), std::pair(__builtin_cpu_supports("fma"), "FMA"),
        std::pair(__builtin_cpu_supports("avx512f"), "AVX-512")})
    if (has) sets += fmt::format("{}{}", sets.empty() ? "" : ", ", name);
  if (__builtin_cpu_supports("avx2")) return {"vector instructions", Health::kGood, sets, ""};
  return {"vector instructions", Health::kLimited, sets.empty() ? "SSE2 only" : sets,
          "contacts will be computed by the narrow path, several times slower"};
#else
  return {"vector instructions", Health::kGood, "this architecture's baseline", ""};
#endif
}

// Tried on a thread of its own: this one keeps its ordinary priority.
Finding real_time_scheduling() {
  int error = 0;
  std::thread([&error] {
    const sched_param priority{80};
    error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  }).join();
  if (error == 0) return {"real-time scheduling", Health::kGood, "SCHED_FIFO 80 is allowed", ""};
  return {"real-time scheduling", Health::kLimited, fmt::format("SCHED_FIFO is refused: {}", std::strerror(error)),
          fmt::format("the loop runs at ordinary priority and will be late now and then; {}", kRealTimeLimits)};
}

Finding memory_lock() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const bool is_root = geteuid() == 0;
  if (is_root || limit.rlim_cur == RLIM_INFINITY) return {"memory lock", Health::kGood, "unlimited", ""};
  constexpr rlim_t kEnough = 256u << 20;
  const std::string seen = fmt::format("{} MiB may be locked", limit.rlim_cur >> 20);
  if (limit.rlim_cur >= kEnough) return {"memory lock", Health::kGood, seen, ""};
  return {"memory lock", Health::kLimited, seen, fmt::format("a page fault may delay a tick; {}", kRealTimeLimits)};
}

Finding timer_slack() {
  const int slack_ns = prctl(PR_GET_TIMERSLACK);
  return {"timer slack", Health::kGood, fmt::format("{} us, the loop asks for 1 ns", slack_ns / 1000.0), ""};
}

Finding offscreen_graphics() {
  const auto renderer = master_station::offscreen_renderer();
  if (renderer) return {"offscreen graphics", Health::kGood, *renderer, ""};
  return {"offscreen graphics", Health::kLimited, renderer.error().message,
          "reports come without pictures; deploy/install-packages run"};
}

Finding loopback_udp() {
  const auto broken = [](const char* what) {
    return Finding{"UDP on loopback", Health::kMissing, fmt::format("{}: {}", what, std::strerror(errno)),
                   "the two stations can't talk: see that the interface lo is up and that no sandbox forbids sockets"};
  };
  const Descriptor a(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), b(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!a.is_open() || !b.is_open()) return broken("socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(b.number(), generic, size) != 0 || getsockname(b.number(), generic, &size) != 0) return broken("bind");
  const timeval timeout{1, 0};
  setsockopt(b.number(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  realtime::Histogram flight_ns;
  for (int i = 0; i < 200; ++i) {
    std::array<char, 256> datagram{};
    const std::int64_t before_ns = realtime::monotonic_now_ns();
    if (sendto(a.number(), datagram.data(), datagram.size(), 0, generic, size) < 0) return broken("sendto");
    if (recv(b.number(), datagram.data(), datagram.size(), 0) < 0) return broken("recv");
    flight_ns.add(realtime::monotonic_now_ns() - before_ns);
  }
  return {"UDP on loopback", Health::kGood,
          fmt::format("send and receive take {:.1f} us (median)", microseconds(flight_ns, 0.5)), ""};
}

// Where slave_sim/bake/asset_cache.h keeps assets.
std::string cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return std::string(cache) + "/farfeel";
  if (const char* home = std::getenv("HOME"); home && *home) return std::string(home) + "/.cache/farfeel";
  return std::filesystem::temp_directory_path().string() + "/farfeel";
}

Finding cache() {
  const std::string folder = cache_folder();
  std::error_code error;
  std::filesystem::path existing = folder;
  while (!std::filesystem::exists(existing, error) && existing.has_relative_path()) existing = existing.parent_path();
  if (access(existing.c_str(), W_OK) != 0)
    return {"cache for assets", Health::kMissing, fmt::format("{} can't be written", folder),
            "set XDG_CACHE_HOME to a folder that can"};
  const auto space = std::filesystem::space(existing, error);
  const double free_GB = static_cast<double>(space.available) * 1e-9;
  Finding finding{"cache for assets", Health::kGood, fmt::format("{}, {:.0f} GB free", folder, free_GB), ""};
  if (free_GB < 1) {
    finding.health = Health::kLimited;
    finding.remedy = "a scene's assets take some 100 MB: make room, or set XDG_CACHE_HOME";
  }
  return finding;
}

// One second of the haptic loop's own waiting.
Finding loop_jitter() {
  realtime::PeriodicStatistics statistics;
  std::thread([&statistics] {
    std::atomic<bool> stop{false};
    int ticks = 0;
    realtime::run_periodically({}, stop, statistics, [&](const realtime::TickTiming&) { stop = ++ticks == 1000; });
  }).join();
  const realtime::Histogram& late = statistics.wake_ns;
  const double p99_us = microseconds(late, 0.99);
  const std::string seen = fmt::format("p50 {:.1f}, p99 {:.1f}, max {:.0f} us late in 1000 ticks at 1 kHz",
                                       microseconds(late, 0.5), p99_us, microseconds(late, 1));
  if (p99_us < 100) return {"loop jitter", Health::kGood, seen, ""};
  return {"loop jitter", Health::kLimited, seen,
          "close what else is busy, allow SCHED_FIFO, or use a kernel with PREEMPT_RT (Debian's linux-image-rt-amd64)"};
}

Finding programs() {
  std::string missing;
  for (const char* name : {"farfeel-slave", "farfeel-master", "farfeel-device", "farfeel-link", "farfeel-bake"})
    if (!sibling(name)) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", name);
  if (missing.empty()) return {"programs", Health::kGood, own_folder(), ""};
  return {"programs", Health::kMissing, fmt::format("not in {}: {}", own_folder(), missing),
          "deploy/run builds them all"};
}

}  // namespace

std::vector<Finding> examine_this_machine() {
  std::vector<Finding> findings{
      processor(),    simd(),  real_time_scheduling(), memory_lock(), timer_slack(), offscreen_graphics(),
      loopback_udp(), cache(), loop_jitter(),          programs()};
  for (Finding& finding : examine_loop(this_machine_root())) findings.push_back(std::move(finding));
  for (Finding& finding : examine_devices(this_machine_root())) findings.push_back(std::move(finding));
  return findings;
}

int tell_findings(const std::vector<Finding>& findings, bool as_json, const std::string& all_there,
                  const std::string& else_words) {
  const bool is_all_there =
      std::ranges::none_of(findings, [](const Finding& f) { return f.health == Health::kMissing; });
  const auto word = [](Health health) {
    return health == Health::kGood ? "ok" : health == Health::kLimited ? "limited" : "missing";
  };
  if (as_json) {
    nlohmann::json all = nlohmann::json::array();
    for (const Finding& f : findings)
      all.push_back({{"what", f.what}, {"health", word(f.health)}, {"seen", f.seen}, {"remedy", f.remedy}});
    fmt::print("{}\n", nlohmann::json{{"is_all_there", is_all_there}, {"findings", std::move(all)}}.dump(2));
    return is_all_there ? 0 : 1;
  }
  const bool is_coloured = isatty(STDOUT_FILENO) != 0 && !std::getenv("NO_COLOR");
  for (const Finding& finding : findings) {
    const char* colour = finding.health == Health::kGood ? "32" : finding.health == Health::kLimited ? "33" : "31";
    const std::string padded = fmt::format("{:<8}", word(finding.health));
    fmt::print("{} {:<21} {}\n", is_coloured ? fmt::format("\033[{}m{}\033[0m", colour, padded) : padded, finding.what,
               finding.seen);
    if (!finding.remedy.empty()) fmt::print("{:<31}-> {}\n", "", finding.remedy);
  }
  fmt::print("\n{}\n", is_all_there ? all_there : else_words);
  return is_all_there ? 0 : 1;
}

}  // namespace farfeel::front
