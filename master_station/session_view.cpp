#include "master_station/session_view.h"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <thread>

extern char** environ;  // posix_spawn's

namespace farfeel::master_station {
namespace {

constexpr std::chrono::milliseconds kLook{10};  // it needs a tenth of a second to end
constexpr int kLooks = 100;                     // and is ended after a second

}  // namespace

ViewProcess::ViewProcess(bool is_wanted) {
  if (!is_wanted) return;
  std::error_code error;
  const std::string program =
      (std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "farfeel-view").string();
  const std::string session = std::to_string(::getpid());
  std::array<const char*, 5> arguments{program.c_str(), "--with-parent", "--session", session.c_str(), nullptr};
  // A group of its own: Ctrl-C in a terminal ends the station, which ends this. No signal blocked.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  const int failed =
      ::posix_spawn(&pid_, program.c_str(), nullptr, &attributes, const_cast<char* const*>(arguments.data()), environ);
  posix_spawnattr_destroy(&attributes);
  if (failed == 0) return;
  pid_ = -1;
  spdlog::warn("no live view: {} could not be started: {}", program, std::strerror(failed));
}

ViewProcess::~ViewProcess() {
  if (pid_ < 0) return;
  // A station never waits for its view for long.
  ::kill(pid_, SIGTERM);
  for (int look = 0; look < kLooks && ::waitpid(pid_, nullptr, WNOHANG) == 0; ++look) {
    if (look + 1 == kLooks) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    } else {
      std::this_thread::sleep_for(kLook);
    }
  }
}

void tell_view(SessionFeed& feed, const HapticLoop& loop, MasterSession& session,
               const codecs::SceneDescription& scene) {
  const LoopState state = loop.state();
  const Fault fault = loop.fault();
  const LinkReport link = session.report();
  codecs::ViewStatus status;
  status.is_trouble = state == LoopState::kHeld || state == LoopState::kFading || state == LoopState::kFault;
  // Messages say what happened; then, after a semicolon, what that means and what to do.
  const std::string told(state == LoopState::kFault ? message(fault) : message(state));
  const std::size_t cut = told.find("; ");
  status.happened = told.substr(0, cut);
  if (cut != std::string::npos) status.to_do = told.substr(cut + 2);
  if (const std::string why = session.trouble(); !why.empty()) status.to_do += (status.to_do.empty() ? "" : "; ") + why;
  const auto ms = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.2f} ms", value) : std::string("-");
  };
  status.words.emplace_back("Link", session.way());
  status.words.emplace_back("Network, there and back",
                            fmt::format("{}, 99 % within {}", ms(link.round_trip.p50_ms), ms(link.round_trip.p99_ms)));
  RoundTripStages stages;
  if (link.round_trip.samples > 0) stages.network_ms = link.round_trip.p50_ms;
  if (link.slave) {
    stages.node_ms = 1e-3 * link.slave->contact_us_p50;
    status.words.emplace_back("Remote node", fmt::format("{:.0f} answers a second, {:.0f} us each",
                                                         link.slave->contact_hz, link.slave->contact_us_p50));
  }
  status.words.emplace_back("Session", fmt::format("scene {}, {} tiles here", scene.name, link.tiles));
  feed.tell(status, static_cast<std::uint8_t>(fault), stages);
}

void obey(codecs::ViewVerb verb, HapticLoop& loop) {
  if (verb == codecs::ViewVerb::kResetFault) loop.reset_fault();
}

}  // namespace farfeel::master_station
