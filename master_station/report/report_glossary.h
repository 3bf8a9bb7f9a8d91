// What each line of the report means, for who reads one for the first time.
#pragma once

#include <array>
#include <string_view>
#include <utility>

namespace farfeel::master_station {

inline constexpr std::array<std::pair<std::string_view, std::string_view>, 19> kReportGlossary{{
    {"Scene, seed", "what was felt; the same seed makes the simulated hand move the same way"},
    {"Length",
     "of the session. A missed tick is one that could not begin in time, so that the force stayed for a tick "
     "longer"},
    {"Loop",
     "how often the force was computed. SCHED_FIFO: the kernel lets this thread run before ordinary ones; a page "
     "fault is a tick that waited for memory"},
    {"Rendering",
     "what computes the force. Rung: what it knows of the surfaces (held, linear, quadratic, tiles: the "
     "surfaces themselves)"},
    {"Tick's work", "how long a tick computed. p99: 99 % of the ticks took at most that; at 1 kHz there are 1000 µs"},
    {"Tick's wake-up", "how late ticks began; a few µs on a machine that is set up for it"},
    {"Contact service", "how often the slave answered with contacts, and how long an answer took it"},
    {"Contacts", "places where the tool pressed, as the loop felt them"},
    {"Pairs near", "convex pieces of tool and scene that the slave looked at closely"},
    {"Loop was",
     "free: nothing touched; touching; held: news was 50 ms late and the last surface was felt; fading: 250 "
     "ms late, the force went to zero; fault: something broke a limit"},
    {"Force on the hand", "after all limits. rms: the root of the mean of squares, over all ticks"},
    {"Torque on the hand", "the same of the turning force"},
    {"Round trip", "from a pose's departure to the arrival of its contacts, without what the slave computed"},
    {"Felt from tiles",
     "how often the surfaces themselves were felt, texture and all, and not contacts a round trip old"},
    {"Least energy",
     "what the hand, the contacts and the tank had given, at its least. Below zero something made energy: "
     "that would feel alive"},
    {"Updates", "changes of contacts that were let in bit by bit, because at once they would have made energy"},
    {"Poses up", "datagrams that tell the slave where the tool is"},
    {"Contacts down", "datagrams that tell what it touches"},
    {"Scene received", "what is drawn, and outlines of what is felt, before the session could begin"},
}};

/// Empty for a line that needs no words.
[[nodiscard]] constexpr std::string_view meaning_of(std::string_view line) {
  for (const auto& [name, meaning] : kReportGlossary)
    if (name == line) return meaning;
  return {};
}

}  // namespace farfeel::master_station
