#include "master_station/report/session_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace farfeel::master_station {
namespace {

using Json = nlohmann::ordered_json;

// JSON has no NaN: a figure that nobody measured is null.
Json figure(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

void read(const Json& from, const char* field, double& to) {
  if (const auto at = from.find(field); at != from.end() && at->is_number()) to = at->get<double>();
}
void read(const Json& from, const char* field, std::uint64_t& to) {
  if (const auto at = from.find(field); at != from.end() && at->is_number_unsigned()) to = at->get<std::uint64_t>();
}
void read(const Json& from, const char* field, std::int64_t& to) {
  if (const auto at = from.find(field); at != from.end() && at->is_number_integer()) to = at->get<std::int64_t>();
}
void read(const Json& from, const char* field, bool& to) {
  if (const auto at = from.find(field); at != from.end() && at->is_boolean()) to = at->get<bool>();
}
void read(const Json& from, const char* field, int& to) {
  if (const auto at = from.find(field); at != from.end() && at->is_number_integer()) to = at->get<int>();
}
void read(const Json& from, const char* field, std::string& to) {
  if (const auto at = from.find(field); at != from.end() && at->is_string()) to = at->get<std::string>();
}
Json part(const Json& from, const char* field) {
  const auto at = from.find(field);
  return at != from.end() && at->is_object() ? *at : Json::object();
}

Json json_of(const LoopTimes& t) {
  return {{"p50", figure(t.p50)}, {"p99", figure(t.p99)}, {"p99_9", figure(t.p99_9)}, {"max", figure(t.max)}};
}
void read(const Json& from, LoopTimes& to) {
  read(from, "p50", to.p50);
  read(from, "p99", to.p99);
  read(from, "p99_9", to.p99_9);
  read(from, "max", to.max);
}

Json json_of(const Magnitude& m) {
  return {{"rms", figure(m.rms)}, {"max", figure(m.max)}};
}
void read(const Json& from, Magnitude& to) {
  read(from, "rms", to.rms);
  read(from, "max", to.max);
}

Json json_of(const LoopFigures& f) {
  return {{"controller", f.controller},     {"rung", f.rung},       {"integrator", f.integrator},
          {"asked_hz", figure(f.asked_hz)}, {"is_fifo", f.is_fifo}, {"is_memory_locked", f.is_memory_locked},
          {"page_faults", f.page_faults}};
}
void read(const Json& from, LoopFigures& to) {
  read(from, "controller", to.controller);
  read(from, "rung", to.rung);
  read(from, "integrator", to.integrator);
  read(from, "asked_hz", to.asked_hz);
  read(from, "is_fifo", to.is_fifo);
  read(from, "is_memory_locked", to.is_memory_locked);
  read(from, "page_faults", to.page_faults);
}

Json json_of(const EnergyFigures& e) {
  return {{"tank_least_J", figure(e.tank_least_J)},
          {"contact_port_least_J", figure(e.contact_port_least_J)},
          {"device_port_least_J", figure(e.device_port_least_J)},
          {"contact_port_J", figure(e.contact_port_J)},
          {"device_port_J", figure(e.device_port_J)},
          {"truncations", e.truncations}};
}
void read(const Json& from, EnergyFigures& to) {
  read(from, "tank_least_J", to.tank_least_J);
  read(from, "contact_port_least_J", to.contact_port_least_J);
  read(from, "device_port_least_J", to.device_port_least_J);
  read(from, "contact_port_J", to.contact_port_J);
  read(from, "device_port_J", to.device_port_J);
  read(from, "truncations", to.truncations);
}

Json json_of(const StateShares& shares) {
  Json json = Json::object();
  for (std::size_t i = 0; i < kLoopStates; ++i)
    json[std::string(name(static_cast<LoopState>(i)))] = figure(shares.of[i]);
  return json;
}
void read(const Json& from, StateShares& to) {
  for (std::size_t i = 0; i < kLoopStates; ++i)
    read(from, std::string(name(static_cast<LoopState>(i))).c_str(), to.of[i]);
}

Json json_of(const LaneCount& n) {
  return {{"sent", n.sent}, {"received", n.received}, {"lost", n.lost}, {"late", n.late}, {"duplicate", n.duplicate}};
}
void read(const Json& from, LaneCount& to) {
  read(from, "sent", to.sent);
  read(from, "received", to.received);
  read(from, "lost", to.lost);
  read(from, "late", to.late);
  read(from, "duplicate", to.duplicate);
}

Json json_of(const std::vector<DoubtShare>& doubts) {
  Json json = Json::object();
  for (const DoubtShare& doubt : doubts) json[doubt.name] = {{"told", doubt.told}, {"share", figure(doubt.share)}};
  return json;
}
void read(const Json& from, std::vector<DoubtShare>& to) {
  for (const auto& [name, doubt] : from.items()) {
    if (!doubt.is_object()) continue;
    to.push_back({.name = name, .told = name});
    read(doubt, "told", to.back().told);
    read(doubt, "share", to.back().share);
  }
}

Json json_of(const Machine& m) {
  return {{"host", m.host},       {"user", m.user},
          {"cpu", m.cpu},         {"cores", m.cores},
          {"os", m.os},           {"memory_GiB", figure(m.memory_GiB)},
          {"kernel", m.kernel},   {"compiler", m.compiler},
          {"command", m.command}, {"started_utc", m.started_utc}};
}
void read(const Json& from, Machine& to) {
  read(from, "host", to.host);
  read(from, "user", to.user);
  read(from, "cpu", to.cpu);
  read(from, "cores", to.cores);
  read(from, "memory_GiB", to.memory_GiB);
  read(from, "os", to.os);
  read(from, "kernel", to.kernel);
  read(from, "compiler", to.compiler);
  read(from, "started_utc", to.started_utc);
  read(from, "command", to.command);
}

// "1.23 unit", or a dash when nobody measured it.
std::string shown(double value, std::string_view unit, int decimals = -1) {
  return unit.empty() || !std::isfinite(value) ? shown_figure(value, decimals)
                                               : fmt::format("{} {}", shown_figure(value, decimals), unit);
}

/// Largest first; "none" where there are none.
std::string doubtful(std::vector<DoubtShare> doubts) {
  std::stable_sort(doubts.begin(), doubts.end(),
                   [](const DoubtShare& a, const DoubtShare& b) { return a.share > b.share; });
  std::string out;
  for (const DoubtShare& doubt : doubts) {
    if (!(doubt.share > 0)) continue;
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", shown(100 * doubt.share, "%", 1), doubt.told);
  }
  return out.empty() ? "none" : out;
}

}  // namespace

std::string to_json(const SessionSummary& s) {
  const Json json = {
      {"scene", s.scene},
      {"seed", s.seed},
      {"seconds", figure(s.seconds)},
      {"tick_hz", figure(s.tick_hz)},
      {"ticks", s.ticks},
      {"ticks_missed", s.ticks_missed},
      {"tick_us", json_of(s.tick_us)},
      {"wake_us", json_of(s.wake_us)},
      {"slave_contact_hz", figure(s.slave_contact_hz)},
      {"slave_contact_us",
       {{"p50", figure(s.slave_contact_us.p50)},
        {"p99", figure(s.slave_contact_us.p99)},
        {"max", figure(s.slave_contact_us.max)}}},
      {"contact_share", figure(s.contact_share)},
      {"contacts", {{"mean_in_contact", figure(s.contacts.mean_in_contact)}, {"max", figure(s.contacts.max)}}},
      {"pairs", {{"mean", figure(s.pairs.mean)}, {"max", figure(s.pairs.max)}}},
      {"force_N", json_of(s.force_N)},
      {"masked_torque_Nm", json_of(s.masked_torque_Nm)},
      {"torque_Nm", json_of(s.torque_Nm)},
      {"rtt_ms", {{"p50", figure(s.rtt_ms.p50)}, {"p99", figure(s.rtt_ms.p99)}}},
      {"up", json_of(s.up)},
      {"down", json_of(s.down)},
      {"scene_bytes", s.scene_bytes},
      {"scene_ms", figure(s.scene_ms)},
      {"local_model",
       {{"tiles_share", figure(s.local_model.tiles_share)},
        {"resting_share", figure(s.local_model.resting_share)},
        {"outline_share", figure(s.local_model.outline_share)},
        {"outline_off_m", figure(s.local_model.outline_off_m)},
        {"ticks_spared", s.local_model.ticks_spared},
        {"tiles", s.local_model.tiles},
        {"tile_bytes", s.local_model.tile_bytes}}},
      {"loop", json_of(s.loop)},
      {"energy", json_of(s.energy)},
      {"states", json_of(s.states)},
      {"doubts", json_of(s.doubts)},
      {"faults", s.faults},
      {"machine", json_of(s.machine)},
  };
  // A host name or command line need not be UTF-8: replace, so that writing a report can't fail on it.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

tl::expected<SessionSummary, ReportError> summary_from_json(std::string_view text) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object())
    return tl::unexpected(ReportError{"summary.json is not a JSON object; run the session again to write a new one"});

  SessionSummary s;
  read(json, "scene", s.scene);
  read(json, "seed", s.seed);
  read(json, "seconds", s.seconds);
  read(json, "tick_hz", s.tick_hz);
  read(json, "ticks", s.ticks);
  read(json, "ticks_missed", s.ticks_missed);
  read(part(json, "tick_us"), s.tick_us);
  read(part(json, "wake_us"), s.wake_us);
  read(json, "slave_contact_hz", s.slave_contact_hz);
  const Json service = part(json, "slave_contact_us");
  read(service, "p50", s.slave_contact_us.p50);
  read(service, "p99", s.slave_contact_us.p99);
  read(service, "max", s.slave_contact_us.max);
  read(json, "contact_share", s.contact_share);
  const Json contacts = part(json, "contacts");
  read(contacts, "mean_in_contact", s.contacts.mean_in_contact);
  read(contacts, "max", s.contacts.max);
  const Json pairs = part(json, "pairs");
  read(pairs, "mean", s.pairs.mean);
  read(pairs, "max", s.pairs.max);
  read(part(json, "force_N"), s.force_N);
  read(part(json, "masked_torque_Nm"), s.masked_torque_Nm);
  read(part(json, "torque_Nm"), s.torque_Nm);
  const Json rtt = part(json, "rtt_ms");
  read(rtt, "p50", s.rtt_ms.p50);
  read(rtt, "p99", s.rtt_ms.p99);
  read(part(json, "up"), s.up);
  read(part(json, "down"), s.down);
  read(json, "scene_bytes", s.scene_bytes);
  read(json, "scene_ms", s.scene_ms);
  const Json model = part(json, "local_model");
  read(model, "tiles_share", s.local_model.tiles_share);
  read(model, "resting_share", s.local_model.resting_share);
  read(model, "outline_share", s.local_model.outline_share);
  read(model, "outline_off_m", s.local_model.outline_off_m);
  read(model, "ticks_spared", s.local_model.ticks_spared);
  read(model, "tiles", s.local_model.tiles);
  read(model, "tile_bytes", s.local_model.tile_bytes);
  read(part(json, "loop"), s.loop);
  read(part(json, "energy"), s.energy);
  read(part(json, "states"), s.states);
  read(part(json, "doubts"), s.doubts);
  read(json, "faults", s.faults);
  read(part(json, "machine"), s.machine);
  return s;
}

std::string shown_figure(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  if (decimals < 0) {
    const double size = std::abs(value);
    decimals = size >= 99.95 || size < 0.0005 ? 0 : std::max(0, 2 - static_cast<int>(std::floor(std::log10(size))));
  }
  decimals = std::min(decimals, 6);
  if (std::abs(value) < 0.5 * std::pow(10, -decimals)) value = 0;  // no minus before a zero
  return fmt::format("{:.{}f}", value, decimals);
}

std::string felt_from_tiles(const LocalModelFigures& model) {
  return fmt::format(
      "{} of the ticks; heights were late in {}, tiles rested in {} because ticks did not fit; {} tiles, {:.0f} kB "
      "received",
      shown(100 * model.tiles_share, "%", 1), shown(100 * model.late_share(), "%", 1),
      shown(100 * model.resting_share, "%", 1), model.tiles, static_cast<double>(model.tile_bytes) / 1e3);
}

std::string told(const LaneCount& n) {
  const std::uint64_t known = n.received + n.lost;
  return fmt::format("{} sent, {} received, {} lost, {} late, {} duplicate{}", n.sent, n.received, n.lost, n.late,
                     n.duplicate,
                     n.sent > known ? fmt::format("; of {} the other end has not told", n.sent - known) : "");
}

std::string told(const StateShares& shares) {
  std::string all;
  for (std::size_t i = 0; i < kLoopStates; ++i) {
    const auto state = static_cast<LoopState>(i);
    if (!(shares.of[i] > 0) && state != LoopState::kHeld && state != LoopState::kFading) continue;
    all += fmt::format("{}{} {}", all.empty() ? "" : ", ", name(state), shown(100 * shares.of[i], "%", 1));
  }
  return all;
}

std::string closing_table(const SessionSummary& s) {
  std::string out;
  const auto line = [&out](std::string_view what, const std::string& figures) {
    out += fmt::format("  {:<18} {}\n", what, figures);
  };
  line("scene", fmt::format("{}, seed {}, {}", s.scene, s.seed, shown(s.seconds, "s", 1)));
  line("haptic loop",
       fmt::format("{} measured; {} of {} ticks missed", shown(s.tick_hz, "Hz", 1), s.ticks_missed, s.ticks));
  if (!s.loop.controller.empty())
    line("  as", fmt::format("{}, rung {}, {}, {} thread, {} page faults after warm-up", s.loop.controller, s.loop.rung,
                             s.loop.integrator, s.loop.is_fifo ? "SCHED_FIFO" : "ordinary", s.loop.page_faults));
  line("  work", fmt::format("p50 {}, p99 {}, p99.9 {}, max {}", shown(s.tick_us.p50, ""), shown(s.tick_us.p99, ""),
                             shown(s.tick_us.p99_9, ""), shown(s.tick_us.max, "us")));
  line("  wake-up", fmt::format("p50 {}, p99 {}, p99.9 {}, max {}", shown(s.wake_us.p50, ""), shown(s.wake_us.p99, ""),
                                shown(s.wake_us.p99_9, ""), shown(s.wake_us.max, "us")));
  line("contact service",
       fmt::format("{}; p50 {}, p99 {}, max {}", shown(s.slave_contact_hz, "Hz", 0), shown(s.slave_contact_us.p50, ""),
                   shown(s.slave_contact_us.p99, ""), shown(s.slave_contact_us.max, "us")));
  line("in contact",
       fmt::format("{} of the ticks; {} contacts on average then, at most {}", shown(100 * s.contact_share, "%", 1),
                   shown(s.contacts.mean_in_contact, "", 2), shown(s.contacts.max, "", 0)));
  line("loop was", told(s.states));
  if (s.local_model.tile_bytes > 0) {
    line("felt from tiles", felt_from_tiles(s.local_model));
  }
  if (s.local_model.outline_share > 0) {
    line("felt by outline", fmt::format("{} of the ticks, heights being late; off by at most {} then",
                                        shown(100 * s.local_model.outline_share, "%", 1),
                                        shown(1e3 * s.local_model.outline_off_m, "mm", 3)));
  }
  if (!s.doubts.empty()) line("doubtful contacts", doubtful(s.doubts));
  line("pairs near", fmt::format("{} on average, at most {}", shown(s.pairs.mean, "", 0), shown(s.pairs.max, "", 0)));
  if (s.masked_torque_Nm.max > 0)
    line("torque masked", fmt::format("rms {}, max {}: the device cannot turn the hand",
                                      shown(s.masked_torque_Nm.rms, ""), shown(s.masked_torque_Nm.max, "Nm")));
  line("force", fmt::format("rms {}, max {}", shown(s.force_N.rms, ""), shown(s.force_N.max, "N")));
  line("torque", fmt::format("rms {}, max {}", shown(1e3 * s.torque_Nm.rms, ""), shown(1e3 * s.torque_Nm.max, "mNm")));
  line("round trip", fmt::format("p50 {}, p99 {}", shown(s.rtt_ms.p50, ""), shown(s.rtt_ms.p99, "ms")));
  line("poses up", told(s.up));
  line("contacts down", told(s.down));
  line("scene received",
       fmt::format("{:.0f} kB in {}", static_cast<double>(s.scene_bytes) / 1e3, shown(s.scene_ms, "ms", 0)));
  if (std::isfinite(s.energy.contact_port_least_J))
    line("least energy",
         fmt::format("tank {}, contact port {}, device port {}", shown(1e3 * s.energy.tank_least_J, "", 3),
                     shown(1e3 * s.energy.contact_port_least_J, "", 3),
                     shown(1e3 * s.energy.device_port_least_J, "mJ", 3)));
  line("faults", fmt::format("{}", s.faults));
  return out;
}

}  // namespace farfeel::master_station
