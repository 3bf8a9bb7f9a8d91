// farfeel-edit: changes the scene of a slave that runs, tells what changes there, and saves it. 'farfeel scene edit',
// 'farfeel scene watch' and 'farfeel scene save' start it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "codecs/felt/session_object.h"
#include "codecs/scene/saved_scene.h"
#include "codecs/scene/scene_description.h"
#include "codecs/settings/command_line.h"
#include "codecs/wire/course_message.h"
#include "codecs/wire/edit_messages.h"
#include "codecs/wire/pose_grid.h"
#include "master_station/editing/save.h"
#include "master_station/editing/saved_folder.h"
#include "master_station/editing/side_link.h"
#include "transport/lane/lane_keys.h"

namespace farfeel::master_station {
namespace {

constexpr double kLook_s = 0.05;
constexpr std::int64_t kAskAgain_ns = 100'000'000;  // between two sendings of one request

volatile std::sig_atomic_t stopped = 0;

struct Arguments {
  SideLink::Options link;
  double timeout_s = 10;
  std::string object;
  std::vector<double> at_m, turned_deg;
  double radius_m = 0.005, depth_m = 0.0005, takes_s = 1;
  double seconds = 0;
  bool is_json = false, is_to_be_durable = false;
  std::string folder = "saved-scene";
};

int fail(const std::string& message) {
  fmt::print(stderr, "farfeel scene: {}\n", message);
  return 1;
}

/// Until the slave is heard; what is the matter where it is not.
std::string come_up(SideLink& link, double timeout_s) {
  const std::int64_t until_ns = transport::monotonic_ns() + static_cast<std::int64_t>(1e9 * timeout_s);
  while (!link.is_heard()) {
    if (stopped != 0) return "stopped";
    const auto trouble = link.client().bulk_greeting().trouble();
    const bool is_final = trouble == transport::GreetingTrouble::kNotAllowed;
    if (is_final || transport::monotonic_ns() > until_ns)
      return fmt::format("no session with the slave at {}: {}", transport::to_string(link.slave()), link.trouble());
    link.look(kLook_s, [](const transport::Message&) {});
  }
  return {};
}

codecs::EditRequest request_of(const Arguments& arguments, codecs::EditKind kind) {
  codecs::EditRequest request;
  request.number = transport::random_identity();
  request.kind = kind;
  request.object = arguments.object;
  const glm::dvec3 at_m =
      arguments.at_m.empty() ? glm::dvec3(0) : glm::dvec3(arguments.at_m[0], arguments.at_m[1], arguments.at_m[2]);
  if (kind == codecs::EditKind::kStamp) {
    request.place_M = at_m;
    request.radius_m = arguments.radius_m;
    request.depth_m = arguments.depth_m;
  } else if (!arguments.at_m.empty()) {
    const glm::dvec3 turned_deg =
        arguments.turned_deg.empty()
            ? glm::dvec3(0)
            : glm::dvec3(arguments.turned_deg[0], arguments.turned_deg[1], arguments.turned_deg[2]);
    request.X_WM = spatial::Pose{spatial::rotation_from_vector(turned_deg * (std::numbers::pi / 180)), at_m};
  }
  if (kind == codecs::EditKind::kMove) request.takes_s = arguments.takes_s;
  return request;
}

/// Asks until it is answered: the slave makes one edit of one number, however often it hears it.
int edit(const Arguments& arguments, codecs::EditKind kind) {
  std::array<std::byte, codecs::kMostEditBytes> payload;
  const codecs::EditRequest request = request_of(arguments, kind);
  const std::size_t bytes = codecs::write(request, payload);
  if (bytes == 0)
    return fail(fmt::format("an object's name has 1 to {} bytes, and a stamp's depth is at most its ball's radius",
                            codecs::kMostEditName));
  auto link = SideLink::open(arguments.link);
  if (!link) return fail(link.error().message);
  if (const std::string trouble = come_up(*link, arguments.timeout_s); !trouble.empty()) return fail(trouble);
  const std::int64_t until_ns = transport::monotonic_ns() + static_cast<std::int64_t>(1e9 * arguments.timeout_s);
  std::optional<codecs::EditAnswer> answer, last;
  for (std::int64_t asked_ns = 0; !answer && stopped == 0 && transport::monotonic_ns() < until_ns;) {
    if (transport::monotonic_ns() - asked_ns >= kAskAgain_ns) {
      asked_ns = transport::monotonic_ns();
      link->send(transport::MessageType::kEditRequest, std::span(payload).first(bytes));
    }
    link->look(kLook_s, [&](const transport::Message& message) {
      if (message.type != transport::MessageType::kEditAnswer) return;
      auto read = codecs::read_edit_answer(message.payload);
      if (read && read->number == request.number) answer = std::move(read);
    });
    // Asked again, the slave says how it stands with what it has made.
    if (arguments.is_to_be_durable && answer && answer->outcome == codecs::EditOutcome::kToBeKept) {
      last = std::exchange(answer, std::nullopt);
    }
  }
  link->end();
  if (!answer && last)
    return fail(fmt::format("{}, and not on the slave's disk within {:g} s", last->words, arguments.timeout_s));
  if (!answer)
    return fail(fmt::format("the slave did not answer within {:g} s: whether the edit was made is not known{}",
                            arguments.timeout_s, link->trouble().empty() ? "" : "; " + link->trouble()));
  if (!answer->is_done()) return fail(answer->words);
  const bool is_durable = answer->outcome == codecs::EditOutcome::kDurable;
  fmt::print("{} (version {} of the scene{})\n", answer->words, answer->version, is_durable ? ", durable" : "");
  if (arguments.is_to_be_durable && !is_durable)
    return fail("it is lost when the slave ends, which keeps nothing: farfeel slave --state DIR keeps what is changed");
  return 0;
}

/// The scene's objects and what they do, a line for each change.
class Watch {
 public:
  explicit Watch(bool is_json) : is_json_(is_json) {}

  /// False where what came is no scene.
  bool take_scene(const transport::ReceivedObject& object) {
    const auto bytes = object.object->bytes();
    if (bytes.size() < codecs::kPoseGridBytes) return false;
    const auto parts = codecs::session_object_in(bytes.subspan(codecs::kPoseGridBytes));
    if (!parts) return false;
    // Meshes are not looked at, and so not decoded.
    const auto scene = codecs::read_scene(parts->scene, [](std::span<const codecs::CodedMesh> meshes) {
      return codecs::DecodedMeshes(std::vector<codecs::ColouredMesh>(meshes.size()));
    });
    if (!scene) return false;
    names_.clear();
    for (const codecs::SceneObject& each : scene->objects) names_.push_back(each.name);
    if (!is_json_) fmt::print("'{}', {} objects\n", scene->name, names_.size());
    for (const codecs::SceneObject& each : scene->objects) say(each.name, 0, each.is_there, each.X_WO.p, 0);
    return true;
  }
  void take(const transport::Message& message) {
    if (message.type == transport::MessageType::kCourse) {
      const auto told = codecs::read_course(message.payload);
      if (told && told->object < names_.size())
        say(names_[told->object], told->course.version, told->course.is_there, told->course.X_to_WO.p,
            told->course.takes_s);
    } else if (message.type == transport::MessageType::kSceneNews) {
      const auto news = codecs::read_scene_news(message.payload);
      if (!news || news->version == version_) return;
      version_ = news->version;
      if (is_json_) {
        fmt::print("{{\"version\": {}, \"words\": {}}}\n", version_, quoted(news->words));
      } else {
        fmt::print("version {}: {}\n", version_, news->words);
      }
      std::fflush(stdout);
    }
  }

 private:
  /// As JSON has it.
  static std::string quoted(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  void say(const std::string& name, std::uint32_t version, bool is_there, const glm::dvec3& p_WO, double takes_s) {
    if (is_json_) {
      fmt::print("{{\"object\": {}, \"course\": {}, \"present\": {}, \"p_WO_m\": [{:.9g}, {:.9g}, {:.9g}]}}\n",
                 quoted(name), version, is_there, p_WO.x, p_WO.y, p_WO.z);
    } else if (is_there) {
      fmt::print("  '{}' {} ({:.4f}, {:.4f}, {:.4f}) m{}\n", name, takes_s > 0 ? "moves to" : "is at", p_WO.x, p_WO.y,
                 p_WO.z, takes_s > 0 ? fmt::format(" within {:g} s", takes_s) : "");
    } else {
      fmt::print("  '{}' is not there\n", name);
    }
    std::fflush(stdout);
  }

  bool is_json_;
  std::vector<std::string> names_;
  std::uint32_t version_ = 0;
};

int save(Arguments arguments) {
  if (const std::string why = in_the_way_of(arguments.folder); !why.empty()) return fail(why);
  arguments.link.takes = transport::SessionClient::Takes::kSaved;
  auto link = SideLink::open(arguments.link);
  if (!link) return fail(link.error().message);
  if (const std::string trouble = come_up(*link, arguments.timeout_s); !trouble.empty()) return fail(trouble);
  const auto scene = asked_scene(*link, arguments.timeout_s, [] { return stopped != 0; });
  link->end();
  if (!scene) return fail(scene.error());
  const auto saved = write_saved_folder(scene->object.object->bytes(), arguments.folder);
  if (!saved) return fail(saved.error());
  fmt::print("{}: {} objects and the tool, {:.2f} MB, version {} of the scene; to serve it: farfeel slave --scene {}\n",
             arguments.folder, saved->objects, 1e-6 * static_cast<double>(saved->bytes), scene->answer.version,
             (std::filesystem::path(arguments.folder) / codecs::kSavedSceneFile).string());
  return 0;
}

int watch(Arguments arguments) {
  arguments.link.takes = transport::SessionClient::Takes::kScene;
  auto link = SideLink::open(arguments.link);
  if (!link) return fail(link.error().message);
  if (const std::string trouble = come_up(*link, arguments.timeout_s); !trouble.empty()) return fail(trouble);
  Watch watching(arguments.is_json);
  const std::int64_t until_ns = transport::monotonic_ns() + static_cast<std::int64_t>(1e9 * arguments.seconds);
  std::vector<std::vector<std::byte>> early;  // what came before the scene
  std::optional<transport::ObjectHash> shown;
  bool was_heard = true;
  while (stopped == 0 && (arguments.seconds == 0 || transport::monotonic_ns() < until_ns)) {
    link->look(kLook_s, [&](const transport::Message& message) {
      if (shown) return watching.take(message);
      early.emplace_back(1, static_cast<std::byte>(message.type));
      early.back().insert(early.back().end(), message.payload.begin(), message.payload.end());
    });
    if (link->is_heard() != was_heard) {
      was_heard = !was_heard;
      fmt::print(stderr, "farfeel scene: {}\n", was_heard ? "the slave is heard again" : link->trouble());
    }
    if (!link->client().has_offered_scene()) continue;
    const transport::ReceivedObject& scene = *link->client().scene();
    if (shown == scene.hash) continue;
    shown = scene.hash;
    if (!watching.take_scene(scene)) return fail("what the slave sent is no scene of this version");
    for (const std::vector<std::byte>& message : early)
      watching.take({static_cast<transport::MessageType>(message[0]), std::span(message).subspan(1), true});
    early.clear();
  }
  link->end();
  return 0;
}

}  // namespace
}  // namespace farfeel::master_station

int main(int argc, char** argv) {
  using namespace farfeel::master_station;
  using farfeel::codecs::EditKind;
  Arguments arguments;
  CLI::App app{
      "farfeel scene edit, farfeel scene watch, farfeel scene save: change the scene of a slave that runs, see it "
      "change, and keep it as it is.\n\n"
      "To be edited, the slave's scene must be editable (editable = true in its file, or farfeel slave --editable). "
      "This machine's key must be allowed to edit or to watch there: farfeel key trust operator NAME KEY --role "
      "operate,edit. On one machine, without keys of your own, everything is allowed.",
      "farfeel-edit"};
  app.require_subcommand(1);
  const auto add_link = [&](CLI::App* command) {
    command->add_option("--connect", arguments.link.slave,
                        "The slave: name or address, and its UDP port, 47000 unless told; this machine unless told");
    command->add_option("--keys", arguments.link.keys,
                        "Folder of this machine's keys; ~/.config/farfeel/keys unless told");
    command->add_option("--slave", arguments.link.name, "Which of the trusted slaves it is, where there are several");
    command->add_option("--timeout", arguments.timeout_s, "How long to wait for the slave [s]")
        ->check(CLI::Range(0.1, 3600.0))
        ->capture_default_str();
  };
  CLI::App* const edit_command = app.add_subcommand("edit", "Change the scene: each edit is made once, or refused");
  edit_command->require_subcommand(1);
  struct Edit {
    const char* name;
    EditKind kind;
    const char* words;
    CLI::App* command = nullptr;
  };
  std::array<Edit, 5> edits{{{"stamp", EditKind::kStamp, "Press a ball into an object's surface"},
                             {"spawn", EditKind::kSpawn, "Bring an object that the scene has and that is not there"},
                             {"move", EditKind::kMove, "Move an object on a straight way"},
                             {"remove", EditKind::kRemove, "Take an object away"},
                             {"revert", EditKind::kRevert, "The object as it was in the scene's file"}}};
  for (Edit& each : edits) {
    CLI::App* const command = each.command = edit_command->add_subcommand(each.name, each.words);
    add_link(command);
    command->add_flag("--durable", arguments.is_to_be_durable, "Wait until it is on the slave's disk (its --state)");
    command->add_option("OBJECT", arguments.object, "Its name in the scene")->required();
    if (each.kind == EditKind::kStamp) {
      command->add_option("--at", arguments.at_m, "Near where, in the object's own coordinates [m]: X Y Z")
          ->expected(3)
          ->required();
      command->add_option("--radius", arguments.radius_m, "Of the ball [m]")
          ->check(CLI::Range(1e-5, farfeel::codecs::kMostEditRadius_m))
          ->capture_default_str();
      command->add_option("--depth", arguments.depth_m, "Of its lowest point below the surface [m]")
          ->check(CLI::Range(1e-6, farfeel::codecs::kMostEditRadius_m))
          ->capture_default_str();
    } else if (each.kind == EditKind::kSpawn || each.kind == EditKind::kMove) {
      auto* const at =
          command->add_option("--at", arguments.at_m, "Where the object's origin comes to stand [m]: X Y Z")
              ->expected(3);
      if (each.kind == EditKind::kMove) at->required();
      command->add_option("--turned", arguments.turned_deg, "Its axis times its angle [deg]: X Y Z")
          ->expected(3)
          ->needs(at);
    }
    if (each.kind == EditKind::kMove)
      command->add_option("--takes", arguments.takes_s, "On the way [s]")
          ->check(CLI::Range(0.05, 3600.0))
          ->capture_default_str();
  }
  CLI::App* const watch_command =
      app.add_subcommand("watch", "Tell the scene's objects, and each change, until Ctrl-C");
  add_link(watch_command);
  watch_command->add_option("--seconds", arguments.seconds, "End after so long [s]; 0: with Ctrl-C")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  watch_command->add_flag("--json", arguments.is_json, "A line of JSON for each object and each change");
  CLI::App* const save_command = app.add_subcommand(
      "save",
      "Write the scene as it is now into a folder: a scene.toml that a slave starts from, and an asset (.glb) for each "
      "object and the tool. Dents are felt there, and drawn as little as before; nothing is left of a timeline");
  add_link(save_command);
  save_command->add_option("-o,--out", arguments.folder, "The folder to make; nothing may be in it")
      ->capture_default_str();
  app.footer(
      "Examples:\n  farfeel scene edit stamp block --at 0 0 0.02 --radius 0.01 --depth 0.0008\n"
      "  farfeel scene edit move visitor --at 0.05 0 0 --takes 2 --connect lab.example.org\n"
      "  farfeel scene watch --json\n  farfeel scene save -o stamped --connect lab.example.org");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { stopped = 1; });
  if (watch_command->parsed()) return watch(arguments);
  if (save_command->parsed()) return save(arguments);
  for (const Edit& each : edits) {
    if (each.command->parsed()) return edit(arguments, each.kind);
  }
  return 2;
}
