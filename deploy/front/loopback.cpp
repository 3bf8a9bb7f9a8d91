#include "deploy/front/loopback.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>

#include "codecs/settings/command_line.h"
#include "codecs/settings/stop_signals.h"
#include "deploy/front/child.h"
#include "deploy/front/line_reader.h"
#include "deploy/front/progress.h"
#include "master_station/report/report_page.h"
#include "master_station/report/run_folder.h"
#include "transport/link/link_spec.h"

namespace farfeel::front {
namespace {

constexpr double kReadyTimeout_s = 600;   // the first run bakes the scene's assets
constexpr double kFinishTimeout_s = 120;  // drawing in software on a busy machine takes a while
constexpr const char* kRuns = "out/loopback";
constexpr const char* kAnyPort = "127.0.0.1:0";
constexpr const char* kNoSettings = "--no-settings";  // the stations do what this command was told, and nothing else

// One line that is written over in a terminal; elsewhere a line now and then.
class ProgressLine {
 public:
  void show(const Progress& progress) {
    if (is_terminal_) {
      fmt::print("\r\033[K{}", shown(progress));
      std::fflush(stdout);
      is_open_ = true;
    } else if (progress.t_s >= next_s_) {
      fmt::print("{}\n", shown(progress));
      std::fflush(stdout);
      next_s_ = progress.t_s + 5;
    }
  }
  void end() {
    if (is_open_) fmt::print("\n");
    is_open_ = false;
  }

 private:
  bool is_terminal_ = isatty(STDOUT_FILENO) != 0;
  bool is_open_ = false;
  double next_s_ = 0;
};

// What asks to stop, as something to poll.
class StopSignal {
 public:
  StopSignal() {
    const sigset_t stops = codecs::hold_stop_signals();
    descriptor_ = Descriptor(signalfd(-1, &stops, SFD_CLOEXEC | SFD_NONBLOCK));
  }
  [[nodiscard]] int number() const { return descriptor_.number(); }
  [[nodiscard]] bool has_come() const {
    pollfd wait{number(), POLLIN, 0};
    return poll(&wait, 1, 0) == 1;
  }
  void take() const {
    signalfd_siginfo info{};
    while (read(number(), &info, sizeof info) > 0) codecs::leave_terminal_after(static_cast<int>(info.ssi_signo));
  }

 private:
  Descriptor descriptor_;
};

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int say(const FrontError& error) {
  fmt::print(stderr, "farfeel: {}\n", error.message);
  return 1;
}

int say(const FrontError& error, Child& child) {
  const int status = say(error);
  fmt::print(stderr, "{}", child.obituary());
  return status;
}

// Starting takes a moment, and longer where a scene is used for the first time: one line, which gets a dot now and then
// in a log, and is written over and gone in the end on a terminal.
class BakingLine {
 public:
  void show(int waited_s) {
    constexpr int kLonger_s = 3, kAgain_s = 8;
    if (is_terminal_)
      fmt::print("\r\033[K{} s{}{}", waited_s, waited_s < kLonger_s ? "" : ": ", waited_s < kLonger_s ? "" : kWords);
    else if (told_s_ == 0 ? waited_s >= kLonger_s : waited_s - told_s_ >= kAgain_s)
      fmt::print("{}", told_s_ == 0 ? kWords : " ."), told_s_ = waited_s;
    std::fflush(stdout);
  }
  void end() const {
    if (is_terminal_) fmt::print("\r\033[K");
    if (told_s_ > 0) fmt::print("\n");
    std::fflush(stdout);
  }

 private:
  static constexpr const char* kWords = "models are baked the first time they are used";
  bool is_terminal_ = isatty(STDOUT_FILENO) != 0;
  int told_s_ = 0;
};

struct Ending {
  bool was_stopped = false, has_failed = false;
};

// A shell, ssh and a service manager may send one stop as several signals: those that come together are one.
constexpr double kSameStop_s = 1;

// Until the master has ended. A stop signal is handed to it; a later one kills it. When another child dies, the master
// is asked to finish with what it has.
Ending watch(Child& master, const std::vector<Child*>& others, const StopSignal& stop) {
  Ending ending;
  ProgressLine progress;
  LineReader lines;
  std::optional<double> deadline_s, stopped_s;
  const auto finish = [&] {
    master.signal(SIGINT);
    if (!deadline_s) deadline_s = now_s() + kFinishTimeout_s;
  };
  std::vector<bool> is_mourned(others.size());
  bool has_output = true;
  while (!master.status()) {
    std::vector<pollfd> wait = {
        {stop.number(), POLLIN, 0}, {has_output ? master.output_fd() : -1, POLLIN, 0}, {master.ended_fd(), POLLIN, 0}};
    for (std::size_t i = 0; i < others.size(); ++i)
      wait.push_back({is_mourned[i] ? -1 : others[i]->ended_fd(), POLLIN, 0});
    poll(wait.data(), wait.size(), 1000);

    if (wait[1].revents != 0)
      has_output = lines.read_lines(master.output_fd(), [&](std::string_view line) {
        if (const auto p = progress_from(line)) progress.show(*p);
        if (line.starts_with("note: ")) {
          progress.end();
          fmt::print("mind: {}\n", line.substr(6));
        }
        if (line.starts_with("view: ")) {
          progress.end();
          fmt::print("see it live: {}\n", line.substr(6));
          std::fflush(stdout);
        }
      });
    if (wait[0].revents != 0) {
      stop.take();
      progress.end();
      if (stopped_s && now_s() - *stopped_s < kSameStop_s) continue;
      if (ending.was_stopped) {
        fmt::print("stopping at once\n");
        master.signal(SIGKILL);
      } else {
        fmt::print("stopping: writing a report of what there is (Ctrl-C again to stop at once)\n");
        finish();
      }
      std::fflush(stdout);
      ending.was_stopped = true;
      if (!stopped_s) stopped_s = now_s();
    }
    for (std::size_t i = 0; i < others.size(); ++i) {
      if (is_mourned[i] || !others[i]->status()) continue;
      is_mourned[i] = true;
      ending.has_failed = true;
      progress.end();
      fmt::print(stderr, "farfeel: {}", others[i]->obituary());
      finish();
    }
    if (deadline_s && now_s() > *deadline_s) {
      progress.end();
      fmt::print(stderr, "farfeel: {} did not finish within {:.0f} s and is killed\n", master.name(), kFinishTimeout_s);
      master.signal(SIGKILL);
      deadline_s = now_s() + kFinishTimeout_s;
    }
  }
  progress.end();
  return ending;
}

// A busy machine may let datagrams go later than the link was asked to: its delays are no measurement then.
void tell_of_late_link(Child& link, const std::string& log) {
  link.end();
  constexpr std::string_view kVerdict = "this run is invalid: ";
  std::ifstream said(log);
  for (std::string line; std::getline(said, line);) {
    if (const auto at = line.find(kVerdict); at != std::string::npos)
      fmt::print("the link was late itself: {}; delays and losses of this run are not those asked for\n",
                 line.substr(at + kVerdict.size()));
  }
}

}  // namespace

int run_loopback(const LoopbackWishes& wishes) {
  // Before anything is baked or begun: farfeel-link comes after the scene.
  if (const auto link = transport::parse_link_spec(wishes.link); !wishes.link.empty() && !link) {
    (void)say(FrontError{"--link: " + link.error().message});
    return codecs::kUsageError;
  }
  const auto folder = master_station::RunFolder::of(wishes.out, kRuns);
  if (!folder) return say(FrontError{folder.error().message});
  const std::string& out = folder->path();
  const auto log = [&out](const char* name) { return fmt::format("{}/{}.log", out, name); };
  const StopSignal stop;

  const auto not_ready = [&stop](const FrontError& why, Child& child) {
    if (!stop.has_come()) return say(why, child);
    fmt::print("stopped before the session began\n");
    return 130;
  };

  const auto slave_program = sibling("farfeel-slave");
  const auto master_program = sibling("farfeel-master");
  if (!slave_program) return say(slave_program.error());
  if (!master_program) return say(master_program.error());

  fmt::print("scene {}: starting the remote station\n", wishes.scene);
  std::fflush(stdout);
  std::vector<std::string> slave_arguments = {kNoSettings, "--listen", kAnyPort};
  // Both stations share keys made for the occasion: those of one user.
  if (::geteuid() == 0) slave_arguments.insert(slave_arguments.end(), {"--user", "root"});
  slave_arguments.insert(slave_arguments.end(), wishes.to_slave.begin(), wishes.to_slave.end());
  auto slave = Child::start(*slave_program, slave_arguments, log("slave"), Child::Output::kToLog, true);
  if (!slave) return say(slave.error());
  BakingLine baking;
  auto port = slave->ready_port(kReadyTimeout_s, stop.number(), [&baking](int waited_s) { baking.show(waited_s); });
  baking.end();
  if (!port) return not_ready(port.error(), *slave);
  folder->begin();  // the scene is right: what is new may take the place of what is there

  std::optional<Child> link;
  if (!wishes.link.empty()) {
    const auto link_program = sibling("farfeel-link");
    if (!link_program) return say(link_program.error());
    auto started = Child::start(
        *link_program,
        {kNoSettings, "--listen", kAnyPort, "--slave", fmt::format("127.0.0.1:{}", *port), "--link", wishes.link},
        log("link"), Child::Output::kToLog, true);
    if (!started) return say(started.error());
    link.emplace(std::move(*started));
    port = link->ready_port(kReadyTimeout_s, stop.number());
    if (!port) return not_ready(port.error(), *link);
    fmt::print("link: {}\n", wishes.link);
  }

  std::vector<std::string> master_arguments = {kNoSettings,  "--out-is-held",
                                               "--connect",  fmt::format("127.0.0.1:{}", *port),
                                               "--device",   "simulated",
                                               "--seconds",  fmt::format("{}", wishes.seconds),
                                               "--seed",     fmt::format("{}", wishes.seed),
                                               "--out",      out,
                                               "--progress", "machine",
                                               "--command",  wishes.command};
  master_arguments.emplace_back(!wishes.no_view && isatty(STDOUT_FILENO) != 0 ? "--start-view" : "--no-view");
  master_arguments.insert(master_arguments.end(), wishes.to_master.begin(), wishes.to_master.end());
  auto master = Child::start(*master_program, master_arguments, log("master"), Child::Output::kIsRead, false);
  if (!master) return say(master.error());

  std::vector<Child*> others = {&*slave};
  if (link) others.push_back(&*link);
  Ending ending = watch(*master, others, stop);
  if (*master->status() != 0) {
    ending.has_failed = true;
    fmt::print(stderr, "farfeel: {}", master->obituary());
  }

  const auto summary = master_station::read_summary(out);
  if (!summary) {
    fmt::print(stderr, "farfeel: no report: {}\n", summary.error().message);
    return ending.was_stopped ? 130 : 1;
  }
  fmt::print("\n{}\n", master_station::closing_table(*summary));
  const std::string report = out + "/" + master_station::kReportFile;
  if (std::filesystem::exists(report))
    fmt::print("report: {}\n", std::filesystem::absolute(report).lexically_normal().string());
  if (link) tell_of_late_link(*link, log("link"));
  return ending.has_failed ? 1 : ending.was_stopped ? 130 : 0;
}

}  // namespace farfeel::front
