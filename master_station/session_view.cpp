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
constexpr const char* kArmed = "take hold of the handle anew, and force comes back in a ramp";

codecs::ViewTone tone_of(LoopState state) {
  switch (state) {
    case LoopState::kHeld:
    case LoopState::kFading:
    case LoopState::kFault:
      return codecs::ViewTone::kTrouble;
    case LoopState::kPaused:
      return codecs::ViewTone::kNotice;
    default:
      return codecs::ViewTone::kQuiet;
  }
}

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

void tell_view(SessionFeed& feed, const HapticLoop& loop, MasterSession& session, const SessionDevices& devices,
               const codecs::SceneDescription& scene) {
  using codecs::ViewTone;
  const LoopState state = loop.state();
  const Fault fault = loop.fault();
  const LinkReport link = session.report();
  codecs::ViewStatus status;
  status.is_paused = loop.is_paused();
  status.tone = tone_of(state);
  // Messages say what happened; then, after a semicolon, what that means and what to do.
  const std::string told(state == LoopState::kFault ? message(fault) : message(state));
  const std::size_t cut = told.find("; ");
  status.happened = told.substr(0, cut);
  if (cut != std::string::npos) status.to_do = told.substr(cut + 2);
  if (const std::string how = devices.waits_for(); status.tone == ViewTone::kQuiet && !how.empty()) {
    status.tone = ViewTone::kNotice;
    status.happened = "force is off: no hand has asked the device for it";
    status.to_do = how;
  }
  if (const std::string why = session.trouble(); !why.empty()) status.to_do += (status.to_do.empty() ? "" : "; ") + why;
  const auto ms = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.2f} ms", value) : std::string("-");
  };
  status.words.emplace_back("Device", devices.in_words());
  status.words.emplace_back("Link", session.way());
  status.words.emplace_back("Network, there and back",
                            fmt::format("{}, 99 % within {}", ms(link.round_trip.p50_ms), ms(link.round_trip.p99_ms)));
  BesideTicks beside;
  beside.courses = session.courses();
  beside.fault = static_cast<std::uint8_t>(fault);
  beside.view_yaw_rad = devices.view_yaw_rad();
  if (link.round_trip.samples > 0) beside.network_ms = link.round_trip.p50_ms;
  if (link.slave) {
    beside.node_ms = 1e-3 * link.slave->contact_us_p50;
    status.words.emplace_back("Remote node", fmt::format("{:.0f} answers a second, {:.0f} us each",
                                                         link.slave->contact_hz, link.slave->contact_us_p50));
  }
  status.words.emplace_back("Session", fmt::format("scene {}, {} tiles here", scene.name, link.tiles));
  feed.tell(status, beside);
}

codecs::ViewAnswer obey(codecs::ViewVerb verb, HapticLoop& loop) {
  const auto done = [&](std::string words) { return codecs::ViewAnswer{verb, true, std::move(words)}; };
  const auto refused = [&](std::string words) { return codecs::ViewAnswer{verb, false, std::move(words)}; };
  const bool is_paused = loop.is_paused(), is_faulty = loop.fault() != Fault::kNone;
  switch (verb) {
    case codecs::ViewVerb::kResetFault:
      if (!is_faulty) return refused("there is no fault to reset");
      loop.reset_fault();
      return done(is_paused ? "the fault is reset; the session is paused still"
                            : std::string("the fault is reset; ") + kArmed);
    case codecs::ViewVerb::kPause:
      loop.pause(true);
      return done("paused: the force fades, and stays off until the session is resumed");
    case codecs::ViewVerb::kResume:
      if (!is_paused) return refused("the session is not paused");
      loop.pause(false);
      return done(is_faulty ? "resumed, but a fault keeps the force off: reset it" : std::string("resumed; ") + kArmed);
    case codecs::ViewVerb::kRecentre:
      if (!is_paused) return refused("not recentred, for the hand holds the tool: pause the session first");
      if (is_faulty) return refused("not recentred: reset the fault first");
      loop.recentre();
      return done(
          "the tool goes back to where it began, as far as surfaces let it; once resumed, the handle holds it there "
          "from wherever that is now");
  }
  return refused("nobody understands that");
}

}  // namespace farfeel::master_station
