// The programs as a person starts them: farfeel loopback, and the two stations by hand, killed in mid-contact.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "deploy/front/child.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/tick_record.h"
#include "master_station/report/report_page.h"
#include "master_station/report/session_trace.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/session/operators.h"
#include "tests/end_to_end/session/both_ends.h"
#include "tests/support/private_folder.h"
#include "tests/support/wait_for_progress.h"

namespace farfeel {
namespace {

using front::Child;
using front::Progress;
using master_station::LoopState;
using master_station::SessionSummary;
using master_station::SessionTrace;

// Far more than anything here takes, the baking of a scene on a machine's first run included; not a measurement.
constexpr auto kPatience = std::chrono::seconds(240);
constexpr const char* kScene = "block-gear";  // the quickest to bake

std::string program(const std::string& name) {
  return std::string(FARFEEL_PROGRAMS) + "/" + name;
}

constexpr float kStoodStill_ms =
    3;  // from one tick to the next; a machine may stand still for longer than a state lasts

const std::vector<float>& line(const SessionTrace& trace, std::string_view name) {
  return std::find_if(trace.lines.begin(), trace.lines.end(), [&](const auto& l) { return l.name == name; })->low;
}

/// The column of that name and the two after it, in each row of a session.csv.
std::vector<glm::dvec3> vectors(const std::string& path, const std::string& name) {
  std::ifstream file(path);
  std::string row;
  std::getline(file, row);
  const auto column = std::count(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(row.find(name)), ',');
  std::vector<glm::dvec3> all;
  while (std::getline(file, row)) {
    std::size_t at = 0;
    for (auto i = column; i > 0; --i) at = row.find(',', at) + 1;
    glm::dvec3& v = all.emplace_back();
    for (int axis = 0; axis < 3; ++axis, at = row.find(',', at) + 1) v[axis] = std::strtod(row.c_str() + at, nullptr);
  }
  return all;
}

/// Between the beginnings of the tick before and of this one.
float since_ms(const SessionTrace& trace, std::ptrdiff_t tick) {
  const std::vector<float>& wake_us = line(trace, "wake_us");
  const auto i = static_cast<std::size_t>(tick);
  return 1e3F * (trace.time_s[i] - trace.time_s[i - 1]) + 1e-3F * (wake_us[i] - wake_us[i - 1]);
}

/// The longest time without a break in that state: [from, to).
struct Span {
  std::ptrdiff_t from = 0, to = 0;
};
Span longest(const SessionTrace& trace, LoopState state) {
  Span most, now;
  for (std::ptrdiff_t i = 0; i < std::ssize(trace.state); ++i) {
    if (trace.state[static_cast<std::size_t>(i)] != static_cast<std::uint8_t>(state)) {
      now.from = i + 1;
    } else if (now.to = i + 1; now.to - now.from > most.to - most.from) {
      most = now;
    }
  }
  return most;
}

/// That "held" comes before the fading of a silence, and does not come back between that and "touching".
void expect_held_then_faded(const SessionTrace& trace, Span fading) {
  ASSERT_GT(fading.from, 0) << "it never faded";
  ASSERT_LT(fading.to, std::ssize(trace.state)) << "it faded to the end";
  const auto state_at = [&trace](std::ptrdiff_t i) {
    return static_cast<LoopState>(trace.state[static_cast<std::size_t>(i)]);
  };
  EXPECT_TRUE(state_at(fading.from - 1) == LoopState::kHeld || since_ms(trace, fading.from) > kStoodStill_ms)
      << "in state " << master_station::name(state_at(fading.from - 1));
  EXPECT_NE(state_at(fading.to), LoopState::kHeld) << "fading is over when contacts are fresh, not before";
}

class StationsTest : public testing::Test {
 protected:
  [[nodiscard]] Child start(const std::string& name, std::vector<std::string> arguments, bool has_ready) const {
    static int count = 0;
    auto child = Child::start(program(name), std::move(arguments), fmt::format("{}/{}-{}.log", folder_, name, ++count),
                              Child::Output::kIsRead, has_ready);
    if (!child) throw std::runtime_error(child.error().message);
    return std::move(*child);
  }

  struct Slave {
    Child child;
    int port;
  };
  [[nodiscard]] Slave start_slave(int port = 0) const {
    Child child = start("farfeel-slave", {"--scene", kScene, "--listen", fmt::format("127.0.0.1:{}", port)}, true);
    const auto bound = child.ready_port(std::chrono::duration<double>(kPatience).count(), -1);
    if (!bound) throw std::runtime_error(bound.error().message + "\n" + child.obituary());
    return {std::move(child), *bound};
  }

  [[nodiscard]] Child start_master(int port, const std::string& out) const {
    return start("farfeel-master",
                 {"--connect", fmt::format("127.0.0.1:{}", port), "--device", "simulated", "--seconds", "3600",
                  "--seed", "1", "--out", folder_ + "/" + out, "--progress", "machine"},
                 false);
  }

  template <typename Wish>
  [[nodiscard]] static bool wait_until(const Child& master, const Wish& wish) {
    return test_support::wait_for_progress(master, kPatience, wish);
  }
  [[nodiscard]] static bool wait_until_touching(Child& master) {
    return wait_until(master, [](const Progress& p) { return p.state == "touching" && p.force_N > 0.1; });
  }

  [[nodiscard]] static std::optional<int> wait_for_end(Child& child) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!child.status() && std::chrono::steady_clock::now() < end) {
      // A full pipe would hold it up.
      pollfd wait[2] = {{child.ended_fd(), POLLIN, 0}, {child.output_fd(), POLLIN, 0}};
      poll(wait, 2, 100);
      char bytes[4096];
      if (wait[1].revents != 0 && read(child.output_fd(), bytes, sizeof bytes) <= 0) poll(wait, 1, 100);
    }
    return child.status();
  }

  // What every session that ran as it should leaves behind.
  static void expect_sane(const std::string& out, const SessionSummary& s) {
    EXPECT_GT(s.ticks, 100u);
    EXPECT_GT(s.contact_share, 0);
    EXPECT_LE(s.contact_share, 1);
    EXPECT_GE(s.contacts.mean_in_contact, 1);
    EXPECT_GE(s.contacts.max, s.contacts.mean_in_contact);
    EXPECT_GT(s.pairs.max, 0);
    EXPECT_GT(s.force_N.max, 0);
    EXPECT_GE(s.force_N.max, s.force_N.rms);
    EXPECT_EQ(s.faults, 0u);
    EXPECT_GT(s.up.received, 0u);
    EXPECT_GE(s.up.sent, s.up.received);
    EXPECT_GT(s.down.received, 0u);
    EXPECT_GT(s.scene_bytes, 0u);
    EXPECT_GT(s.slave_contact_hz, 0);
    EXPECT_GT(s.rtt_ms.p50, 0);
    EXPECT_GE(s.rtt_ms.p99, s.rtt_ms.p50);
    EXPECT_FALSE(s.machine.command.empty());
    EXPECT_TRUE(std::filesystem::exists(out + "/" + master_station::kReportFile));
    EXPECT_TRUE(std::filesystem::exists(out + "/" + master_station::kScenePicture) ||
                std::filesystem::exists(out + "/" + master_station::kNoPicture));
    const auto trace = master_station::read_session_csv(out + "/" + master_station::kCsvFile);
    ASSERT_TRUE(trace) << trace.error().message;
    EXPECT_EQ(trace->rows, s.ticks);
  }

  [[nodiscard]] static bool was_in(const SessionTrace& trace, LoopState state) {
    return std::count(trace.state.begin(), trace.state.end(), static_cast<std::uint8_t>(state)) > 0;
  }

  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
};

TEST_F(StationsTest, LoopbackRunsToItsEndOverALossyLink) {
  const std::string out = folder_ + "/out";
  Child session = start(
      "farfeel",
      {"loopback", "--scene", kScene, "--seconds", "5", "--seed", "3", "--link", "rtt=20ms loss=2%", "--out", out},
      false);
  ASSERT_EQ(wait_for_end(session), 0) << session.obituary();
  const auto summary = master_station::read_summary(out);
  ASSERT_TRUE(summary) << summary.error().message;
  expect_sane(out, *summary);
  EXPECT_EQ(summary->scene, kScene);
  EXPECT_EQ(summary->seed, 3u);
  EXPECT_GE(summary->seconds, 4.9);
  EXPECT_GE(summary->rtt_ms.p50, 19) << "the link's delay is in it";
  EXPECT_GT(summary->up.lost, 0u) << "2 % of some thousand";
  EXPECT_NE(summary->machine.command.find("loopback"), std::string::npos);
}

// An assembly's coordinates, three metres from the origin: far beyond the walls of a device that stands there.
TEST_F(StationsTest, APartFarFromItsOriginIsFeltAndTheAirBeforeItIsNot) {
  const std::string scene = folder_ + "/far.toml", out = folder_ + "/out";
  std::ofstream(scene) << "tolerance_m = 0.002\n[tool]\nmodel = \"block\"\n[[object]]\nmodel = \"gear\"\n"
                          "position_m = [3.0, -1.0, 2.0]\nrotation_vector_deg = [90.0, 0.0, 0.0]\n[exploration]\n"
                          "tool_point_m = [0.0, 0.0, -0.020]\nregion_low_m = [2.98, -1.005, 2.060]\n"
                          "region_high_m = [3.02, -0.995, 2.060]\nstroke_speed_m_per_s = 0.05\n";
  Child session = start("farfeel", {"loopback", "--scene", scene, "--seconds", "4", "--out", out}, false);
  ASSERT_EQ(wait_for_end(session), 0) << session.obituary();
  const auto summary = master_station::read_summary(out);
  ASSERT_TRUE(summary) << summary.error().message;
  expect_sane(out, *summary);
  const auto trace = master_station::read_session_csv(out + "/" + master_station::kCsvFile, 1'000'000);
  ASSERT_TRUE(trace);
  const auto first_touch =
      std::find(trace->state.begin(), trace->state.end(), static_cast<std::uint8_t>(LoopState::kTouching)) -
      trace->state.begin();
  const std::vector<float>& force_N = line(*trace, "hand_force_N");
  ASSERT_GT(first_touch, 50);
  EXPECT_LT(*std::max_element(force_N.begin(), force_N.begin() + first_touch), 0.5F) << "no wall in free air";
  EXPECT_GT(*std::max_element(force_N.begin() + first_touch, force_N.end()), 1.0F);
}

/// A cube of 40 mm whose faces have so many squares along a side.
void write_cube(const std::string& path, int squares) {
  std::ofstream file(path);
  int corners = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {0.0, 0.04}) {
      for (int i = 0; i < squares; ++i) {
        for (int j = 0; j < squares; ++j) {
          for (const auto& [u, v] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
            glm::dvec3 p(side);
            p[(axis + 1) % 3] = 0.04 * u / squares, p[(axis + 2) % 3] = 0.04 * v / squares;
            file << fmt::format("v {} {} {}\n", p.x, p.y, p.z);
          }
          const int a = ++corners, b = ++corners, c = ++corners, d = ++corners;
          file << (side > 0 ? fmt::format("f {} {} {} {}\n", a, b, c, d) : fmt::format("f {} {} {} {}\n", d, c, b, a));
        }
      }
    }
  }
}

TEST_F(StationsTest, ABakeIsCheckedWithoutItAndNotWrittenWhereItIsAnotherShape) {
  const std::string mesh = folder_ + "/cube.obj", asset = folder_ + "/cube.glb";
  write_cube(mesh, 2);
  const auto status_of = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), mesh);
    Child bake = start("farfeel-bake", std::move(arguments), false);
    return wait_for_end(bake);
  };
  EXPECT_EQ(status_of({"--check"}), 0);
  EXPECT_EQ(status_of({"--check", "--unit", "um"}), 1) << "too small";
  EXPECT_EQ(status_of({}), 2) << "no output is named";
  EXPECT_EQ(status_of({"-o", asset, "--triangles", "4", "--texture", "64"}), 1) << "it has lost its corners";
  EXPECT_FALSE(std::filesystem::exists(asset));
  EXPECT_EQ(status_of({"-o", asset, "--triangles", "4", "--texture", "64", "--accept-error"}), 0);
  EXPECT_TRUE(std::filesystem::exists(asset));
  std::filesystem::remove(asset);
  EXPECT_EQ(status_of({"-o", asset, "--texture", "64"}), 0);
}

TEST_F(StationsTest, CtrlCEndsALoopbackWithAReport) {
  const std::string out = folder_ + "/out";
  Child session = start("farfeel", {"loopback", "--scene", kScene, "--seconds", "3600", "--out", out}, false);
  // The simulated hand needs a second or two to arrive: stop once the CSV tells of contact.
  const auto end = std::chrono::steady_clock::now() + kPatience;
  const auto has_touched = [&out] {
    const auto trace = master_station::read_session_csv(out + "/" + master_station::kCsvFile);
    return trace && was_in(*trace, LoopState::kTouching);
  };
  while (!has_touched() && !session.status() && std::chrono::steady_clock::now() < end) poll(nullptr, 0, 100);
  session.signal(SIGINT);
  poll(nullptr, 0, 50);
  session.signal(SIGTERM);  // a service manager and a terminal may both ask: it is one stop
  ASSERT_EQ(wait_for_end(session), 130) << session.obituary();
  const auto summary = master_station::read_summary(out);
  ASSERT_TRUE(summary) << summary.error().message;
  expect_sane(out, *summary);
}

/// Which files of a folder anybody has opened, by name.
class OpenedFiles {
 public:
  explicit OpenedFiles(const std::filesystem::path& folder)
      : fd_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)), watch_(inotify_add_watch(fd_, folder.c_str(), IN_OPEN)) {}
  ~OpenedFiles() { close(fd_); }
  OpenedFiles(const OpenedFiles&) = delete;
  OpenedFiles& operator=(const OpenedFiles&) = delete;

  [[nodiscard]] bool is_watching() const { return watch_ >= 0; }
  /// Since the last call.
  [[nodiscard]] std::vector<std::string> take() {
    std::vector<std::string> names;
    alignas(inotify_event) char bytes[8192];
    for (ssize_t got = 0; (got = read(fd_, bytes, sizeof bytes)) > 0;) {
      for (const char* at = bytes; at < bytes + got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(at);
        if (event->len > 0) names.emplace_back(event->name);
        at += sizeof(inotify_event) + event->len;
      }
    }
    return names;
  }

 private:
  int fd_, watch_;
};

// What is felt comes by the wire: the master feels tiles while no asset is opened by anybody.
TEST_F(StationsTest, TheMasterOpensNoAsset) {
  Slave slave = start_slave();
  const std::filesystem::path assets = slave_sim::asset_cache_folder();
  OpenedFiles opened(assets);
  ASSERT_TRUE(opened.is_watching()) << assets;
  ASSERT_TRUE(opened.take().empty());
  const std::filesystem::path asset = std::filesystem::directory_iterator(assets)->path();
  std::ifstream{asset}.get();
  ASSERT_EQ(opened.take(), std::vector<std::string>{asset.filename().string()}) << "the watch sees nothing";

  Child master = start("farfeel-master",
                       {"--connect", fmt::format("127.0.0.1:{}", slave.port), "--device", "simulated", "--seconds", "4",
                        "--seed", "1", "--rung", "tiles", "--out", folder_ + "/master", "--progress", "machine"},
                       false);
  ASSERT_EQ(wait_for_end(master), 0) << master.obituary();
  EXPECT_EQ(opened.take(), std::vector<std::string>{});
  const auto summary = master_station::read_summary(folder_ + "/master");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_GT(summary->local_model.tiles, 0u) << "nothing was felt from tiles";
}

// The loop holds what it knows for 50 ms, lets the force fade after 250 ms, says so, and feels again when the slave is
// back on its port.
TEST_F(StationsTest, MasterOutlivesASlaveKilledInContact) {
  std::optional<Slave> slave = start_slave();
  const int port = slave->port;
  Child master = start_master(port, "master");
  ASSERT_TRUE(wait_until_touching(master)) << master.obituary();
  slave->child.signal(SIGKILL);
  ASSERT_EQ(wait_for_end(slave->child), 128 + SIGKILL);
  ASSERT_TRUE(wait_until(master, [](const Progress& p) { return p.state == "fading" && p.force_N < 0.05; }))
      << "the force did not fade\n"
      << master.obituary();
  slave.emplace(start_slave(port));
  ASSERT_TRUE(wait_until_touching(master)) << "contacts did not come back\n" << master.obituary();
  master.signal(SIGINT);
  ASSERT_EQ(wait_for_end(master), 0) << master.obituary();

  const std::string out = folder_ + "/master";
  const auto summary = master_station::read_summary(out);
  ASSERT_TRUE(summary) << summary.error().message;
  expect_sane(out, *summary);
  const auto trace = master_station::read_session_csv(out + "/" + master_station::kCsvFile, 1'000'000);
  ASSERT_TRUE(trace);
  const auto first = [&trace](LoopState state, std::ptrdiff_t from) {
    return std::find(trace->state.begin() + from, trace->state.end(), static_cast<std::uint8_t>(state)) -
           trace->state.begin();
  };
  const Span silence = longest(*trace, LoopState::kFading);
  ASSERT_LT(first(LoopState::kTouching, 0), silence.from);
  expect_held_then_faded(*trace, silence);
  EXPECT_LT(first(LoopState::kTouching, silence.to), std::ssize(trace->state));
}

// Nothing comes or goes for a second while the tool is pressed, and then everything that waited comes at once.
TEST_F(StationsTest, ALinkThatStallsInContactIsHeldThenFadesAndComesBackWithoutAJump) {
  Slave slave = start_slave();
  Child link = start(
      "farfeel-link",
      {"--listen", "127.0.0.1:0", "--slave", fmt::format("127.0.0.1:{}", slave.port), "--link", "rtt=20ms"}, true);
  const auto port = link.ready_port(std::chrono::duration<double>(kPatience).count(), -1);
  ASSERT_TRUE(port) << link.obituary();
  Child master = start_master(*port, "master");
  ASSERT_TRUE(wait_until_touching(master)) << master.obituary();
  link.signal(SIGSTOP);
  ASSERT_TRUE(wait_until(master, [](const Progress& p) { return p.state == "fading" && p.force_N < 0.05; }))
      << "the force did not fade\n"
      << master.obituary();
  poll(nullptr, 0, 500);
  link.signal(SIGCONT);
  ASSERT_TRUE(wait_until_touching(master)) << "contacts did not come back\n" << master.obituary();
  poll(nullptr, 0, 500);
  master.signal(SIGINT);
  ASSERT_EQ(wait_for_end(master), 0) << master.obituary();

  const auto trace = master_station::read_session_csv(folder_ + "/master/" + master_station::kCsvFile, 1'000'000);
  ASSERT_TRUE(trace);
  const std::string csv = folder_ + "/master/" + master_station::kCsvFile;
  const std::vector<glm::dvec3> force_N = vectors(csv, "hand_force_x_N"), handle_m = vectors(csv, "handle_x_m");
  ASSERT_EQ(force_N.size(), trace->state.size());
  const std::vector<float>&answers = line(*trace, "rtt_ms"), &wake_us = line(*trace, "wake_us"),
        &depth_m = line(*trace, "depth_max_m");
  const auto first = [&trace](LoopState state, std::ptrdiff_t from) {
    return std::find(trace->state.begin() + from, trace->state.end(), static_cast<std::uint8_t>(state)) -
           trace->state.begin();
  };
  // A tick's step, less what the hand makes itself as it moves against the coupling's spring; where a busy machine woke
  // a tick late, what is felt after so long counts for as many. Where it stood still, the tool has the handle to catch
  // up with, contacts that had faded are let in a round trip later, and the tool swings: steps until then are the
  // machine's.
  constexpr float kCaughtUp_s = 0.2F;
  const double spring_N_per_m = master_station::SimulatedDevice({}).capabilities().stable_stiffness_N_per_m;
  const Span silence = longest(*trace, LoopState::kFading);  // a machine that stands still fades the force, too
  const std::ptrdiff_t touched = first(LoopState::kTouching, 0), faded = silence.from,
                       back = first(LoopState::kTouching, faded), ticks = std::ssize(force_N);
  ASSERT_LT(touched, faded);
  ASSERT_LT(back, ticks);
  expect_held_then_faded(*trace, silence);
  const auto largest_step = [&](std::ptrdiff_t from, std::ptrdiff_t to) {
    double most_N = 0;
    float stood_still_s = -1;
    for (auto i = static_cast<std::size_t>(from) + 1; i < static_cast<std::size_t>(to); ++i) {
      const float passed_ms = since_ms(*trace, static_cast<std::ptrdiff_t>(i));
      if (passed_ms > kStoodStill_ms) stood_still_s = trace->time_s[i] + 1e-6F * wake_us[i];
      if (trace->time_s[i] < stood_still_s + kCaughtUp_s) continue;
      const double ticks_since = std::max(1.0F, std::round(passed_ms));
      const glm::dvec3 change_N = force_N[i] - force_N[i - 1];
      const glm::dvec3 by_hand_N = -spring_N_per_m * (handle_m[i] - handle_m[i - 1]);
      most_N = std::max(most_N, std::min(glm::length(change_N), glm::length(change_N - by_hand_N)) / ticks_since);
    }
    return most_N;
  };
  // In the silence the hand is left with the tool's own inertia, and contacts press again only after an answer.
  std::ptrdiff_t answered = faded;
  while (answered < back && std::isnan(answers[static_cast<std::size_t>(answered)])) ++answered;
  EXPECT_EQ(depth_m[static_cast<std::size_t>(answered) - 1], 0);
  EXPECT_LE(largest_step(faded, std::min(back + 500, ticks)), std::max(0.3, largest_step(touched, faded)));
  slave.child.signal(SIGTERM);
  EXPECT_EQ(wait_for_end(slave.child), 0) << slave.child.obituary();
}

TEST_F(StationsTest, SlaveOutlivesAMasterKilledInContact) {
  Slave slave = start_slave();
  Child first = start_master(slave.port, "first");
  ASSERT_TRUE(wait_until_touching(first)) << first.obituary();
  first.signal(SIGKILL);
  ASSERT_EQ(wait_for_end(first), 128 + SIGKILL);
  EXPECT_FALSE(slave.child.status()) << slave.child.obituary();
  const auto left = master_station::read_session_csv(folder_ + "/first/" + master_station::kCsvFile);
  ASSERT_TRUE(left) << "what was written before is readable: " << left.error().message;
  EXPECT_GT(left->rows, 0u);

  Child second = start_master(slave.port, "second");
  ASSERT_TRUE(wait_until_touching(second)) << second.obituary() << slave.child.obituary();
  second.signal(SIGTERM);
  ASSERT_EQ(wait_for_end(second), 0) << second.obituary();
  const auto summary = master_station::read_summary(folder_ + "/second");
  ASSERT_TRUE(summary) << summary.error().message;
  expect_sane(folder_ + "/second", *summary);
  slave.child.signal(SIGTERM);
  EXPECT_EQ(wait_for_end(slave.child), 0) << slave.child.obituary();
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_F(StationsTest, AHangUpEndsBothStationsInOrderAndAStandstillIsTold) {
  Slave slave = start_slave();
  Child master = start_master(slave.port, "master");
  ASSERT_TRUE(wait_until_touching(master)) << master.obituary();
  master.signal(SIGSTOP);
  poll(nullptr, 0, 1500);
  master.signal(SIGCONT);
  ASSERT_TRUE(wait_until_touching(master)) << master.obituary();
  master.signal(SIGHUP);
  ASSERT_EQ(wait_for_end(master), 0) << master.obituary();
  EXPECT_NE(bytes_of(master.log()).find("this program stood still for 1."), std::string::npos) << master.obituary();
  const auto summary = master_station::read_summary(folder_ + "/master");
  ASSERT_TRUE(summary) << summary.error().message;
  expect_sane(folder_ + "/master", *summary);
  slave.child.signal(SIGHUP);
  EXPECT_EQ(wait_for_end(slave.child), 0) << slave.child.obituary();
  const std::string said = bytes_of(slave.child.log());
  EXPECT_NE(said.find("session ended: the master said goodbye"), std::string::npos) << said;
  EXPECT_NE(said.find("stopping on a hang-up of the terminal"), std::string::npos) << said;
}

TEST_F(StationsTest, AFaultSaysWhyStaysAndIsResetByASignal) {
  end_to_end::Floor floor;
  floor.level_m = 2;                                                                     // deeper than any loop takes
  const auto operators = slave_sim::Operators::open("", transport::loopback()).value();  // as the programs do here
  slave_sim::SlaveSession::Options options;
  options.local = transport::loopback();
  options.own = operators.own();
  options.find = [&](const transport::Key32& key) { return operators.find(key); };
  const auto slave = slave_sim::SlaveSession::start(options, end_to_end::scene(), floor).value();
  Child master = start_master(slave->local().port, "master");
  const auto is_in = [](const char* state) { return [state](const Progress& p) { return p.state == state; }; };
  ASSERT_TRUE(wait_until(master, is_in("fault"))) << master.obituary();
  floor.level_m = -0.5;
  const std::string said = master.obituary();
  EXPECT_NE(said.find("not of a sane size"), std::string::npos) << said;
  EXPECT_NE(said.find("kill -USR1"), std::string::npos) << said;
  EXPECT_EQ(said.find("older than the link takes"), std::string::npos) << "there was news all the time\n" << said;
  // The newest contacts may have been on their way: once more, until nothing absurd comes after it.
  for (int tries = 0; tries < 3; ++tries) {
    poll(nullptr, 0, 200);
    master.signal(SIGUSR1);
  }
  EXPECT_TRUE(wait_until(master, is_in("free"))) << master.obituary();
  EXPECT_NE(master.obituary().find("the fault is reset"), std::string::npos) << master.obituary();
  master.signal(SIGINT);
  EXPECT_EQ(wait_for_end(master), 0) << master.obituary();
}

TEST_F(StationsTest, MistakesAreExplained) {
  for (const auto& [arguments, status] : std::vector<std::pair<std::vector<std::string>, int>>{
           {{"lopback"}, 2},
           {{"loopback", "--seconds", "nan"}, 2},
           {{"loopback", "--seed", "-1"}, 2},
           {{"report"}, 2},
           {{"doctor", "--qick"}, 2},
           {{"report", "/nowhere"}, 1},
           {{"loopback", "--scene", "no-such-scene", "--out", folder_}, 1}}) {
    Child child = start("farfeel", arguments, false);
    EXPECT_EQ(wait_for_end(child), status);
    EXPECT_NE(child.obituary().find("farfeel"), std::string::npos) << child.obituary();
  }
}

// Before any work, in every program: version, help by either name, and one status for a wrong command line.
TEST_F(StationsTest, EveryProgramTakesHelpAndVersionAndTellsAWrongOption) {
  for (const char* name : {"loopback", "report", "doctor", "key", "link-status", "device", "slave", "master", "link",
                           "bake", "view", "asset", "scene", "replay", "relay"}) {
    const auto status_of = [&](std::vector<std::string> arguments) {
      Child child = start("farfeel", std::move(arguments), false);
      return wait_for_end(child);
    };
    EXPECT_EQ(status_of({name, "--version"}), 0) << name;
    EXPECT_EQ(status_of({"help", name}), 0) << name;
    EXPECT_EQ(status_of({name, "--no-such-option"}), 2) << name;
  }
}

}  // namespace
}  // namespace farfeel
