// summary.json: one session in figures, as the master measured them. The fields and their names are the file's format.
//
// A figure that nobody could measure is NaN here and null in the file.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/haptic_loop/tick_record.h"

namespace farfeel::master_station {

struct ReportError {
  std::string message;  ///< what was tried, what was wrong, what to do
};

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// p50 is the median; each of these is within 1/32 of the sample's own quantile, max is exact.
struct LoopTimes {
  double p50 = kNotMeasured, p99 = kNotMeasured, p99_9 = kNotMeasured, max = kNotMeasured;
};
struct ServiceTimes {
  double p50 = kNotMeasured, p99 = kNotMeasured, max = kNotMeasured;
};
struct RoundTripTimes {
  double p50 = kNotMeasured, p99 = kNotMeasured;
};
struct ContactCount {
  double mean_in_contact = kNotMeasured;  ///< over the ticks that have a contact
  double max = kNotMeasured;
};
struct PairCount {
  double mean = kNotMeasured, max = kNotMeasured;
};
struct Magnitude {
  double rms = kNotMeasured, max = kNotMeasured;
};
struct LaneCount {
  std::uint64_t sent = 0, received = 0, lost = 0, late = 0, duplicate = 0;
};

/// How the loop was asked to run, and what the machine allowed.
struct LoopFigures {
  std::string controller, rung, integrator;  ///< as on the command line
  double asked_hz = kNotMeasured;
  bool is_fifo = false;  ///< ran under SCHED_FIFO
  bool is_memory_locked = false;
  std::int64_t page_faults = 0;  ///< during ticks, after the first 100
};

/// Energy, as the loop books it and as the device's own simulation does.
struct EnergyFigures {
  double tank_least_J = kNotMeasured;          ///< below 0: a debt
  double contact_port_least_J = kNotMeasured;  ///< what tool and moving objects had put into the contacts, at its least
  double device_port_least_J = kNotMeasured;   ///< the same of what the hand had put into the device
  double contact_port_J = kNotMeasured, device_port_J = kNotMeasured;  ///< in the end
  std::uint64_t truncations = 0;                                       ///< LocalModel::truncations()
};

/// Shares of the ticks.
struct StateShares {
  std::array<double, kLoopStates> of{kNotMeasured, kNotMeasured, kNotMeasured,
                                     kNotMeasured, kNotMeasured, kNotMeasured};
};

/// What the hand felt: the surfaces themselves, or contacts as the slave sent them.
struct LocalModelFigures {
  double tiles_share = kNotMeasured;        ///< ticks that felt nothing but tiles / ticks
  double resting_share = kNotMeasured;      ///< ticks in which tiles rested, because too many did not fit / ticks
  double outline_share = kNotMeasured;      ///< ticks in which a contact pushed with heights of the outline / ticks
  double outline_off_m = kNotMeasured;      ///< and how far the depth of such was from the true one, at most
  std::uint64_t ticks_spared = 0;           ///< of them, that took over the linearisation of the tick before
  std::uint64_t tiles = 0, tile_bytes = 0;  ///< height tiles received, and bytes of all messages that brought them
  /// Where tiles are felt at all: in the other ticks heights were late.
  [[nodiscard]] double late_share() const { return 1 - tiles_share - resting_share; }
};

/// A share of the slave's contacts that push, and what is to be known before believing them.
struct DoubtShare {
  std::string name, told;  ///< in the file; for a person
  double share = kNotMeasured;
};

/// Who, where, when. Empty where unknown.
struct Machine {
  std::string host, user, cpu, os, kernel, compiler, started_utc, command;
  int cores = 0;
  double memory_GiB = kNotMeasured;
};

struct SessionSummary {
  std::string scene;
  std::uint64_t seed = 0;
  double seconds = kNotMeasured;
  double tick_hz = kNotMeasured;  ///< measured
  std::uint64_t ticks = 0;
  std::uint64_t ticks_missed = 0;
  LoopTimes tick_us;                       ///< work of a tick, waiting not counted
  LoopTimes wake_us;                       ///< how late a tick began
  double slave_contact_hz = kNotMeasured;  ///< measured by the slave
  ServiceTimes slave_contact_us;           ///< measured by the slave
  double contact_share = kNotMeasured;     ///< ticks in contact / ticks
  ContactCount contacts;                   ///< of the local model, pressing
  PairCount pairs;                         ///< of pieces nearer than the tolerance
  Magnitude force_N, torque_Nm;            ///< on the hand, over all ticks
  Magnitude masked_torque_Nm;              ///< wanted, of a device that cannot turn the hand
  RoundTripTimes rtt_ms;                   ///< from a pose's departure to its contacts' arrival
  LaneCount up, down;                      ///< datagrams of the haptic lane
  std::uint64_t scene_bytes = 0;           ///< received before the session could start
  double scene_ms = kNotMeasured;          ///< that took so long
  LocalModelFigures local_model;
  LoopFigures loop;
  EnergyFigures energy;
  StateShares states;
  std::vector<DoubtShare> doubts;  ///< empty: nobody counted
  std::uint64_t faults = 0;        ///< times the loop latched a fault
  Machine machine;
};

[[nodiscard]] std::string to_json(const SessionSummary&);
/// Unknown fields are ignored, missing ones keep their defaults: an older or newer summary still makes a report.
[[nodiscard]] tl::expected<SessionSummary, ReportError> summary_from_json(std::string_view json);

/// For people: three significant digits (or the decimals asked for), never an exponent; "-" when nobody measured it.
[[nodiscard]] std::string shown_figure(double value, int decimals = -1);

/// A few lines for the terminal: what a person asks first, with units.
[[nodiscard]] std::string closing_table(const SessionSummary&);
/// Its line about one way of a link, the same on the page.
[[nodiscard]] std::string told(const LaneCount&);
/// Its line about states, the same on the page: the share of the ticks in each, held and fading always.
[[nodiscard]] std::string told(const StateShares&);
/// Its line about tiles.
[[nodiscard]] std::string felt_from_tiles(const LocalModelFigures&);

}  // namespace farfeel::master_station
