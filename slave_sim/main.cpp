// farfeel-slave: the remote node. Loads a scene, then answers tool poses with contacts until it is told to stop.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "codecs/settings/command_line.h"
#include "codecs/settings/log.h"
#include "codecs/settings/stop_signals.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "slave_sim/bake/progress_line.h"
#include "slave_sim/confinement/confinement.h"
#include "slave_sim/depths/chosen_depths.h"
#include "slave_sim/living/living_scene.h"
#include "slave_sim/living/served_world.h"
#include "slave_sim/session/operators.h"
#include "slave_sim/session/slave_session.h"
#include "slave_sim/world/world.h"
#include "transport/status/status_file.h"

namespace farfeel::slave_sim {
namespace {

struct Arguments {
  SceneWish wish;
  std::string listen = "127.0.0.1:47000";
  std::string keys;
  std::string relay, relay_token;
  int ready_fd = -1;
  std::uint32_t grid_samples = 0;
  std::string penetration = "auto";
  double edit_at_s = -1;
  bool is_editable = false;
  std::string state;
  std::string user;
  bool is_unconfined = false;
};

constexpr const char* kAbout = R"(farfeel-slave: the remote node of a haptic session.

Loads a scene, computes the contacts of the textured tool with its objects, and serves them over one UDP port to one
farfeel-master at a time: tool poses come in, contacts, the scene and its heights go out. All of it is sealed, and only
operators whose keys are trusted here get in ('farfeel key --help'). On this machine alone, 127.0.0.1 or [::1], both
programs make keys for the occasion by themselves.)";

int fail(const std::string& message) {
  spdlog::error("{}", message);
  return 1;
}

int serve(const Arguments& arguments) {
  realtime::give_threads_room();
  const Confinement confinement({.is_on = !arguments.is_unconfined,
                                 .user = arguments.user,
                                 .penetration = arguments.penetration,
                                 .say = [](const std::string& line) { spdlog::info("{}", line); },
                                 .warn = [](const std::string& line) { spdlog::warn("{}", line); }});
  if (const auto dropped = confinement.drop_privileges(); !dropped) return fail(dropped.error());
  std::unique_ptr<Journal> journal;  // opened before files are closed to it
  if (!arguments.state.empty()) {
    auto opened = Journal::open(arguments.state);
    if (!opened) return fail(opened.error());
    journal = *std::move(opened);
  }
  auto definition = wished_scene(arguments.wish);
  if (!definition) return fail(definition.error().message);
  if (arguments.is_editable) make_editable(*definition);
  if (arguments.grid_samples != 0) definition->grid_samples = arguments.grid_samples;
  const auto address = transport::parse_address(arguments.listen, transport::kDefaultPort);
  if (!address) return fail(address.error().message);
  const bool is_relayed = !arguments.relay.empty();  // then others than this machine's come, wherever it listens
  auto operators = Operators::open(arguments.keys, is_relayed ? transport::any_address() : *address);
  if (!operators) return fail(operators.error().message);
  std::optional<transport::RelayAccess> relay;
  if (is_relayed) {
    auto access = transport::relay_access(arguments.relay, arguments.relay_token, operators->own().public_key);
    if (!access) return fail(access.error().message);
    relay = *std::move(access);
  }
  if (operators->count() == 0)
    spdlog::warn(
        "nobody may operate this slave yet: paste an operator's line from 'farfeel key show' here; it counts at once");
  // Opened before it is confined: it may make no file there afterwards.
  const auto status_file = transport::open_status_file();
  if (!status_file) spdlog::warn("'farfeel link-status' will not know of this slave: {}", status_file.error().message);
  confinement.restrict_files(*definition, std::filesystem::path(operators->path()).parent_path());
  const sigset_t stop = codecs::hold_stop_signals();    // before a bake or a graphics driver starts threads
  std::optional<codecs::StopsEndAtOnce> at_once(stop);  // a large scene takes a while, and there is nothing to end yet
  auto world = [&definition] {
    ProgressLine progress({.to = stderr, .is_terminal = {}, .log = [](const std::string& words) {
                             spdlog::info("making the scene ready: {}", words);
                           }});
    return load_world(*std::move(definition),
                      [&progress](const std::string& stage, double done) { progress.show(stage, done); });
  }();
  if (!world) return fail(world.error().message);
  for (const std::string& note : world->notes) spdlog::info("{}", note);
  auto living = LivingScene::of(*world);
  if (!living) return fail(living.error().message);
  const codecs::SceneDescription description = description_of(*world);
  auto scene = codecs::write_scene(description);
  if (!scene) return fail(scene.error().message);

  const SceneDefinition& wanted = world->definition;
  const bool has_texture = is_textured(*world);
  const auto depths =
      choose_depths({.name = arguments.penetration, .is_textured = has_texture, .on_loss = [](const std::string& why) {
                       spdlog::warn("the graphics device is lost: {}; simd goes on", why);
                     }});
  if (!depths) return fail(depths.error());
  spdlog::info("penetration depths by {}", depths->reason);
  // What masters are told first is the beginning, whatever was changed since: who knows it needs the changes alone.
  ServedWorld served(*world, *living, depths->maker);
  if (!served.trouble().empty()) spdlog::warn("{}; masters feel linearised contacts only", served.trouble());
  if (journal) {
    const auto kept = living->keep_in(*journal, [](const std::string& why) { spdlog::error("{}", why); });
    if (!kept) return fail(kept.error().message);
    served.take(living->changes());
    if (journal->torn_bytes() > 0)
      spdlog::warn("{} bytes at the end of the scene's journal were half an entry, and are left out",
                   journal->torn_bytes());
    if (living->version() > 0) spdlog::info("the scene is as it was left, in version {}", living->version());
  }

  const std::size_t scene_bytes = scene->size();
  tool::MassProperties body{world->tool.mass_kg, {}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      body.inertia_To_T(row, column) = world->tool.inertia_O_kg_m2[column][row];
  SlaveSession::Options session_options;
  session_options.local = *address;
  session_options.own = operators->own();
  session_options.relay = relay;
  session_options.find = [&operators](const transport::Key32& key) { return operators->find(key); };
  session_options.look_at_list = [&operators] {
    if (const auto trouble = operators->look())
      spdlog::warn("{}", trouble->empty() ? "the list of operators is right again" : *trouble);
  };
  session_options.log = [](const std::string& line) { spdlog::info("{}", line); };
  session_options.grid =
      codecs::grid_around(description.exploration.region_low_W, description.exploration.region_high_W);
  session_options.body = body;
  session_options.tell_status = [&status_file](const transport::LinkStatus& status) {
    if (status_file) status_file->write(status);
  };
  at_once.reset();
  confinement.restrict_calls(has_texture);
  auto session = SlaveSession::start(session_options, *std::move(scene), served.contacts(), served.felt());
  if (!session) return fail(session.error().message);
  const transport::Address local = (*session)->local();
  spdlog::info("serving '{}' on {} ({:.1f} kB of scene); Ctrl-C ends", wanted.title, transport::to_string(local),
               static_cast<double>(scene_bytes) * 1e-3);
  if (arguments.ready_fd >= 0) {
    const std::string ready = fmt::format("ready {}\n", local.port);
    if (::write(arguments.ready_fd, ready.data(), ready.size()) < 0) spdlog::warn("nobody reads --ready-fd");
    ::close(arguments.ready_fd);
  }
  const std::jthread editing([&](const std::stop_token& end) {
    living->run(end, **session, arguments.edit_at_s, [](const std::string& words) { spdlog::info("{}", words); });
  });
  int signal = 0;
  sigwait(&stop, &signal);
  spdlog::info("stopping on {}", codecs::stop_in_words(signal));
  return 0;
}

}  // namespace
}  // namespace farfeel::slave_sim

int main(int argc, char** argv) {
  using namespace farfeel::slave_sim;
  Arguments arguments;
  CLI::App app{kAbout, "farfeel-slave"};
  app.add_option("--scene", arguments.wish.scene,
                 fmt::format("A built-in scene ({}) or a scene.toml file; file-cad unless told, scan-probe with an "
                             "--object alone",
                             fmt::join(built_in_scene_names(), ", ")));
  app.add_option("--object", arguments.wish.object, "An asset (.glb) to touch: with --tool, or in scene scan-probe")
      ->check(CLI::ExistingFile);
  app.add_option("--tool", arguments.wish.tool, "The asset (.glb) to touch it with")->check(CLI::ExistingFile);
  app.add_option("--listen", arguments.listen,
                 "Address and UDP port; 0.0.0.0:47000 or [::]:47000 serve other machines; port 0 takes a free one")
      ->capture_default_str();
  app.add_option(
      "--keys", arguments.keys,
      "Folder of this slave's keys; ~/.config/farfeel/keys unless told, and keys made for the occasion where "
      "it serves this machine alone");
  auto* const relay =
      app.add_option("--relay", arguments.relay,
                     "A farfeel-relay that masters may come over as well: name or address, and its UDP port, 47200 "
                     "unless told. No port has to be let in here for them");
  app.add_option("--relay-token", arguments.relay_token, "File with what 'farfeel-relay token' printed at the relay")
      ->needs(relay);
  app.add_option("--grid", arguments.grid_samples, "Samples along a side of the penetration grid; 0: the scene's")
      ->check(CLI::Range(0, 400))
      ->capture_default_str();
  app.add_option(
         "--penetration", arguments.penetration,
         "Back end of the penetration depth: auto (measured at the start), simd, egl (a graphics card), the slow "
         "obvious reference, or historical (the source's own algorithm)")
      ->check(CLI::IsMember(depth_names()))
      ->capture_default_str();
  auto* const edit_at =
      app.add_option("--edit-at", arguments.edit_at_s,
                     "Seconds after the first master came, halve the height of the objects' texture: to feel a surface "
                     "that changes while it is touched [s]")
          ->check(CLI::Range(0.0, 86400.0));
  app.add_flag("--editable", arguments.is_editable,
               "Let 'farfeel scene edit' change the scene while it lives, as editable = true in its file does");
  app.add_option("--state", arguments.state,
                 "Folder in which the scene's changes are kept: the next start with it makes them again, also after a "
                 "crash")
      ->excludes(edit_at);
  app.add_option("--user", arguments.user,
                 "Whom it becomes when root starts it; who called sudo unless told, 'root' keeps the name alone");
  app.add_flag("--unconfined", arguments.is_unconfined,
               "Keep all privileges, files and system calls; for debugging only")
      ->configurable(false);
  app.add_option("--ready-fd", arguments.ready_fd, "Write 'ready PORT' to this file descriptor once serving")
      ->configurable(false);
  app.footer(
      "Examples:\n  farfeel-slave --scene file-cad --listen 127.0.0.1:47000\n"
      "  farfeel-slave --scene file-cad --relay relay.example.org --relay-token token\n"
      "  farfeel-slave --scene scan-probe --object bunny.glb\n"
      "  farfeel-slave --object part.glb --tool probe.glb");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  farfeel::codecs::log_as("slave");
  return serve(arguments);
}
