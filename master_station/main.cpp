// farfeel-master: the operator's station. Takes the scene from a slave, runs the haptic loop against it, and leaves a
// report. All the wiring is here.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "codecs/settings/command_line.h"
#include "codecs/settings/log.h"
#include "codecs/settings/stop_signals.h"
#include "haptic_core/contact/doubts.h"
#include "master_station/feed/session_feed.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "master_station/report/report_page.h"
#include "master_station/report/run_folder.h"
#include "master_station/report/session_recorder.h"
#include "master_station/report/this_machine.h"
#include "master_station/session/greeter_of_keys.h"
#include "master_station/session/master_session.h"
#include "master_station/session/scene_apart.h"
#include "master_station/session_devices.h"
#include "master_station/session_pictures.h"
#include "master_station/session_view.h"
#include "transport/status/link_words.h"
#include "transport/status/status_file.h"

namespace farfeel::master_station {
namespace {

struct Arguments {
  std::string connect;  ///< empty: this machine, unless there is a relay
  std::string relay, relay_token;
  std::string keys, slave;
  double most_force_scale = 1;
  DeviceWishes device;
  std::string hand = "any", grip = "medium";
  double seconds = 0;  ///< 0: kSimulatedSeconds, or until a person ends it
  std::uint64_t seed = 1;
  int rate_hz = 1000;
  std::string rung = "auto";
  std::string integrator = "euler", contact = "penalty";
  std::string controller = "ours";
  std::string out;  ///< empty: a new folder below kRuns
  int csv_every = SessionCsv::kThinsItself;
  std::string progress = "human";
  std::string command;  ///< as typed, for the report
  bool no_view = false, starts_view = false;
  bool is_out_held = false;
};

constexpr double kSimulatedSeconds = 20;
constexpr const char* kRuns = "out/session";
constexpr const char* kThisMachine = "127.0.0.1:47000";

constexpr const char* kAbout = R"(farfeel-master: the operator's station of a haptic session.

Connects to a farfeel-slave, takes its scene, drives a device against it for some seconds, and writes summary.json,
session.csv and report.html. The simulated device is held by a simulated hand that explores the scene:
it approaches, presses, strokes, twists and lifts, the same way for the same seed.

Ctrl-C, SIGTERM and a hang-up of the terminal end the session early, with a report of what there is. A fault switches the force off and says why;
SIGUSR1 resets it: the hand then takes hold of the tool where that is.)";

/// Ctrl-C, SIGTERM and a hang-up, which stop, and SIGUSR1, which resets a fault: held back from every thread and asked
/// for where it suits.
class Signals {
 public:
  Signals() : stops_(codecs::hold_stop_signals()), set_(stops_) {
    sigaddset(&set_, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }
  /// Waits up to `milliseconds` for one; once a stop has come, true for ever.
  bool stop_came_within(long milliseconds) {
    const timespec wait{milliseconds / 1000, milliseconds % 1000 * 1'000'000};
    const int came = has_stopped_ ? 0 : sigtimedwait(&set_, nullptr, &wait);
    codecs::leave_terminal_after(came);
    has_stopped_ = has_stopped_ || (came > 0 && came != SIGUSR1);
    is_reset_asked_ = is_reset_asked_ || came == SIGUSR1;
    return has_stopped_;
  }
  /// While it lives nobody asks: a stop ends the program.
  [[nodiscard]] codecs::StopsEndAtOnce end_at_once() const { return codecs::StopsEndAtOnce(stops_); }
  /// Whether a reset has come since this was asked last.
  bool take_reset() { return std::exchange(is_reset_asked_, false); }

 private:
  sigset_t stops_, set_;
  bool has_stopped_ = false, is_reset_asked_ = false;
};

double seconds_now() {
  return 1e-9 * static_cast<double>(transport::monotonic_ns());
}

int fail(const std::string& message) {
  spdlog::error("{}", message);
  return 1;
}

/// Where the hand holds the tool: over the point that works, so that pressing does not lever it.
spatial::Pose grip_of(const codecs::Exploration& exploration) {
  return {{1, 0, 0, 0}, exploration.p_TWork_T};
}

DeviceWishes device_wishes(const Arguments& arguments, const codecs::SceneDescription& scene,
                           const GearScales& scales) {
  DeviceWishes wishes = arguments.device;
  wishes.simulated.grip = *find_grip(arguments.grip);  // CLI11 let only known names through
  wishes.simulated.explorer.hints = scene.exploration;
  wishes.simulated.explorer.seed = arguments.seed;
  wishes.simulated.explorer.X_TG = grip_of(scene.exploration);
  wishes.grasp = arguments.hand == "limp" ? devices::Grasp::kLimp : devices::Grasp::kAny;
  wishes.scales = scales;
  wishes.period_ns = 1'000'000'000 / arguments.rate_hz;
  return wishes;
}

/// tiles: where the slave tells of no texture, the loop takes the rung below.
local_model::Rung rung_of(const std::string& name) {
  if (name == "held") return local_model::Rung::kHeldWrench;
  if (name == "quadratic") return local_model::Rung::kQuadratic;
  if (name == "linear") return local_model::Rung::kLinear;
  return local_model::Rung::kTiles;
}

HapticLoopSettings loop_settings(const Arguments& arguments, const codecs::SceneDescription& scene,
                                 local_model::Rung rung) {
  const codecs::SceneTool& tool = scene.tool;
  HapticLoopSettings settings;
  settings.X_TG = grip_of(scene.exploration);
  settings.scales = GearScales{scene.workspace_scale, scene.force_scale, scene.has_clutch}.with_force_at_most(
      arguments.most_force_scale);
  settings.timing.period_ns = 1'000'000'000 / arguments.rate_hz;
  settings.local_model.rung = rung;
  settings.local_model.contact =
      *local_model::find_contact_law(arguments.contact);                        // CLI11 let only known names through
  settings.controller = *teleoperation::find_controller(arguments.controller);  // CLI11 let only known names through
  settings.integrator =
      arguments.integrator == "midpoint" ? tool::Integrator::kMidpoint : tool::Integrator::kBackwardEuler;
  for (std::uint32_t i = 0; i < scene.objects.size(); ++i) {
    const codecs::SceneObject& object = scene.objects[i];
    if (object.motion || object.may_change)
      settings.moving.push_back({i, object.motion, motion::at_rest(object.X_WO, object.is_there)});
  }
  settings.body.mass_kg = tool.mass_kg;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      settings.body.inertia_To_T(row, column) = tool.inertia_To_T_kg_m2[column][row];
    }
  }
  return settings;
}

void show_progress(const Arguments& arguments, const TickRecord& tick, double of_s) {
  const double t_s = static_cast<double>(tick.time_ns) * 1e-9, force_N = glm::length(tick.F_hand_W.force_N);
  if (arguments.progress == "machine") {
    fmt::print("progress t={:.1f} of={:g} state={} force={:.2f} contacts={} rtt={:.2f}\n", t_s, of_s, name(tick.state),
               force_N, tick.contacts, tick.rtt_ms);
    std::fflush(stdout);
  } else if (arguments.progress == "human" && ::isatty(STDERR_FILENO) != 0) {
    fmt::print(stderr, "\r\033[K{:5.1f}{} s   {:<8}   {:5.2f} N   {} contacts", t_s,
               std::isfinite(of_s) ? fmt::format(" of {:g}", of_s) : "", name(tick.state), force_N, tick.contacts);
  }
}

/// Whether the whole program stood still between two looks.
class Standstill {
 public:
  /// Seconds since the last look where that is longer than a busy machine takes; else 0. Sleep of the machine counts.
  double since_last_look_s() {
    timespec now{};
    ::clock_gettime(CLOCK_BOOTTIME, &now);
    const double now_s = static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    const double passed_s = now_s - std::exchange(looked_s_, now_s);
    return looks_++ > 0 && passed_s > kStill_s ? passed_s : 0;
  }

 private:
  static constexpr double kStill_s = 1;
  double looked_s_ = 0;
  int looks_ = 0;
};

/// Says in words when the loop leaves or regains the remote, or latches a fault, and why as soon as that is known.
class StateAnnouncer {
 public:
  explicit StateAnnouncer(std::string way) : told_way_(std::move(way)) {}
  /// Every 50 ms.
  void look(const HapticLoop& loop, const MasterSession& session) {
    if (const double still_s = standstill_.since_last_look_s(); still_s > 0)
      spdlog::warn(
          "this program stood still for {:.1f} s (it was stopped, or the machine slept): nothing was felt meanwhile",
          still_s);
    if (loop.is_paused() != is_paused_told_) {
      is_paused_told_ = !is_paused_told_;
      spdlog::info("{}", is_paused_told_ ? "paused: the force fades ('farfeel view --resume' goes on)"
                                         : "resumed: armed, take hold of the handle anew");
    }
    if (const std::string way = session.way(); way != told_way_) {
      spdlog::info("the session now goes {}", way);
      told_way_ = way;
    }
    const LoopState state = loop.state();
    const bool is_trouble = state == LoopState::kHeld || state == LoopState::kFading || state == LoopState::kFault;
    has_begun_ = has_begun_ || !is_trouble;
    if (!has_begun_ && state == LoopState::kFading && ++looks_ < kPatience) return;  // the first contacts are under way
    const std::string why = is_trouble ? session.trouble() : std::string();
    if (is_trouble && (state != told_ || (told_why_.empty() && !why.empty()))) {
      spdlog::warn("{}{}{}", words(state, loop.fault()), why.empty() ? "" : "; ", why);
      told_ = state;
      told_why_ = why;
    } else if (!is_trouble && told_) {
      spdlog::info("{}: {}", told_ == LoopState::kFault ? "the fault is reset" : "contacts are fresh again",
                   message(state));
      told_.reset();
      told_why_.clear();
    }
  }

 private:
  [[nodiscard]] std::string words(LoopState state, Fault fault) const {
    if (state == LoopState::kFault) return fmt::format("{} (kill -USR1 {})", message(fault), ::getpid());
    return has_begun_ ? std::string(message(state))
                      : "no contacts from the remote yet; nothing is felt until they come";
  }

  static constexpr int kPatience = 20;
  Standstill standstill_;
  bool has_begun_ = false, is_paused_told_ = false;
  int looks_ = 0;
  std::optional<LoopState> told_;
  std::string told_why_, told_way_;
};

LaneCount lane_count(const transport::LaneCounters& c) {
  return {c.sent, c.received, c.lost, c.late, c.duplicate};
}

void add_session_figures(SessionSummary& summary, MasterSession& session) {
  const LinkReport link = session.last_report();
  summary.up = lane_count(link.up);
  summary.down = lane_count(link.down);
  summary.scene_bytes = session.scene_bytes();
  summary.local_model.tiles = link.tiles;
  summary.local_model.tile_bytes = link.tile_bytes;
  summary.scene_ms = session.scene_ms();
  for (std::size_t d = 0; d < contact::kNamedDoubts.size(); ++d) {
    const contact::NamedDoubt& doubt = contact::kNamedDoubts[d];
    if (link.doubts.contacts == 0) break;
    summary.doubts.push_back({std::string(doubt.name), std::string(doubt.told), link.doubts.share(d)});
  }
  if (link.slave) {
    summary.slave_contact_hz = link.slave->contact_hz;
    summary.slave_contact_us = {link.slave->contact_us_p50, link.slave->contact_us_p99, link.slave->contact_us_max};
  }
}

int run_session(const Arguments& arguments) {
  realtime::give_threads_room();
  Signals signals;
  const bool is_relayed = !arguments.relay.empty();
  MasterSession::Options options;
  if (!arguments.connect.empty() || !is_relayed) {
    auto addresses =
        transport::resolve(arguments.connect.empty() ? kThisMachine : arguments.connect, transport::kDefaultPort);
    if (!addresses) return fail(addresses.error().message);
    options.slave = *std::move(addresses);
  }
  std::vector<transport::Address> reached = options.slave;
  if (is_relayed) reached.push_back(transport::any_address());  // it leads to other machines, wherever it runs
  auto greeter = greeter_of_keys(arguments.keys, arguments.slave, reached);
  if (!greeter) return fail(greeter.error().message);
  options.greeter = *std::move(greeter);
  if (is_relayed) {
    auto access = transport::relay_access(arguments.relay, arguments.relay_token, options.greeter.slave);
    if (!access) return fail(access.error().message);
    options.relay = *std::move(access);
  }
  if (const std::string trouble = SessionDevices::trouble_with(arguments.device); !trouble.empty())
    return fail(trouble);
  std::optional<RunFolder> held;  // by this program, unless by the one that started it
  if (!arguments.is_out_held) {
    auto folder = RunFolder::of(arguments.out, kRuns);
    if (!folder) return fail(folder.error().message);
    held.emplace(*std::move(folder));
  }
  const std::string out = held ? held->path() : arguments.out;

  // What takes longer than anybody waits without a word is told, once each, and how far it is.
  constexpr double kWord_s = 5;
  std::string told;
  double told_s = seconds_now();
  const auto tell = [&told, &told_s](const std::string& line, double share) {
    const bool is_slow = share > 0.005 && seconds_now() - told_s > kWord_s;
    if (!is_slow && (share > 0 || line == told)) return;
    told = line;
    told_s = seconds_now();
    spdlog::info("{}{}", line, share > 0 ? fmt::format(": {:.0f} %", 100 * share) : "");
  };
  options.progress = tell;
  options.decode_meshes = decode_meshes_apart();
  const auto status_file = transport::open_status_file();
  if (!status_file) spdlog::warn("'farfeel link-status' will not know of this master: {}", status_file.error().message);
  const auto mind = [&arguments](const std::string& words) {
    spdlog::warn("{}", words);
    if (arguments.progress != "machine") return;
    fmt::print("note: {}\n", words);
    std::fflush(stdout);
  };
  transport::LinkWords link_words(1e3 * (local_model::kMostRoundTrip_s + local_model::kFadingAfter_s));
  options.tell_status = [&](const transport::LinkStatus& status) {
    if (status_file) status_file->write(status);
    if (const auto words = link_words.look(status, seconds_now())) mind(*words);
  };
  auto session = MasterSession::connect(options, [&] { return signals.stop_came_within(0); });
  if (!session) return fail(session.error().message);
  const codecs::SceneDescription& scene = (*session)->scene();
  spdlog::info("scene '{}' received: {:.1f} kB in {:.0f} ms", scene.name,
               static_cast<double>((*session)->scene_bytes()) * 1e-3, (*session)->scene_ms());
  constexpr double kClocksAgree_s = 600;
  if (const double apart_s = (*session)->clock_difference_s(); std::abs(apart_s) > kClocksAgree_s)
    spdlog::warn("the slave's clock is {:.1f} h {} this one: keys expire by each machine's own clock, all else goes on",
                 std::abs(apart_s) / 3600, apart_s > 0 ? "ahead of" : "behind");
  if (is_relayed || !(*session)->slave().is_loopback())
    spdlog::info("connected {} in {:.1f} ms, sealed with {}", (*session)->way(), (*session)->greeting_ms(),
                 transport::name_of((*session)->suite()));
  if (scene.workspace_scale != 1 || scene.force_scale != 1)
    spdlog::info("scaled: the tool moves {:g} times as far as the hand, the hand feels {:g} times the tool's force",
                 scene.workspace_scale, std::min(scene.force_scale, arguments.most_force_scale));
  if (scene.force_scale > arguments.most_force_scale)
    spdlog::warn("the slave asks for {:g} times the tool's force on the hand; it gets {:g} (--most-force-scale)",
                 scene.force_scale, arguments.most_force_scale);

  const local_model::Rung rung = rung_of(arguments.rung);
  HapticLoopSettings settings = loop_settings(arguments, scene, rung);
  settings.tiles_may_rest = arguments.rung == "auto";
  const auto tell_device = [](const std::string& sentence) { spdlog::info("{}", sentence); };
  const DeviceWishes wishes = device_wishes(arguments, scene, settings.scales);
  auto devices = SessionDevices::open(wishes, tell_device, [&] { return signals.stop_came_within(0); });
  if (!devices) return fail(devices.error());
  if (const std::string beyond = (*devices)->beyond_the_hand(wishes, scene.tool.material); !beyond.empty())
    mind(beyond);
  settings.scales = (*devices)->scales();
  settings.X_WB = (*devices)->X_WB();
  // A person ends a session when it is over; a simulated hand has to be told.
  const double seconds = arguments.seconds > 0        ? arguments.seconds
                         : (*devices)->is_simulated() ? kSimulatedSeconds
                                                      : std::numeric_limits<double>::infinity();

  SessionSummary summary;
  summary.scene = scene.name;
  summary.seed = arguments.seed;
  summary.machine = this_machine(arguments.command);

  ContactWitness witness((*session)->remote());
  std::optional<local_model::LocalContacts> contacts;
  const local_model::TileCache* wanted = nullptr;
  if (local_model::TileCache* tiles = (*session)->tiles();
      tiles && rung != local_model::Rung::kHeldWrench && arguments.controller == "ours") {
    const codecs::StopsEndAtOnce meanwhile = signals.end_at_once();  // a large scene takes a while
    contacts.emplace(*tiles);
    if (tiles->is_textured() && rung == local_model::Rung::kTiles) {
      wanted = tiles;
      (*session)->want_tiles();
    }
  }
  if (rung == local_model::Rung::kQuadratic) (*session)->remote().want_curvature();
  const auto own_memory =  // more than a small stack has
      std::make_unique<HapticLoop>((*devices)->felt(), witness, settings, contacts ? &*contacts : nullptr);
  HapticLoop& loop = *own_memory;
  auto feed = SessionFeed::open(scene, wanted, [&loop](codecs::ViewVerb verb) { return obey(verb, loop); });
  if (!feed) spdlog::warn("'farfeel view' cannot show this session: {}", feed.error());
  const bool is_on_terminal = arguments.progress == "human" && ::isatty(STDOUT_FILENO) != 0;
  const ViewProcess view(feed && !arguments.no_view && (arguments.starts_view || is_on_terminal));
  if (held) held->begin();
  auto recorder = SessionRecorder::start(fmt::format("{}/{}", out, kCsvFile), loop.records(), witness,
                                         feed ? feed->get() : nullptr, arguments.csv_every);
  if (!recorder) return fail(recorder.error().message);

  std::atomic<bool> stop{false};
  std::jthread haptic_thread([&] { loop.run(stop); });
  StateAnnouncer announcer((*session)->way());
  for (int step = 1; !signals.stop_came_within(50); ++step) {
    if (signals.take_reset()) loop.reset_fault();
    const TickRecord newest = (*recorder)->newest();
    if (step % 4 == 0) show_progress(arguments, newest, seconds);
    announcer.look(loop, **session);
    if (feed && step % 2 == 1) tell_view(**feed, loop, **session, **devices, scene);
    (*devices)->look(tell_device);
    if (static_cast<double>(newest.time_ns) * 1e-9 >= seconds) break;
    if ((*session)->state() == MasterSession::State::kOtherScene) {
      spdlog::error("the slave came back with another scene; start a new session to feel it");
      break;
    }
  }
  (*devices)->stop();  // a ramp, while the loop still runs
  std::this_thread::sleep_for(std::chrono::duration<double>(2 * devices::GuardedDevice::kStop_s));
  stop = true;
  haptic_thread.join();
  if (arguments.progress == "human" && ::isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K");

  const auto recorded = (*recorder)->finish();
  if (!recorded) spdlog::error("{}", recorded.error().message);  // the table below has every tick all the same
  (*recorder)->statistics().fill(summary);
  add_session_figures(summary, **session);
  summary.local_model.ticks_spared = loop.ticks_spared();
  summary.energy.truncations = loop.local_model().truncations();
  const realtime::PeriodicStatistics& ran = loop.statistics();
  summary.loop = {arguments.controller, arguments.controller == "ours" ? std::string(local_model::name(rung)) : "none",
                  arguments.integrator, static_cast<double>(arguments.rate_hz),
                  ran.is_fifo,          ran.is_memory_locked,
                  ran.page_faults};
  fmt::print("{}", closing_table(summary));  // first: a disk may be full
  std::fflush(stdout);
  if (const auto written = write_summary(out, summary); !written) return fail(written.error().message);
  write_pictures(out, scene, (*session)->courses(), (*recorder)->best_moment());
  const auto page = write_report(out);
  if (!page) return fail(page.error().message);
  fmt::print("report: {}\n", *page);
  return recorded ? 0 : 1;
}

}  // namespace
}  // namespace farfeel::master_station

int main(int argc, char** argv) {
  using namespace farfeel::master_station;
  const std::span as_started(argv, static_cast<std::size_t>(argc));
  if (is_asked_to_decode(as_started)) return answer_with_meshes(as_started);
  Arguments arguments;
  arguments.command = command_line(argc, argv);
  CLI::App app{kAbout, "farfeel-master"};
  app.add_option("--connect", arguments.connect, "The slave: name or address, and its UDP port, 47000 unless told")
      ->default_str(kThisMachine);
  auto* const relay =
      app.add_option("--relay", arguments.relay,
                     "A farfeel-relay that the slave is at, too: name or address, and its UDP port, 47200 unless told. "
                     "With --connect both ways are tried; a direct way past the relay is taken where one is found");
  app.add_option("--relay-token", arguments.relay_token, "File with what 'farfeel-relay token' printed at the relay")
      ->needs(relay);
  app.add_option(
      "--slave", arguments.slave,
      "The slave's name in the list of slaves that are trusted here ('farfeel key list'); needed where there "
      "are several");
  app.add_option("--keys", arguments.keys,
                 "Folder of this operator's keys; ~/.config/farfeel/keys unless told, and keys made for the occasion "
                 "where the slave is on this machine");
  app.add_option(
         "--device", arguments.device.choice.device,
         "auto, NAME[:SERIAL] as 'farfeel device list' tells it, several at once (one for the hand, a SpaceMouse "
         "to turn the tool), simulated, or simulated:MODEL with that model's figures. auto: the device with "
         "force that is plugged in, else a rate input, else simulated")
      ->default_str("auto");
  app.add_option("--orientation", arguments.device.choice.orientation,
                 "What turns the tool of a device that tells no orientation: NAME[:SERIAL] of a second device, "
                 "twist[:BUTTON] (while that button is held), or fixed");
  app.add_option("--view", arguments.device.choice.view, "NAME[:SERIAL] of a rate input that turns the view");
  app.add_option("--axes", arguments.device.choice.axes,
                 "Of a rate input that moves the tool: all, translation, rotation or dominant");
  app.add_option("--rate-speed", arguments.device.choice.rate_speed, "And the tool's speed at full deflection [m/s]");
  app.add_option("--firmware", arguments.device.options.firmware, "File with a Falcon's firmware");
  app.add_option("--plug-in", arguments.device.options.plug_in,
                 "Shared library with the interface farfeel_device_v1, for devices of other makers");
  app.add_option("--hand", arguments.hand,
                 "limp: a coupling that is stiffer and more damped, at less of a margin, for a hand that holds lightly")
      ->check(CLI::IsMember({"any", "limp"}))
      ->capture_default_str();
  app.add_option(
         "--max-force", arguments.device.max_force_N,
         "The hand gets no more force, whatever is asked [N]; unless told 8, or what the device gives continuously "
         "if that is less")
      ->check(CLI::Range(0.1, 200.0));
  app.add_option("--max-torque", arguments.device.max_torque_Nm,
                 "And no more torque [Nm]; unless told what the device gives continuously")
      ->check(CLI::Range(0.001, 20.0));
  app.add_option("--grip", arguments.grip, "How firmly the simulated hand holds it")
      ->check(CLI::IsMember({"soft", "medium", "hard"}))
      ->capture_default_str();
  app.add_option("--seconds", arguments.seconds,
                 "Length of the session [s]; unless told 20 with the simulated device, else until Ctrl-C")
      ->check(CLI::Range(0.1, 86400.0));
  app.add_option("--seed", arguments.seed, "Of the simulated exploration")->capture_default_str();
  app.add_option("--rate", arguments.rate_hz, "Ticks a second: 1000, 2000, 4000, 5000 as the machine allows")
      ->check(CLI::Range(100, 5000))
      ->capture_default_str();
  app.add_option(
         "--controller", arguments.controller,
         "What renders: ours (the local model), or to compare with: direct (the remote's wrench straight to the "
         "hand), waves (wave variables) or passivity (time-domain passivity), both with the tool at the remote")
      ->check(CLI::IsMember(farfeel::teleoperation::controller_names()))
      ->capture_default_str();
  app.add_option("--most-force-scale", arguments.most_force_scale,
                 "The hand feels no more than so many times the tool's force, whatever the slave's scene asks for")
      ->check(CLI::Range(1e-4, 100.0))
      ->capture_default_str();
  app.add_option("--integrator", arguments.integrator,
                 "Step of the simulated tool: euler (backward, damps) or midpoint (passive, damps nothing by itself)")
      ->check(CLI::IsMember({"euler", "midpoint"}))
      ->capture_default_str();
  app.add_option("--contact", arguments.contact,
                 "How contacts push: penalty (a spring each), or constraint (the tool sinks into one elastic pad, its "
                 "proxy stays on the surface; being tried)")
      ->check(CLI::IsMember({"penalty", "constraint"}))
      ->capture_default_str();
  app.add_option(
         "--rung", arguments.rung,
         "Local model: held (the remote's wrench), linear (its contacts), quadratic (with their curvature, where "
         "the tool will be when they arrive), tiles (the surfaces themselves), auto: tiles, "
         "but linear for some seconds where the round trip is below 5 ms and too many ticks take most of their period")
      ->check(CLI::IsMember({"auto", "held", "linear", "quadratic", "tiles"}))
      ->capture_default_str();
  auto* const out = app.add_option("--out", arguments.out,
                                   "Folder for summary.json, session.csv and report.html, made if missing; unless told "
                                   "a new one in out/session for each session, and out/session/latest points to it");
  app.add_flag("--out-is-held", arguments.is_out_held, "It is locked by the program that started this one")
      ->needs(out)
      ->configurable(false);
  app.add_option(
         "--csv-every", arguments.csv_every,
         "Write every so many-th tick to session.csv, 1: all; unless told each of the first 60,000 and then ever "
         "fewer. What is around a fault is always whole")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--progress", arguments.progress, "How to show progress")
      ->check(CLI::IsMember({"human", "machine", "none"}))
      ->capture_default_str();
  app.add_flag("--no-view", arguments.no_view,
               "Start no live view; on a terminal one is started and its address printed");
  app.add_flag("--start-view", arguments.starts_view, "Start it without a terminal, too");
  app.add_option("--command", arguments.command, "What the report calls the command that made it")->configurable(false);
  app.footer(
      "Examples:\n  farfeel-master --connect 127.0.0.1:47000 --seconds 20 --seed 1 --out /tmp/session\n"
      "  farfeel-master --connect lab.example.org --slave lab\n"
      "  farfeel-master --relay relay.example.org --relay-token token --slave lab");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  farfeel::codecs::log_as("master");
  return run_session(arguments);
}
