#include "tests/hardware_lab/drill.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/hardware_lab/kernel_log.h"
#include "tests/hardware_lab/person.h"
#include "tests/hardware_lab/usb_gadget.h"
#include "tests/support/quantile.h"

namespace farfeel::hardware_lab {
namespace {

using devices::Stage;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr auto kLook = std::chrono::microseconds(200);  // a fiftieth of what is measured
constexpr std::chrono::milliseconds kRead{20};          // of what the station prints
constexpr double kFelt_N = 0.2;                         // more than the friction of any of the mechanisms

constexpr double kDeflected = 0.1;  // of a rate input's full travel
constexpr int kGrips = 5;
constexpr double kAllowed_s = 15;                         // a new device's axes are tried at its first grip
constexpr double kGrip_s = 1.5;                           // the hand is down, and force has risen from its first 20 %
constexpr auto kLetGo = std::chrono::milliseconds(200);   // longer than a key that is held takes to type again
constexpr double kStranger_s = 1;                         // the owner looks four times meanwhile
constexpr auto kReplug = std::chrono::milliseconds(100);  // until the kernel has cleared up

constexpr gid_t kPlugdev = 46;  // guest/group

bool waits_until(const std::function<bool()>& is_so, double patience_s, std::chrono::microseconds look = kLook) {
  const std::int64_t end_ns = now_ns() + static_cast<std::int64_t>(patience_s * 1e9);
  while (!is_so()) {
    if (now_ns() > end_ns) return false;
    std::this_thread::sleep_for(look);
  }
  return true;
}

/// The station with its owner, and the memory between them.
class Watched {
 public:
  Watched(const LabDevice& device, bool is_bare)
      : is_bare_(is_bare), program_(command(device, is_bare), "/tmp/station.log") {}

  [[nodiscard]] bool is_linked() {
    if (link_) return true;
    owner_ = child_running(program_.pid(), "farfeel-device");
    if (owner_) link_ = link_of(*owner_);
    return link_.has_value();
  }
  [[nodiscard]] devices::Sample sample() const {
    devices::Sample newest;
    [[maybe_unused]] const bool is_whole = link_->memory().sample.load(newest);
    return newest;
  }
  /// No force is asked for.
  [[nodiscard]] bool asks_for_nothing() const {
    devices::Command newest;
    if (!link_->memory().command.load(newest)) return true;
    const auto& F = newest.F_hand_B;
    return !newest.is_force_on || (glm::length(F.force_N) == 0 && glm::length(F.torque_Nm) == 0);
  }
  [[nodiscard]] std::string advice() const {
    devices::FixedText<512> text;
    return link_->memory().advice.load(text) ? text.text() : std::string();
  }
  [[nodiscard]] bool is_unprivileged() const {
    return hardware_lab::is_unprivileged(program_.pid()) && owner_ && hardware_lab::is_unprivileged(*owner_);
  }
  [[nodiscard]] std::string printed() const { return program_.printed(); }
  /// As it told last; the station without haptics tells nothing of force, and gives it at once.
  [[nodiscard]] bool is_force_on() const {
    return is_bare_ || last("force is on") > std::max(last("force is off"), last("its axes are tried"));
  }
  [[nodiscard]] bool waits_for_a_grip() const {
    const auto ready = last("ready, force is off");
    return is_bare_ || (ready >= 0 && ready > std::max(last("force is on"), last("; force is off")));
  }
  void hold_key(bool is_held) { program_.hold_key(is_held); }
  [[nodiscard]] bool is_running() { return program_.is_running(); }
  [[nodiscard]] pid_t owner() const { return owner_.value_or(-1); }

 private:
  /// Where it said that last; below zero: it never did.
  [[nodiscard]] std::int64_t last(const char* what) const { return static_cast<std::int64_t>(printed().rfind(what)); }
  static std::vector<std::string> command(const LabDevice& device, bool is_bare) {
    std::vector<std::string> words =
        is_bare ? std::vector<std::string>{"farfeel-hardware-lab", "station", "--device", device.argument()}
                : std::vector<std::string>{"farfeel-master", "--device", device.argument(), "--seconds",   "86400",
                                           "--progress",     "none",     "--out",           "/tmp/session"};
    for (const std::string& more : device.more_arguments()) words.push_back(more);
    return words;
  }

  bool is_bare_;
  PersonsProgram program_;
  std::optional<pid_t> owner_;
  std::optional<devices::MappedLink> link_;
};

/// To three places.
double quantile(const std::vector<double>& values, double share) {
  return std::round(support::quantile(values, share) * 1000) / 1000;
}

/// deploy/udev's rule, in the guest.
void install_rule(bool is_installed) {
  const std::string rule = "/etc/udev/rules.d/70-farfeel.rules", away = "/etc/70-farfeel.rules";
  std::filesystem::rename(is_installed ? away : rule, is_installed ? rule : away);
  if (std::system("udevadm control --reload && udevadm settle") != 0) fmt::print(stderr, "udev does not reload\n");
}

bool is_given_to_people(const std::string& node) {
  struct stat about {};
  return !node.empty() && stat(node.c_str(), &about) == 0 && about.st_gid == kPlugdev && (about.st_mode & 0777) == 0660;
}

}  // namespace

Row drill(LabDevice& device, const DrillSettings& settings, const Tell& tell) {
  Row row;
  row.device = device.argument();
  row.has_force = device.has_force();
  const auto lacks = [&](const std::string& what) {
    row.trouble.push_back(what);
    tell(what);
  };

  tell("starting the station as an ordinary person");
  Watched station(device, settings.is_bare);
  if (!waits_until([&] { return station.is_linked() || !station.is_running(); }, 20) || !station.is_linked()) {
    lacks("the station did not start: " + station.printed());
    return row;
  }
  device.rest();
  if (device.plug_in_as_stranger()) {
    tell("the same device with ids that are nobody's is plugged in");
    const bool is_taken = waits_until([&] { return station.sample().stage != Stage::kAbsent; }, kStranger_s);
    row.stranger_told = !is_taken && station.advice().find("no ") != std::string::npos;
    tell("told: " + station.advice());
    device.pull_out();
    std::this_thread::sleep_for(kReplug);
  }
  if (device.needs_rule()) {
    tell("plugging it in where the udev rule is not installed");
    install_rule(false);
    device.plug_in();
    row.lack_of_rule_told = waits_until([&] { return station.advice().find("ermission") != std::string::npos; }, 3);
    tell("told: " + station.advice());
    if (station.sample().stage != Stage::kAbsent) lacks("it was opened without permission");
    device.pull_out();
    std::this_thread::sleep_for(kReplug);
    install_rule(true);
  }

  tell("plugging it in");
  device.plug_in();
  if (device.needs_rule()) {
    row.rule_applied = waits_until([&] { return is_given_to_people(device.node()); }, 5);
    if (!*row.rule_applied) lacks(fmt::format("udev did not give '{}' to the group plugdev", device.node()));
  }
  const auto becomes_ready = [&] {
    const std::int64_t since_ns = now_ns();
    return waits_until(
        [&] {
          if (station.sample().stage == Stage::kReady) return true;
          device.make_ready(static_cast<double>(now_ns() - since_ns) * 1e-9);
          return false;
        },
        20);
  };
  row.found = becomes_ready();
  row.unprivileged = station.is_unprivileged();
  if (!row.found) {
    lacks(fmt::format("it did not become ready: {} ({})", devices::name(station.sample().stage), station.advice()));
    return row;
  }
  tell("it is ready");

  const auto grip = [&](bool is_held) {
    if (device.has_key_at_station())
      station.hold_key(is_held);
    else
      device.grip(is_held);
  };
  // A person lifts the handle, takes hold, and goes down once force is on; who feels nothing does so again.
  const auto feel = [&] {
    for (int i = 0; i < kGrips; ++i) {
      device.lift();
      grip(false);
      std::this_thread::sleep_for(kLetGo);
      if (device.has_force() && !waits_until([&] { return station.waits_for_a_grip(); }, kAllowed_s, kRead)) continue;
      grip(true);
      if (device.has_force() && !waits_until([&] { return station.is_force_on(); }, kAllowed_s, kRead)) continue;
      device.press_down();
      const bool is_felt = waits_until(
          [&] {
            return device.has_force() ? device.force_N() > kFelt_N && !station.asks_for_nothing()
                                      : glm::length(station.sample().deflection.push) > kDeflected;
          },
          kGrip_s);
      if (is_felt) return true;
    }
    return false;
  };
  row.contact_felt = feel() && device.has_force();
  if (row.contact_felt)
    tell(fmt::format("its motors push back with {:.2f} N", device.force_N()));
  else if (device.has_force())
    lacks("no force came to its motors");

  for (int i = 0; i < settings.unplugs; ++i) {
    // Not always at the same place in the kernel's 4 ms or in the station's tick.
    std::this_thread::sleep_for(std::chrono::microseconds(50'000 + 3'137 * i));
    std::int64_t zero_ns = 0;
    std::thread watch([&] {  // from before the disconnect on
      if (waits_until([&] { return station.asks_for_nothing() && station.sample().stage != Stage::kReady; }, 1)) {
        zero_ns = now_ns();
      }
    });
    KernelLog kernel;
    const std::int64_t out_ns = device.pull_out();
    watch.join();
    if (zero_ns == 0) {
      lacks("a second after it was pulled out the station still asks for force");
      break;
    }
    // A device that is not on USB goes with the call that takes it away.
    const std::int64_t disconnected_ns = kernel.disconnected_ns().value_or(out_ns);
    row.zero_ms.push_back(static_cast<double>(zero_ns - disconnected_ns) * 1e-6);
    row.from_pull_ms.push_back(static_cast<double>(zero_ns - out_ns) * 1e-6);
    grip(false);
    device.rest();
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    device.plug_in();
    if (!becomes_ready()) {
      lacks(fmt::format("plugged in again it did not become ready: {} ({})", devices::name(station.sample().stage),
                        station.advice()));
      break;
    }
    ++row.replugged;
    if (!feel()) {
      lacks("plugged in again it did not do its work");
      break;
    }
    tell(fmt::format("unplugged {} of {}: zero {:.2f} ms after the kernel's disconnect, {:.2f} ms after the pull",
                     i + 1, settings.unplugs, row.zero_ms.back(), row.from_pull_ms.back()));
  }
  row.watchdog_trips = device.own_watchdog_trips();
  if (const auto watchdog_s = device.watchdog_s()) row.watchdog_ms = *watchdog_s * 1e3;

  if (device.stall()) {
    tell("its endpoints refuse");
    row.stall_told = waits_until(
        [&] {
          return station.asks_for_nothing() && station.sample().stage != Stage::kReady && !station.advice().empty();
        },
        2);
    tell("told: " + station.advice());
  }
  device.pull_out();
  return row;
}

std::string json(const Row& row) {
  nlohmann::ordered_json made{
      {"device", row.device}, {"found", row.found}, {"has_force", row.has_force}, {"contact_felt", row.contact_felt}};
  made["unplugs"] = row.zero_ms.size();
  if (!row.zero_ms.empty()) {
    made["unplug_to_zero_ms_p50"] = quantile(row.zero_ms, 0.5);
    made["unplug_to_zero_ms_p95"] = quantile(row.zero_ms, 0.95);
    made["unplug_to_zero_ms_max"] = quantile(row.zero_ms, 1);
    made["pull_to_zero_ms_p95"] = quantile(row.from_pull_ms, 0.95);
  }
  made["replugged"] = !row.zero_ms.empty() && row.replugged == static_cast<int>(row.zero_ms.size());
  made["unprivileged"] = row.unprivileged;
  if (row.rule_applied) made["udev_rule"] = *row.rule_applied;
  if (row.lack_of_rule_told) made["lack_of_rule_told"] = *row.lack_of_rule_told;
  if (row.stranger_told) made["wrong_ids_told"] = *row.stranger_told;
  if (row.stall_told) made["stall_told"] = *row.stall_told;
  if (row.watchdog_ms) made["own_watchdog_ms"] = *row.watchdog_ms;
  if (row.watchdog_trips > 0) made["own_watchdog_trips"] = row.watchdog_trips;
  if (!row.trouble.empty()) made["trouble"] = row.trouble;
  return made.dump();
}

}  // namespace farfeel::hardware_lab
