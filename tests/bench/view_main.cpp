// farfeel-bench-view: a session of both stations on this machine, its live view, and a client that draws nothing. How
// many ticks a second it is told, how old the newest are when they come, also after the client stood still, what the
// view's process grows by meanwhile, and what a client costs the haptic loop.
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "codecs/settings/command_line.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "tests/bench/view_client.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;
using realtime::monotonic_now_ns;
using support::quantile;

constexpr int kRounds = 5;  // with a client and without, by turns
constexpr double kRound_s = 4;

/// A program beside this one that ends with it; what it writes to standard output is read line by line.
class Program {
 public:
  Program(const std::string& name, std::vector<std::string> arguments) {
    int pipe[2];
    if (::pipe2(pipe, O_CLOEXEC) != 0) std::abort();
    std::error_code error;
    const std::string path = (std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / name).string();
    arguments.insert(arguments.begin(), path);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(pipe[1], 1);
      const int nowhere = ::open("/dev/null", O_WRONLY);
      ::dup2(nowhere, 2);
      ::execv(path.c_str(), pointers.data());
      ::_exit(127);
    }
    ::close(pipe[1]);
    output_ = ::fdopen(pipe[0], "r");
  }
  ~Program() { end(SIGTERM); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// What follows `word` on the line that begins with it; empty where it ends before.
  std::string line_after(const std::string& word) {
    std::array<char, 512> line{};
    while (std::fgets(line.data(), static_cast<int>(line.size()), output_) != nullptr) {
      const std::string text(line.data());
      if (text.starts_with(word)) return text.substr(word.size(), text.find('\n') - word.size());
    }
    return {};
  }
  void end(int signal) {
    if (pid_ < 0) return;
    ::kill(pid_, signal);
    while (std::fgetc(output_) != EOF) {
    }
    std::fclose(output_);
    ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
  std::FILE* output_ = nullptr;
};

/// Of the child of that process with that name; 0 where there is none.
pid_t child_of(pid_t parent, const std::string& name) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    std::string pid, comm, state;
    pid_t of = 0;
    if (stat >> pid >> comm >> state >> of; stat && of == parent && comm == "(" + name + ")") return std::stoi(pid);
  }
  return 0;
}

double resident_MB(pid_t pid) {
  std::ifstream statm(fmt::format("/proc/{}/statm", pid));
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) * 1e-6;
}

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

struct Fresh {
  std::vector<double> age_ms;
  double seconds = 0, begun_s = 0, ended_s = 0;  // ended, begun: the session's own time
};

Fresh look(ViewClient& client, double seconds) {
  Fresh fresh;
  const std::int64_t begun_ns = monotonic_now_ns(), until_ns = begun_ns + static_cast<std::int64_t>(1e9 * seconds);
  while (const auto tick = client.next(until_ns)) {
    fresh.age_ms.push_back(1e-6 * static_cast<double>(monotonic_now_ns() - tick->told_ns));
    if (fresh.begun_s == 0) fresh.begun_s = 1e-9 * static_cast<double>(tick->time_ns);
    fresh.ended_s = 1e-9 * static_cast<double>(tick->time_ns);
    if (monotonic_now_ns() > until_ns) break;
  }
  fresh.seconds = 1e-9 * static_cast<double>(monotonic_now_ns() - begun_ns);
  return fresh;
}

/// Work of the ticks from the session's time to its time [us].
double work_p99_us(const std::string& csv, double from_s, double to_s) {
  std::ifstream file(csv);
  std::string line, cell;
  std::getline(file, line);
  std::stringstream names(line);
  int column = 0;
  for (int i = 0; std::getline(names, cell, ','); ++i)
    if (cell == "work_us") column = i;
  std::vector<double> work_us;
  while (std::getline(file, line)) {
    std::stringstream cells(line);
    double at_s = 0;
    for (int i = 0; i <= column && std::getline(cells, cell, ','); ++i) {
      if (i == 0) at_s = std::atof(cell.c_str());
      if (i == column && at_s >= from_s && at_s < to_s) work_us.push_back(std::atof(cell.c_str()));
    }
  }
  return quantile(work_us, 0.99);
}

int measure(double seconds, double stall_s, double stalled_s, bool is_json) {
  std::string folder = (std::filesystem::current_path() / "out" / fmt::format("bench-view-{}", ::getpid())).string();
  Program slave("farfeel-slave", {"--listen", "127.0.0.1:0", "--scene", "file-cad", "--user",
                                  ::geteuid() == 0 ? "root" : "nobody", "--ready-fd", "1"});
  const std::string port = slave.line_after("ready ");
  Program master("farfeel-master", {"--connect", "127.0.0.1:" + port, "--device", "simulated", "--seconds", "86400",
                                    "--progress", "none", "--start-view", "--out", folder});
  const std::string address = master.line_after("view: ");
  if (address.empty()) {
    fmt::print(stderr, "no live view: run 'farfeel-master --start-view' by hand to see why\n");
    return 1;
  }
  const pid_t view = child_of(master.pid(), "farfeel-view");
  sleep_s(2);
  std::vector<std::pair<double, double>> with, without;
  json out;
  {
    ViewClient client(address);
    const Fresh fresh = look(client, seconds);
    if (fresh.age_ms.empty()) {
      fmt::print(stderr, "the view told no tick: {}\n", client.trouble());
      return 1;
    }
    out["frames_hz"] = static_cast<double>(fresh.age_ms.size()) / fresh.seconds;
    out["age_ms"] = {{"p50", quantile(fresh.age_ms, 0.5)}, {"p99", quantile(fresh.age_ms, 0.99)}};
    sleep_s(stall_s);
    const Fresh after = look(client, 0.1);  // what had waited, and what is new: the last counts
    out["age_after_stall_ms"] = after.age_ms.empty() ? json() : json(after.age_ms.back());
    const double before_MB = resident_MB(view);
    sleep_s(stalled_s);
    out["server_MB_growth"] = resident_MB(view) - before_MB;
  }
  double last_s = 0;
  for (int round = 0; round < kRounds; ++round) {
    ViewClient client(address);
    const Fresh fresh = look(client, kRound_s);
    if (last_s > 0) without.emplace_back(last_s, fresh.begun_s);
    with.emplace_back(fresh.begun_s, fresh.ended_s);
    last_s = fresh.ended_s;
    if (round + 1 < kRounds) sleep_s(kRound_s);
  }
  sleep_s(kRound_s);
  without.emplace_back(last_s, last_s + kRound_s);
  master.end(SIGINT);
  std::ifstream file(folder + "/summary.json");
  const json summary = json::parse(file, nullptr, false);
  const bool is_fifo = summary.is_object() && summary.value("/loop/is_fifo"_json_pointer, false);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const std::string csv = folder + "/session.csv";
    ratios.push_back(work_p99_us(csv, with[i].first, with[i].second) /
                     work_p99_us(csv, without[i].first, without[i].second));
  }
  // Without a real-time thread a tick's work is what else ran on its processor.
  out["tick_p99_ratio"] = is_fifo ? json(quantile(ratios, 0.5)) : json();
  out["is_fifo"] = is_fifo;
  out["stall_s"] = stall_s;
  out["stalled_s"] = stalled_s;
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  fmt::print("ticks told a second            {:.1f}\n", out["frames_hz"].get<double>());
  fmt::print("their age, p50 and p99         {:.2f} and {:.2f} ms\n", out["age_ms"]["p50"].get<double>(),
             out["age_ms"]["p99"].get<double>());
  fmt::print("age 100 ms after a stall       {} ms ({} s)\n", out["age_after_stall_ms"].dump(), stall_s);
  fmt::print("the view grew by               {:.2f} MB ({} s of a stalled client)\n",
             out["server_MB_growth"].get<double>(), stalled_s);
  fmt::print("tick's work p99, with / without  {}\n",
             is_fifo ? out["tick_p99_ratio"].dump() : "not measured: no SCHED_FIFO");
  if (is_json) fmt::print("{}\n", json{{"view", out}}.dump());
  return 0;
}

}  // namespace
}  // namespace farfeel::bench

int main(int argc, char** argv) {
  CLI::App app("How fresh the live view is, and what it costs", "farfeel-bench view");
  double seconds = 20, stall_s = 60, stalled_s = 600;
  bool is_json = false;
  app.add_option("--seconds", seconds, "Looked at for so long")->check(CLI::Range(1.0, 3600.0))->capture_default_str();
  app.add_option("--stall", stall_s, "Then the client stands still for so long")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--stalled", stalled_s, "And again, while the view's memory is looked at")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_flag("--json", is_json, "One object as the last line");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  return farfeel::bench::measure(seconds, stall_s, stalled_s, is_json);
}
