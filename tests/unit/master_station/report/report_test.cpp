#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <vector>

#include "master_station/report/embedded_page.h"
#include "master_station/report/report_glossary.h"
#include "master_station/report/report_page.h"
#include "master_station/report/session_csv.h"
#include "master_station/report/this_machine.h"
#include "master_station/report/tick_statistics.h"
#include "tests/support/private_folder.h"
#include "tests/unit/master_station/report/made_up_session.h"

namespace farfeel::master_station {
namespace {

TEST(TickStatistics, AgreeWithTheSession) {
  constexpr std::uint64_t kTicks = 10'000;
  TickStatistics statistics;
  double squared = 0, contacts = 0, greatest = 0;
  for (std::uint64_t i = 0; i < kTicks; ++i) {
    TickRecord tick = made_up_tick(i, kTicks);
    tick.ticks_missed = i / 1000;
    if (i == 5000 || i == 5001 || i == 7000) tick.state = LoopState::kFault;
    squared += glm::dot(tick.F_hand_W.force_N, tick.F_hand_W.force_N);
    greatest = std::max(greatest, glm::length(tick.F_hand_W.force_N));
    contacts += tick.contacts;
    statistics.add(tick);
  }
  SessionSummary s;
  statistics.fill(s);
  EXPECT_EQ(s.ticks, kTicks);
  EXPECT_EQ(s.ticks_missed, 9u);
  EXPECT_NEAR(s.seconds, 9.999, 1e-9);
  EXPECT_NEAR(s.tick_hz, 1000, 1e-6);
  EXPECT_DOUBLE_EQ(s.contact_share, 0.8);
  EXPECT_NEAR(s.contacts.mean_in_contact, contacts / 8000, 1e-12);
  EXPECT_EQ(s.contacts.max, 6);
  EXPECT_NEAR(s.force_N.rms, std::sqrt(squared / kTicks), 1e-12);
  EXPECT_EQ(s.force_N.max, greatest);
  EXPECT_EQ(s.faults, 2u) << "two stretches of fault";
  EXPECT_NEAR(s.rtt_ms.p50, 2, 0.1);
  EXPECT_NEAR(s.wake_us.max, 5, 0.01);
  EXPECT_DOUBLE_EQ(s.states.of[static_cast<std::size_t>(LoopState::kFree)], 0.2);
  EXPECT_DOUBLE_EQ(s.states.of[static_cast<std::size_t>(LoopState::kFault)], 3.0 / kTicks);
  EXPECT_EQ(s.energy.tank_least_J, 0) << "before the first contact";
  EXPECT_DOUBLE_EQ(s.energy.contact_port_J, 0.003 * 9.999);
}

/// Of 8 ticks 4 on tiles, 1 in which heights were late, 3 in which tiles rested.
TEST(SessionSummary, TellsLateHeightsFromTicksThatDidNotFit) {
  TickStatistics statistics;
  for (std::uint64_t i = 0; i < 8; ++i) {
    TickRecord tick = made_up_tick(i, 8);
    tick.rung = i < 4 ? 3 : 1;
    tick.is_resting = i > 4;
    statistics.add(tick);
  }
  SessionSummary s;
  EXPECT_EQ(closing_table(s).find("felt from tiles"), std::string::npos) << "none came";
  statistics.fill(s);
  s.local_model.tile_bytes = 1000;
  const auto says = [&](const char* words) { return closing_table(s).find(words) != std::string::npos; };
  EXPECT_TRUE(says("50.0 % of the ticks")) << closing_table(s);
  EXPECT_TRUE(says("heights were late in 12.5 %")) << closing_table(s);
  EXPECT_TRUE(says("rested in 37.5 % because ticks did not fit")) << closing_table(s);
  const auto back = summary_from_json(to_json(s));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(closing_table(*back), closing_table(s));
}

TEST(SessionSummary, TellsNothingOfAWayThatIsAllTold) {
  EXPECT_EQ(told(LaneCount{10, 8, 2, 1, 0}), "10 sent, 8 received, 2 lost, 1 late, 0 duplicate");
}

TEST(SessionSummary, TellsWhatContactsAreInDoubtOf) {
  SessionSummary s;
  EXPECT_EQ(closing_table(s).find("doubtful"), std::string::npos) << "nobody counted";
  s.doubts = {{"border", "at the window's border", 0}, {"silhouette", "at an edge", 0.125}};
  EXPECT_NE(closing_table(s).find("12.5 % at an edge\n"), std::string::npos) << closing_table(s);
  s.doubts[1].share = 0;
  EXPECT_NE(closing_table(s).find("none"), std::string::npos);
  s.doubts[1].share = 0.25;
  const auto back = summary_from_json(to_json(s));
  ASSERT_TRUE(back);
  ASSERT_EQ(back->doubts.size(), 2u);
  EXPECT_EQ(back->doubts[1].name, "silhouette");
  EXPECT_EQ(back->doubts[1].told, "at an edge");
  EXPECT_EQ(back->doubts[1].share, 0.25);
}

TEST(SessionSummary, HasExactlyTheAgreedFields) {
  const auto json = nlohmann::json::parse(to_json(SessionSummary{}));
  const auto fields = [](const nlohmann::json& object) {
    std::vector<std::string> names;
    for (const auto& [name, value] : object.items()) names.push_back(name);
    std::sort(names.begin(), names.end());
    return names;
  };
  EXPECT_EQ(fields(json), (std::vector<std::string>{"contact_share",
                                                    "contacts",
                                                    "doubts",
                                                    "down",
                                                    "energy",
                                                    "faults",
                                                    "force_N",
                                                    "local_model",
                                                    "loop",
                                                    "machine",
                                                    "masked_torque_Nm",
                                                    "pairs",
                                                    "rtt_ms",
                                                    "scene",
                                                    "scene_bytes",
                                                    "scene_ms",
                                                    "seconds",
                                                    "seed",
                                                    "slave_contact_hz",
                                                    "slave_contact_us",
                                                    "states",
                                                    "tick_hz",
                                                    "tick_us",
                                                    "ticks",
                                                    "ticks_missed",
                                                    "torque_Nm",
                                                    "up",
                                                    "wake_us"}));
  EXPECT_EQ(fields(json["loop"]), (std::vector<std::string>{"asked_hz", "controller", "integrator", "is_fifo",
                                                            "is_memory_locked", "page_faults", "rung"}));
  EXPECT_EQ(fields(json["energy"]), (std::vector<std::string>{"contact_port_J", "contact_port_least_J", "device_port_J",
                                                              "device_port_least_J", "tank_least_J", "truncations"}));
  EXPECT_EQ(fields(json["states"]),
            (std::vector<std::string>{"fading", "fault", "free", "held", "paused", "touching"}));
  EXPECT_EQ(fields(json["tick_us"]), (std::vector<std::string>{"max", "p50", "p99", "p99_9"}));
  EXPECT_EQ(fields(json["wake_us"]), (std::vector<std::string>{"max", "p50", "p99", "p99_9"}));
  EXPECT_EQ(fields(json["slave_contact_us"]), (std::vector<std::string>{"max", "p50", "p99"}));
  EXPECT_EQ(fields(json["contacts"]), (std::vector<std::string>{"max", "mean_in_contact"}));
  EXPECT_EQ(fields(json["pairs"]), (std::vector<std::string>{"max", "mean"}));
  EXPECT_EQ(fields(json["force_N"]), (std::vector<std::string>{"max", "rms"}));
  EXPECT_EQ(fields(json["rtt_ms"]), (std::vector<std::string>{"p50", "p99"}));
  EXPECT_EQ(fields(json["up"]), (std::vector<std::string>{"duplicate", "late", "lost", "received", "sent"}));
  EXPECT_TRUE(json["tick_us"]["p50"].is_null()) << "nobody measured it";
}

TEST(SessionSummary, ComesBackFromItsFile) {
  SessionSummary s;
  s.scene = "file \"on\" </script> CAD \xff";
  s.seed = 18446744073709551615u;
  s.seconds = 20.5;
  s.tick_us = {1, 2, 3, 4};
  s.slave_contact_us.p99 = 812.25;
  s.contacts = {3.25, 7};
  s.up = {1, 2, 3, 4, 5};
  s.loop = {"ours", "tiles", "midpoint", 5000, true, true, 3};
  s.energy.contact_port_least_J = -1e-7;
  s.states.of[2] = 0.125;
  s.machine = this_machine("farfeel loopback");
  const auto back = summary_from_json(to_json(s));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(to_json(*back), to_json(s));
  EXPECT_EQ(back->seed, s.seed);
  EXPECT_EQ(back->slave_contact_us.p99, 812.25);
  EXPECT_TRUE(std::isnan(back->slave_contact_us.p50));
  EXPECT_GT(back->machine.cores, 0);
  EXPECT_EQ(back->loop.integrator, "midpoint");
  EXPECT_EQ(back->loop.page_faults, 3);
  EXPECT_EQ(back->energy.contact_port_least_J, -1e-7);
  EXPECT_EQ(back->states.of[2], 0.125);
  EXPECT_FALSE(summary_from_json("{\"scene\": "));
  EXPECT_FALSE(summary_from_json("[1]"));
  EXPECT_TRUE(summary_from_json(R"({"seed":"one","up":3,"seconds":null,"unknown":1})"));
}

TEST(CommandLine, CanBePastedIntoAShell) {
  const char* const arguments[] = {"farfeel", "loopback", "--link", "rtt=50ms loss=1%", "it's", ""};
  EXPECT_EQ(command_line(6, arguments), "farfeel loopback --link 'rtt=50ms loss=1%' 'it'\\''s' ''");
}

TEST(ReportPage, CarriesEverythingItNeeds) {
  const test_support::PrivateFolder private_folder;
  const std::string& folder = private_folder.path();
  constexpr std::uint64_t kTicks = 3000;
  auto csv = SessionCsv::create(folder + "/" + kCsvFile);
  ASSERT_TRUE(csv);
  TickStatistics statistics;
  for (std::uint64_t i = 0; i < kTicks; ++i) {
    csv->append(made_up_tick(i, kTicks));
    statistics.add(made_up_tick(i, kTicks));
  }
  ASSERT_TRUE(csv->close());
  SessionSummary s;
  s.scene = "<file> & part";
  s.machine = this_machine("farfeel loopback");
  statistics.fill(s);
  s.up = {10108, 7976, 0, 3, 1};
  s.states.of = {0.25, 0.5, 0.125, 0.125, 0, 0};
  ASSERT_TRUE(write_summary(folder, s));
  std::ofstream(folder + "/" + kNoPicture) << "EGL has no device";

  const auto page = write_report(folder);
  ASSERT_TRUE(page) << page.error().message;
  std::ifstream file(*page);
  const std::string html(std::istreambuf_iterator<char>(file), {});
  EXPECT_NE(html.find("&lt;file&gt; &amp; part"), std::string::npos);
  EXPECT_EQ(html.find("<file>"), std::string::npos);
  EXPECT_NE(html.find("EGL has no device"), std::string::npos);
  EXPECT_NE(html.find(report_script()), std::string::npos);
  EXPECT_EQ(html.find("There are no plots") == std::string::npos, !report_script().empty());
  const auto record = read_summary(folder);
  ASSERT_TRUE(record);
  for (const char* words :
       {"10108 sent, 7976 received, 0 lost, 3 late, 1 duplicate; of 2132 the other end has not told",
        "free 25.0 %, touching 50.0 %, held 12.5 %, fading 12.5 %"}) {
    EXPECT_NE(html.find(words), std::string::npos) << "on the page";
    EXPECT_NE(closing_table(*record).find(words), std::string::npos) << closing_table(*record);
  }
  EXPECT_NE(html.find("All 3000 recorded ticks"), std::string::npos);
  for (const char* outside : {"src=\"http", "href=\"http", "@import", "url(http"})
    EXPECT_EQ(html.find(outside), std::string::npos) << "the page must open without a network";
  EXPECT_FALSE(write_report("/nowhere"));
}

TEST(ReportPage, EveryLineIsExplained) {
  const std::string html = report_html({}, {}, {});
  const std::string figures =
      html.substr(html.find("In figures"), html.find("What these lines mean") - html.find("In figures"));
  const std::regex line("<tr><th>([^<]+)</th>");
  int lines = 0;
  for (std::sregex_iterator i(figures.begin(), figures.end(), line), end; i != end; ++i, ++lines) {
    const std::string name = (*i)[1];
    if (name == "Started") break;  // of the machine, from here on
    EXPECT_FALSE(meaning_of(name).empty()) << name;
  }
  EXPECT_EQ(static_cast<std::size_t>(lines), kReportGlossary.size());
}

TEST(ReportPage, PartsAreInTheProgram) {
  EXPECT_NE(report_style().find("--line1"), std::string_view::npos);
  if (report_script().empty()) GTEST_SKIP() << "built without npm's packages: deploy/install-packages fetches them";
  EXPECT_GT(report_script().size(), 50'000u);
  EXPECT_EQ(report_script().find("</script"), std::string_view::npos) << "it would end the page's script element";
}

}  // namespace
}  // namespace farfeel::master_station
