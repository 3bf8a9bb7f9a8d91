// farfeel: one word that leads to every program, as git's does.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/settings/command_line.h"
#include "codecs/settings/version.h"
#include "codecs/text/nearest_word.h"
#include "deploy/front/build_tree.h"
#include "deploy/front/child.h"
#include "deploy/front/config.h"
#include "deploy/front/doctor.h"
#include "deploy/front/elapsed.h"
#include "deploy/front/key.h"
#include "deploy/front/link_doctor.h"
#include "deploy/front/link_status.h"
#include "deploy/front/loopback.h"
#include "haptic_core/teleoperation/controller.h"
#include "master_station/report/report_page.h"
#include "master_station/report/this_machine.h"

namespace farfeel::front {
namespace {

constexpr std::array<std::string_view, 17> kCommands = {
    "loopback", "report", "doctor", "config", "key",   "link-status", "device", "slave", "master",
    "link",     "relay",  "bake",   "view",   "asset", "scene",       "replay", "bench"};

constexpr std::string_view kHelp = R"(farfeel: feel a textured object that is somewhere else

  farfeel loopback   both stations on this machine, a simulated operator, and a report
  farfeel view       a running session in a browser, as it happens
  farfeel report     make report.html again from a session's folder
  farfeel doctor     what this machine can do for a haptic loop, and what to do about what it can't
  farfeel config     what is set for which program, where, and what is wrong with it
  farfeel key        this machine's key, and whom it trusts
  farfeel link-status   what is known of this machine's stations' links, live with --watch
  farfeel device     the haptic device at the hand: list, watch, test, calibrate, identify-limits

  farfeel slave      the remote station: computes contacts and serves sessions
  farfeel master     the operator's station: drives a device against a remote scene
  farfeel link       a bad network between two UDP ends
  farfeel relay      on a public host: forwards between two ends that cannot reach each other
  farfeel bake       a mesh -> something that can be felt
  farfeel asset      what is in an asset, in figures or as a picture
  farfeel scene      what a scene file describes, and what is wrong with it; edit, watch, save: that of a slave that runs
  farfeel replay     a recorded session again, and the first tick that comes out otherwise
  farfeel bench      every measurement, by name; builds farfeel-bench first

Each takes --help ('farfeel help NAME' is the same) and --version. Examples:

  farfeel loopback
      a file scrapes a CAD part for 20 s; then open out/loopback/latest/report.html
  farfeel loopback --scene block-gear --seconds 5 --out /tmp/gear
  farfeel loopback --link "rtt=50ms jitter=5ms loss=1%"
      the same over a bad network
  farfeel slave --scene file-cad --listen 127.0.0.1:47000
  farfeel master --connect 127.0.0.1:47000 --device simulated --seconds 20 --out out/session
      the two stations by hand, in two terminals
)";

int loopback(int argc, char** argv, const std::string& command) {
  LoopbackWishes wishes;
  wishes.command = command;
  CLI::App app("Both stations on this machine, a link between them if asked, a simulated operator, and a report.",
               "farfeel loopback");
  auto* scene_option =
      app.add_option("--scene", wishes.scene, "the scene to feel: " FARFEEL_BUILT_IN_SCENES ", or a scene.toml file")
          ->capture_default_str();
  std::string object, tool;
  auto* object_option =
      app.add_option("--object", object, "an asset (.glb) to touch: with the probe of scan-probe, or with --tool")
          ->check(CLI::ExistingFile);
  app.add_option("--tool", tool, "the asset (.glb) to touch the object with, in place of a scene")
      ->check(CLI::ExistingFile)
      ->needs(object_option)
      ->excludes(scene_option);
  app.add_option("--seconds", wishes.seconds, "how long the operator explores [s]")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  app.add_option("--seed", wishes.seed, "of the operator's motion; the same seed, the same plan")
      ->capture_default_str();
  app.add_option("--link", wishes.link,
                 "a network between the stations, for example \"rtt=50ms jitter=5ms loss=1%\"; none unless told");
  app.add_option(
      "--out", wishes.out,
      "the folder for summary.json, session.csv, report.html and the stations' logs; unless told a new one in "
      "out/loopback for each run, and out/loopback/latest points to it");
  int csv_every = 0;
  app.add_option(
         "--csv-every", csv_every,
         "write every so many-th tick to session.csv, 1: all; unless told each of the first 60,000 and then ever "
         "fewer. What is around a fault is always whole")
      ->check(CLI::Range(1, 1'000'000));
  std::string penetration;
  app.add_option("--penetration", penetration,
                 "the slave's back end: auto, simd, egl, reference or historical; its default unless told")
      ->check(CLI::IsMember({"auto", "simd", "egl", "reference", "historical"}));
  int rate_hz = 0;
  std::string rung;
  app.add_option("--rung", rung,
                 "Local model: held, linear, quadratic, tiles or auto; the master's default unless told")
      ->check(CLI::IsMember({"auto", "held", "linear", "quadratic", "tiles"}));
  app.add_option("--rate", rate_hz, "of the haptic loop [Hz]; the master's default unless told")
      ->check(CLI::Range(100, 5000));
  std::string controller;
  app.add_option("--controller", controller,
                 "what renders: ours, or direct, waves or passivity to compare with; the master's default unless told")
      ->check(CLI::IsMember(farfeel::teleoperation::controller_names()));
  app.add_flag("--no-view", wishes.no_view, "start no live view; on a terminal one is started and its address printed");
  std::string integrator;
  app.add_option("--integrator", integrator,
                 "of the simulated tool: euler or midpoint; the master's default unless told")
      ->check(CLI::IsMember({"euler", "midpoint"}));
  std::string contact;
  app.add_option("--contact", contact,
                 "how contacts push: penalty (springs) or constraint (being tried); the master's default unless told")
      ->check(CLI::IsMember({"penalty", "constraint"}));
  app.footer(
      "Ctrl-C ends it early, with a report of what there is. Exit status: 0 ran to its end, 130 stopped, 1 failed.");
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  if (!object.empty() && scene_option->empty()) wishes.scene = tool.empty() ? "scan-probe" : "";
  for (const auto& [option, value] : {std::pair{"--scene", wishes.scene}, {"--object", object}, {"--tool", tool}}) {
    if (!value.empty()) wishes.to_slave.insert(wishes.to_slave.end(), {option, value});
  }
  if (!object.empty()) wishes.scene = fmt::format("{} with {}", object, tool.empty() ? wishes.scene : tool);
  if (!penetration.empty()) wishes.to_slave.insert(wishes.to_slave.end(), {"--penetration", penetration});
  if (rate_hz > 0) wishes.to_master = {"--rate", fmt::format("{}", rate_hz)};
  if (csv_every > 0) wishes.to_master.insert(wishes.to_master.end(), {"--csv-every", fmt::format("{}", csv_every)});
  if (!controller.empty()) wishes.to_master.insert(wishes.to_master.end(), {"--controller", controller});
  if (!integrator.empty()) wishes.to_master.insert(wishes.to_master.end(), {"--integrator", integrator});
  if (!contact.empty()) wishes.to_master.insert(wishes.to_master.end(), {"--contact", contact});
  if (!rung.empty()) wishes.to_master.insert(wishes.to_master.end(), {"--rung", rung});
  return run_loopback(wishes);
}

int doctor(int argc, char** argv) {
  CLI::App app(
      "What this machine can do for a haptic loop, and what to do about the rest; with --to, what the link to a slave "
      "can do.",
      "farfeel doctor");
  LinkWishes link;
  bool as_json = false;
  auto* const to = app.add_option("--to", link.to,
                                  "the slave: name or address, and its UDP port. Has a session with it, with the "
                                  "simulated hand and the keys that are trusted here");
  std::string slave, keys;
  auto* const name = app.add_option("--slave", slave, "its name in 'farfeel key list', where several are trusted");
  auto* const folder = app.add_option("--keys", keys, "the folder of the keys; ~/.config/farfeel/keys unless told");
  name->needs(to);
  folder->needs(to);
  app.add_option("--seconds", link.seconds, "how long that session lasts [s]")
      ->needs(to)
      ->check(CLI::Range(2.0, 600.0))
      ->capture_default_str();
  app.add_flag("--json", as_json, "one JSON object");
  app.footer("Exit status: 0 nothing is missing, 1 something is, or there was no session.");
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  if (link.to.empty())
    return tell_findings(examine_this_machine(), as_json, "This machine can run farfeel loopback.",
                         "Something is missing; see above.");
  if (!slave.empty()) link.to_master.insert(link.to_master.end(), {"--slave", slave});
  if (!keys.empty()) link.to_master.insert(link.to_master.end(), {"--keys", keys});
  const auto findings = examine_link(link);
  if (!findings) {
    fmt::print(stderr, "farfeel: {}\n", findings.error().message);
    return 1;
  }
  return tell_findings(*findings, as_json, "A scene there can be felt from here.",
                       "It cannot be felt over this link; see above.");
}

int report(int argc, char** argv) {
  CLI::App app("Makes DIR/report.html again from DIR/summary.json, DIR/session.csv and the pictures there.",
               "farfeel report");
  std::string folder;
  app.add_option("DIR", folder, "A session's folder")->required();
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  const auto path = master_station::write_report(folder);
  if (!path) {
    fmt::print(stderr, "farfeel: {}\n", path.error().message);
    return 1;
  }
  fmt::print("report: {}\n", std::filesystem::absolute(*path).lexically_normal().string());
  return 0;
}

// Never comes back when the program is there.
int hand_on(std::string_view command, std::span<char*> arguments) {
  const std::string name = fmt::format("farfeel-{}", command);
  if (command == "bench") {  // deploy/run leaves it out
    if (const auto built = bring_up_to_date(name, own_folder()); !built) {
      fmt::print(stderr, "farfeel: {}\n", built.error().message);
      return 1;
    }
  }
  const auto program = sibling(name);
  if (!program) {
    fmt::print(stderr, "farfeel: {}\n", program.error().message);
    return 1;
  }
  std::string own_name = name;
  std::vector<char*> handed = {own_name.data()};
  handed.insert(handed.end(), arguments.begin(), arguments.end());
  handed.push_back(nullptr);
  std::optional<Elapsed> elapsed;  // most measurements take minutes and say all at their end
  if (command == "bench") elapsed.emplace(fmt::format("{} {}", name, fmt::join(arguments, " ")));
  execv(program->c_str(), handed.data());
  fmt::print(stderr, "farfeel: could not run {}: {}\n", *program, std::strerror(errno));
  return 1;
}

int unknown(std::string_view command) {
  fmt::print(stderr, "farfeel: there is no command \"{}\"", command);
  if (const auto near = codecs::nearest_word(command, kCommands); !near.empty())
    fmt::print(stderr, "; did you mean \"farfeel {}\"?", near);
  fmt::print(stderr, "\nfarfeel --help lists them all.\n");
  return 2;
}

}  // namespace
}  // namespace farfeel::front

int main(int argc, char** argv) {
  using namespace farfeel::front;
  std::string_view command = argc > 1 ? argv[1] : "--help";
  std::string help_flag = "--help";
  if (command == "help" && argc > 2) {  // as git takes it: `farfeel help bake` is `farfeel bake --help`
    argv[1] = argv[2];
    argv[2] = std::data(help_flag);
    argc = 3;
    command = argv[1];
  }
  if (command == "--help" || command == "-h" || command == "help") {
    fmt::print("{}", kHelp);
    return argc > 1 ? 0 : farfeel::codecs::kUsageError;
  }
  if (command == "--version") {
    fmt::print("{}\n", farfeel::codecs::version_text("farfeel"));
    return 0;
  }
  const std::span<char*> rest(argv + 2, static_cast<std::size_t>(argc - 2));
  if (command == "loopback") return loopback(argc - 1, argv + 1, farfeel::master_station::command_line(argc, argv));
  if (command == "report") return report(argc - 1, argv + 1);
  if (command == "doctor") return doctor(argc - 1, argv + 1);
  if (command == "config") return config_command(argc - 1, argv + 1, kCommands);
  if (command == "key") return key_command(argc - 1, argv + 1);
  if (command == "link-status") return link_status_command(argc - 1, argv + 1);
  // What speaks with a slave that runs is another program than what reads files.
  if (command == "scene" && !rest.empty()) {
    for (const std::string_view spoken : {"edit", "watch", "save"})
      if (rest[0] == spoken) return hand_on("edit", rest);
  }
  for (const std::string_view known : kCommands)
    if (command == known) return hand_on(command, rest);
  if (sibling(fmt::format("farfeel-{}", command))) return hand_on(command, rest);  // as git finds its own
  return unknown(command);
}
