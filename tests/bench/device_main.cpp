// farfeel-bench-device: what a device costs a haptic tick, and how old what it says is by then. farfeel-bench device
// runs it: it is a program of its own because emulated nodes want a library preloaded, and counting allocations wants
// malloc replaced.
//
// For each device its driver and channel are stepped by the owner on a thread of its own, as farfeel-device does; the
// other thread ticks at 1 kHz and reads and writes through shared memory, guard and mapping, as the haptic loop does.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "codecs/settings/command_line.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/guard/guarded_device.h"
#include "master_station/devices/hand/hand.h"
#include "master_station/devices/hand/linked_device.h"
#include "master_station/devices/host/owner.h"
#include "tests/bench/device_rigs.h"
#include "tests/support/devices/under_umockdev.h"
#include "tests/support/quantile.h"
#include "tests/support/realtime_guard.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using nlohmann::json;
using test_support::RealtimeGuard;

constexpr std::int64_t kTick_ns = 1'000'000, kNudge_ns = 20'000'000, kPatience_ns = 20'000'000'000;

json quantiles(const std::vector<double>& values) {
  return {{"p50", quantile(values, 0.5)}, {"p99", quantile(values, 0.99)}};
}

/// An owner on a thread of its own.
class SteppedOwner {
 public:
  SteppedOwner(devices::LinkMemory& memory, const BenchedDevice& benched)
      : owner_(memory, -1, std::span(&benched.family, 1), {}, benched.options),
        thread_([this] { owner_.run(stop_); }) {}
  ~SteppedOwner() {
    stop_ = true;
    thread_.join();
  }
  SteppedOwner(const SteppedOwner&) = delete;
  SteppedOwner& operator=(const SteppedOwner&) = delete;

 private:
  std::atomic<bool> stop_{false};
  devices::Owner owner_;
  std::thread thread_;
};

bool becomes_ready(devices::LinkMemory& memory, DeviceRig& rig) {
  devices::Sample sample;
  const std::int64_t end_ns = realtime::monotonic_now_ns() + kPatience_ns;
  while (realtime::monotonic_now_ns() < end_ns) {
    if (memory.sample.load(sample) && sample.stage == devices::Stage::kReady && sample.reports > 0) return true;
    rig.nudge(false);
    realtime::wait_until(realtime::monotonic_now_ns() + kNudge_ns, 0);
  }
  return false;
}

/// The model's data, and what the device itself says.
devices::DeviceModel model_of(const BenchedDevice& benched, devices::LinkMemory& memory) {
  devices::DeviceModel model;
  if (const devices::DeviceModel* const known = devices::find_model(benched.name)) model = *known;
  devices::OpenedDevice opened;
  if (memory.opened.load(opened))
    if (auto told = devices::parse_model(opened.model_toml.text(), benched.name, model)) model = *std::move(told);
  return model;
}

json measure(const BenchedDevice& benched, double seconds) {
  json row{{"device", benched.name}, {"channel", benched.channel}};
  const auto refuse = [&](const std::string& reason) {
    row["refused"] = reason;
    return row;
  };
  if (!benched.lacks.empty()) return refuse(benched.lacks);
  const std::unique_ptr<DeviceRig> rig = benched.plug_in();
  auto link = devices::MappedLink::create();
  if (!link) return refuse(link.error());
  devices::LinkMemory& memory = link->memory();
  const SteppedOwner owner(memory, benched);
  if (!becomes_ready(memory, *rig)) {
    devices::FixedText<512> advice;
    return refuse(memory.advice.load(advice) ? advice.text() : "it did not become ready");
  }

  const devices::DeviceModel model = model_of(benched, memory);
  devices::LinkedDevice linked(memory, {model, {}});
  devices::SourceDevice source(linked, devices::capabilities_of(model));
  devices::GuardedDevice guarded(source, {.model = model});
  devices::Hand hand(source, guarded, nullptr, nullptr, {});
  std::vector<double> read_ns, write_ns, link_ns, age_us, step_us;
  const auto ticks = static_cast<std::size_t>(seconds * 1e3);
  for (auto* values : {&read_ns, &write_ns, &link_ns, &age_us, &step_us}) values->reserve(ticks);
  const std::uint64_t before = RealtimeGuard::violations();
  realtime::use_fifo(40);
  realtime::Deadlines deadlines(realtime::monotonic_now_ns(), kTick_ns);
  for (std::size_t tick = 0; tick < ticks; ++tick, deadlines.advance(realtime::monotonic_now_ns())) {
    const std::int64_t begin_ns = realtime::wait_until(deadlines.current_ns(), 0);
    std::int64_t middle_ns = 0, end_ns = 0, linked_ns = 0;
    std::int64_t heard_ns = 0;
    {
      const RealtimeGuard none_of_it;
      const devices::Sample& sample = linked.newest(begin_ns);
      heard_ns = model.reports == devices::Reports::kStream ? sample.time_ns : sample.polled_ns;
      linked_ns = realtime::monotonic_now_ns();
      static_cast<void>(hand.read(begin_ns));
      middle_ns = realtime::monotonic_now_ns();
      static_cast<void>(hand.render({{0, 0, 0}, {0, 0, 0.1}}, {}));
      end_ns = realtime::monotonic_now_ns();
    }
    link_ns.push_back(static_cast<double>(linked_ns - begin_ns));
    read_ns.push_back(static_cast<double>(middle_ns - linked_ns));
    write_ns.push_back(static_cast<double>(end_ns - middle_ns));
    age_us.push_back(1e-3 * static_cast<double>(begin_ns - heard_ns));
    step_us.push_back(1e-3 * static_cast<double>(memory.step_ns.load(std::memory_order_relaxed)));
    if (tick % 20 == 0) rig->nudge(true);
  }
  row["read_ns"] = quantile(read_ns, 0.5);
  row["write_ns"] = quantile(write_ns, 0.5);
  row["link_read_ns"] = quantile(link_ns, 0.5);
  row["read_p99_ns"] = quantile(read_ns, 0.99);
  row["write_p99_ns"] = quantile(write_ns, 0.99);
  row["allocations"] = RealtimeGuard::violations() - before;
  row["sample_age_us"] = quantiles(age_us);
  row["emulated_exchange_us"] = quantiles(step_us);
  devices::Sample last;
  row["reports_per_s"] = memory.sample.load(last) ? static_cast<double>(last.reports) / seconds : 0;
  return row;
}

void tell(const json& row) {
  if (row.contains("refused")) {
    fmt::print("{:<17} refused: {}\n", row["device"].get<std::string>(), row["refused"].get<std::string>());
    return;
  }
  fmt::print("{:<17} {:6.0f} {:6.0f} {:6.0f} {:6} {:9.0f} {:7.0f} {:9.0f} {:7.0f}  {}\n",
             row["device"].get<std::string>(), row["link_read_ns"].get<double>(), row["read_ns"].get<double>(),
             row["write_ns"].get<double>(), row["allocations"].get<std::uint64_t>(),
             row["sample_age_us"]["p50"].get<double>(), row["sample_age_us"]["p99"].get<double>(),
             row["emulated_exchange_us"]["p50"].get<double>(), row["emulated_exchange_us"]["p99"].get<double>(),
             row["channel"].get<std::string>());
}

}  // namespace
}  // namespace farfeel::bench

int main(int argc, char** argv) {
  using namespace farfeel::bench;
  farfeel::test_support::enter_umockdev(argv);
  CLI::App app(
      "What a device costs a haptic tick, on emulated hardware: nothing here met a device.\n\n"
      "link read, read, write: median time of one load of the sample, of the whole read through link, guard and "
      "mapping, "
      "and of the write, ns. age: of the newest sample when a tick begins, us. exchange: a step of the driver, with "
      "the "
      "round trip of devices that answer; most of it is the emulator's.",
      "farfeel-bench device");
  double seconds = 5;
  bool as_json = false;
  app.add_option("--seconds", seconds, "for each device")->check(CLI::Range(0.2, 600.0))->capture_default_str();
  app.add_flag("--json", as_json, "one JSON object as the last line");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  if (!as_json)
    fmt::print("{:<17} {:>6} {:>6} {:>6} {:>6} {:>9} {:>7} {:>9} {:>7}\n", "device", "link", "read", "write", "alloc",
               "age p50", "p99", "exch. p50", "p99");
  nlohmann::json rows = nlohmann::json::array();
  for (const BenchedDevice& benched : benched_devices()) {
    rows.push_back(measure(benched, seconds));
    if (!as_json) tell(rows.back());
  }
  if (as_json) fmt::print("{}\n", nlohmann::json{{"rows", rows}}.dump());
  return 0;
}
