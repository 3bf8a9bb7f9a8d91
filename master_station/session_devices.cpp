#include "master_station/session_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "codecs/text/nearest_word.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/hand/hand_words.h"
#include "master_station/devices/model/known_devices.h"
#include "master_station/devices/place.h"

namespace farfeel::master_station {
namespace {

using devices::DeviceModel;
using devices::FoundDevice;
using devices::Stage;

constexpr std::chrono::milliseconds kLook{50};
constexpr double kTelling_Nm = 0.01;  // masked torque worth a word: 1 N at 10 mm

/// One line of `farfeel-device list --machine` (devices/host/found_list.h).
struct Listed {
  FoundDevice found;
  DeviceModel model;
};

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char letter : line) {
    if (letter == '\t') {
      fields.emplace_back();
    } else if (letter != '\n') {
      fields.back() += letter;
    }
  }
  return fields;
}

std::vector<Listed> listed_devices(const DeviceWishes& wishes) {
  constexpr std::size_t kFields = 6;
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error).replace_filename("farfeel-device");
  std::string command = fmt::format("'{}' list --machine", program.string());
  if (!wishes.options.plug_in.empty()) command += fmt::format(" --plug-in '{}'", wishes.options.plug_in);
  std::vector<Listed> listed;
  std::FILE* const pipe = ::popen(command.c_str(), "re");
  if (pipe == nullptr) return listed;
  std::array<char, 2048> line{};
  while (std::fgets(line.data(), static_cast<int>(line.size()), pipe) != nullptr) {
    const std::vector<std::string> fields = fields_of(line.data());
    if (fields.size() != kFields) continue;
    Listed device{{fields[0], fields[1], fields[2], fields[5]}, {}};
    if (const DeviceModel* const model = devices::find_model(fields[0])) {
      device.model = *model;
    } else {  // a plug-in's own: all of it is known once it is opened
      device.model.name = device.model.title = fields[0];
      device.model.force_dof = fields[3] == "3" ? 3 : fields[3] == "2" ? 2 : fields[3] == "1" ? 1 : 0;
      device.model.position_dof = 3;
      device.model.tells = fields[4] == "rate" ? devices::Tells::kRate : devices::Tells::kPose;
    }
    listed.push_back(std::move(device));
  }
  ::pclose(pipe);
  return listed;
}

/// What is named and not plugged in yet is waited for.
void add_those_awaited(const devices::HandChoice& choice, std::vector<Listed>& listed) {
  std::vector<devices::DeviceName> named = choice.devices;
  if (choice.orientation_device) named.push_back(*choice.orientation_device);
  if (choice.view_device) named.push_back(*choice.view_device);
  for (const devices::DeviceName& name : named) {
    const bool is_there = std::any_of(listed.begin(), listed.end(), [&](const Listed& device) {
      return name.fits(device.found.model, device.found.serial);
    });
    const DeviceModel* const model = devices::find_model(name.name);
    if (!is_there && model != nullptr) listed.push_back({{name.name, name.serial, "", ""}, *model});
  }
}

constexpr std::string_view kSimulated = "simulated";

/// "simulated", or "simulated:MODEL": that model, null where there is none of the name. Nothing: it is another device.
std::optional<const DeviceModel*> simulated_model(std::string_view device) {
  if (!device.starts_with(kSimulated)) return std::nullopt;
  const std::string_view rest = device.substr(kSimulated.size());
  if (rest.empty()) return devices::find_model(kSimulated);
  return rest.front() == ':' ? std::optional(devices::find_model(rest.substr(1))) : std::nullopt;
}

struct Meant {
  const DeviceModel* simulated = nullptr;  ///< else those below
  std::vector<Listed> listed;
  devices::HandChoice choice;
};

tl::expected<Meant, std::string> meant_by(const DeviceWishes& wishes) {
  const std::vector<std::string> names = devices::model_names();
  if (wishes.choice.device.size() == 1) {
    if (const auto simulated = simulated_model(wishes.choice.device.front())) {
      if (*simulated != nullptr) return Meant{*simulated, {}, {}};
      const std::string& asked = wishes.choice.device.front();
      const std::string_view meant = codecs::nearest_word(asked.substr(asked.find(':') + 1),
                                                          std::vector<std::string_view>(names.begin(), names.end()));
      return tl::unexpected(fmt::format("'{}': no model has that name; {}there are {}", asked,
                                        meant.empty() ? "" : fmt::format("did you mean {}? ", meant),
                                        fmt::join(names, ", ")));
    }
  }
  // What is plugged in goes by its own name, too: a plug-in's device is no model of ours.
  Meant meant;
  meant.listed = listed_devices(wishes);
  std::vector<std::string> nameable = names;
  for (const Listed& device : meant.listed) {
    if (!wishes.options.plug_in.empty() && device.found.path == wishes.options.plug_in && !device.found.trouble.empty())
      return tl::unexpected(device.found.trouble);
    if (std::find(names.begin(), names.end(), device.found.model) == names.end())
      nameable.push_back(device.found.model);
  }
  const auto choice =
      devices::parse_choice(wishes.choice, std::vector<std::string_view>(nameable.begin(), nameable.end()));
  if (!choice) return tl::unexpected(choice.error().message);
  meant.choice = *choice;
  if (choice->is_simulated) meant.simulated = devices::find_model(kSimulated);
  return meant;
}

}  // namespace

tl::expected<std::unique_ptr<SessionDevices::Part>, std::string> SessionDevices::open_part(
    const FoundDevice& found, const DeviceWishes& wishes, const Tell& tell, const std::function<bool()>& should_stop) {
  devices::OwnerProcess::Options options;
  options.arguments = {"--device", found.serial.empty() ? found.model : found.model + ":" + found.serial};
  if (!wishes.options.firmware.empty())
    options.arguments.insert(options.arguments.end(), {"--firmware", wishes.options.firmware});
  if (!wishes.options.plug_in.empty())
    options.arguments.insert(options.arguments.end(), {"--plug-in", wishes.options.plug_in});
  auto owner = devices::OwnerProcess::start(options);
  if (!owner) return tl::unexpected(owner.error());
  auto part = std::make_unique<Part>(Part{*std::move(owner), {}, {}, {}, {}});
  while (part->owner.newest().stage != Stage::kReady) {
    if (should_stop()) return tl::unexpected(std::string("stopped while waiting for the device"));
    if (const std::string news = part->owner.look(realtime::monotonic_now_ns()); !news.empty()) tell(news);
    if (const std::string advice = part->owner.advice(); !advice.empty() && advice != part->told) {
      part->told = advice;
      tell(fmt::format("{}: {}", found.model, advice));
    }
    std::this_thread::sleep_for(kLook);
  }

  const devices::OpenedDevice opened = part->owner.opened();
  part->serial = opened.serial.text();
  DeviceModel model;
  if (const DeviceModel* const known = devices::find_model(opened.model.text())) model = *known;
  model.name = opened.model.text();
  if (const std::string toml = opened.model_toml.text(); !toml.empty()) {
    auto parsed = devices::parse_model(toml, "what " + opened.path.text() + " says of itself", model);
    if (!parsed) return tl::unexpected(parsed.error().message);
    model = *std::move(parsed);
  }
  part->file.model = model;
  if (const auto folder = devices::device_folder()) {
    auto file = devices::read_device_file(*folder + "/" + devices::device_file_name(model.name, part->serial), model);
    if (!file) return tl::unexpected(file.error().message);
    part->file = *std::move(file);
  }
  if (part->file.model.title.empty()) part->file.model.title = model.name;
  part->linked = std::make_unique<devices::LinkedDevice>(part->owner.memory(), part->file);
  if (model.force_dof > 0 && !opened.has_keeper)
    tell(fmt::format(
        "the {} can't be reached from a second process: if farfeel-device dies, the device itself holds the "
        "last force for {}",
        part->file.model.title,
        std::isfinite(model.holds_force_s) ? fmt::format("{:g} s", model.holds_force_s) : "ever"));
  return part;
}

tl::expected<std::unique_ptr<SessionDevices>, std::string> SessionDevices::open(
    const DeviceWishes& wishes, const Tell& tell, const std::function<bool()>& should_stop) {
  auto meant = meant_by(wishes);
  if (!meant) return tl::unexpected(meant.error());
  if (meant->simulated != nullptr) return simulate(wishes, *meant->simulated, tell);
  const devices::HandChoice& choice = meant->choice;
  std::vector<Listed>& listed = meant->listed;
  const DeviceModel& standard = *devices::find_model(kSimulated);

  for (const Listed& device : listed) {
    if (!device.found.trouble.empty())
      tell(fmt::format("{} at {} can't be opened: {}", device.model.title, device.found.path, device.found.trouble));
  }
  std::erase_if(listed, [](const Listed& device) { return !device.found.trouble.empty(); });
  add_those_awaited(choice, listed);
  std::vector<devices::Candidate> candidates;
  for (const Listed& device : listed) candidates.push_back({&device.model, device.found.serial});
  const auto roles = devices::assign_roles(choice, candidates);
  if (!roles) return tl::unexpected(roles.error().message);
  tell(roles->told);
  if (!roles->primary) return simulate(wishes, standard, tell);

  std::unique_ptr<SessionDevices> session(new SessionDevices());
  const auto add = [&](std::optional<std::size_t> role) -> tl::expected<devices::SampleSource*, std::string> {
    if (!role) return nullptr;
    auto part = open_part(listed[*role].found, wishes, tell, should_stop);
    if (!part) return tl::unexpected(part.error());
    session->parts_.push_back(*std::move(part));
    return session->parts_.back()->linked.get();
  };
  const auto primary = add(roles->primary), second = primary ? add(roles->second) : primary,
             view = second ? add(roles->view) : second;
  if (!view) return tl::unexpected(view.error());

  const Part& part = *session->parts_.front();
  const DeviceModel& model = part.file.model;
  session->source_ = std::make_unique<devices::SourceDevice>(**primary, devices::capabilities_of(model, wishes.grasp));
  const auto known = devices::known_devices_folder();
  const bool is_new = !known || !devices::is_known_device(*known, part.serial, part.file);
  session->guard(*session->source_, wishes, part.file, is_new, tell);

  devices::HandSettings hand = devices::settings_from(choice, *roles);
  session->scales_ = wishes.scales;
  session->scales_.workspace *= model.default_workspace_scale;
  hand.workspace_scale = session->scales_.workspace;
  const spatial::Pose X_WHand = Explorer(wishes.simulated.explorer).X_WHand();  // a simulated hand begins there, too
  // Of a device only motion counts, not where its handle is: the middle of the hand's base is its origin.
  session->X_WB_ = X_WB_before(wishes.simulated.explorer.hints, glm::dvec3(0), hand.workspace_scale);
  hand.X_BD_start = {X_WHand.R, X_WHand.p / hand.workspace_scale - session->X_WB_.p};
  session->hand_ = std::make_unique<devices::Hand>(*session->source_, *session->guard_, *second, *view, hand);

  for (const std::string& sentence :
       devices::mapping_in_words(model, *second != nullptr ? &(*second)->model() : nullptr,
                                 *view != nullptr ? &(*view)->model() : nullptr, hand, session->scales_))
    tell(sentence);
  if (model.force_dof > 0 && model.enabling == devices::Enabling::kStation) {
    session->key_ = StationKey::open();
    if (!session->key_)
      tell("the device has no button, and standard input is no terminal where a key could be held: force stays off");
  }
  session->look(tell);
  return session;
}

std::string SessionDevices::trouble_with(const DeviceWishes& wishes) {
  const auto meant = meant_by(wishes);
  return meant ? std::string() : meant.error();
}

SessionDevices::~SessionDevices() = default;

std::unique_ptr<SessionDevices> SessionDevices::simulate(const DeviceWishes& wishes, const DeviceModel& model,
                                                         const Tell& tell) {
  std::unique_ptr<SessionDevices> session(new SessionDevices());
  SimulatedDeviceSettings settings = wishes.simulated;
  settings.model = model;
  if (model.enabling == devices::Enabling::kStation) {  // no key is held here: the simulated hand's grip stands for it
    settings.model.enabling = devices::Enabling::kHold;
    settings.model.enable_button = 0;
  }
  settings.hand = wishes.grasp;
  settings.workspace_scale = wishes.scales.workspace;
  session->X_WB_ = X_WB_before(settings.explorer.hints, 0.5 * (model.workspace_min_B_m + model.workspace_max_B_m),
                               settings.workspace_scale);
  settings.p_WB = session->X_WB_.p;
  session->simulated_.emplace(settings);
  session->scales_ = wishes.scales;
  session->is_remembered_ = true;
  session->guard(*session->simulated_, wishes, {settings.model, {}}, false, tell);
  return session;
}

std::string SessionDevices::beyond_the_hand(const DeviceWishes& wishes, const contact::Material& tool) const {
  if (!is_simulated()) return {};
  const double device_N = guard_->capabilities().max_force_N;
  const Grip& grip = wishes.simulated.grip;
  const double coupling_N_per_m = devices::coupling_of(model_, wishes.grasp).stiffness_N_per_m;
  const double hand_N =
      Explorer::most_press_N(wishes.simulated.explorer.hints,
                             1 / (1 / grip.stiffness_N_per_m + 1 / coupling_N_per_m + 1 / tool.stiffness_N_per_m));
  const double asked_N = wishes.simulated.explorer.hints.press_force_N;
  if (asked_N <= std::min(device_N, hand_N)) return {};
  return fmt::format(
      "the scene asks to press with {:g} N: the device gives {:g} N at most (--max-force), and a {} grip gives up "
      "and lifts at some {:.1f} N (--grip)",
      asked_N, device_N, grip.name, hand_N);
}

void SessionDevices::guard(Device& device, const DeviceWishes& wishes, const devices::DeviceFile& file, bool is_new,
                           const Tell& tell) {
  devices::GuardSettings settings;
  settings.model = file.model;
  settings.hand = wishes.grasp;
  settings.max_force_N = wishes.max_force_N;
  settings.max_torque_Nm = wishes.max_torque_Nm;
  settings.gravity_B_N = file.calibration.gravity_B_N;
  settings.period_ns = wishes.period_ns;
  settings.is_new_device = is_new;
  is_remembered_ = !is_new;
  model_ = file.model;
  guard_ = std::make_unique<devices::GuardedDevice>(device, settings);
  if (file.model.force_dof == 0) return;
  tell(fmt::format(
      "{}; at most {:g} N and {:g} Nm on the hand{}",
      devices::in_words(file.model, devices::coupling_of(file.model, wishes.grasp), wishes.grasp),
      guard_->capabilities().max_force_N, guard_->capabilities().max_torque_Nm,
      is_new
          ? "; this device is new here: at its first grip it shakes gently for a second or two, so hold it loosely and "
            "still; then force begins at 20 % and rises over 2 s of contact"
          : ""));
}

std::string SessionDevices::how_to_enable() const {
  if (model_.force_dof == 0) return "it has no force";
  if (is_simulated()) return "the simulated hand takes hold by itself";
  const char* const first = guard_->is_held() ? "let go, then " : "";  // what was down before is no edge
  switch (model_.enabling) {
    case devices::Enabling::kHold:
      return fmt::format("{}hold button {} for force", first, model_.enable_button + 1);
    case devices::Enabling::kPress:
      return fmt::format("{}press button {} for force, again to end it", first, model_.enable_button + 1);
    case devices::Enabling::kStation:
      return fmt::format("{}hold the space bar here, or a foot switch that types one, for force", first);
  }
  return {};
}

std::string SessionDevices::stage_in_words(Stage stage) const {
  const std::string advice = parts_.empty() ? std::string() : parts_.front()->owner.advice();
  const auto with_advice = [&](std::string_view words) {
    return fmt::format("{}{}{}", words, advice.empty() ? "" : ": ", advice);
  };
  switch (stage) {
    case Stage::kReady:
      return "ready, force is off: " + how_to_enable();
    case Stage::kEnabled:
      return "force is on";
    case Stage::kStopping:
      return "force goes off";
    case Stage::kTrying:
      return "its axes are tried: hold it loosely and still";
    case Stage::kFault:
      return with_advice("fault, force is off");
    default:
      return with_advice(devices::name(stage)) + "; force is off";
  }
}

std::string SessionDevices::in_words() const {
  return fmt::format("{}: {}", model_.title, stage_in_words(guard_->stage()));
}

std::string SessionDevices::waits_for() const {
  return model_.force_dof > 0 && guard_->stage() == Stage::kReady ? how_to_enable() : std::string();
}

void SessionDevices::tell_stage(const Tell& tell) {
  const Stage stage = guard_->stage();
  if (stage == told_stage_) return;
  const bool was_on = told_stage_ == Stage::kEnabled || told_stage_ == Stage::kStopping;
  told_stage_ = stage;
  if (stage != Stage::kStopping && !(stage == Stage::kEnabled && was_on)) tell(in_words());
}

void SessionDevices::remember_once_trusted(const Tell& tell) {
  if (is_remembered_ || !guard_->is_trusted()) return;
  is_remembered_ = true;
  const auto folder = devices::known_devices_folder();
  if (!folder) return;
  const Part& part = *parts_.front();
  if (const auto done = devices::remember_device(*folder, part.serial, part.file); !done) tell(done.error().message);
}

void SessionDevices::look(const Tell& tell) {
  if (is_simulated()) return;
  const std::int64_t now_ns = realtime::monotonic_now_ns();
  for (const std::unique_ptr<Part>& part : parts_) {
    if (const std::string news = part->owner.look(now_ns); !news.empty()) tell(news);
  }
  if (key_) guard_->hold_station_key_until(key_->held_until_ns(now_ns));
  tell_stage(tell);
  remember_once_trusted(tell);
  const double masked_Nm = hand_->masked_torque_Nm();
  if (!is_masked_torque_told_ && masked_Nm > kTelling_Nm) {
    is_masked_torque_told_ = true;
    tell(fmt::format("torque is masked: {:.3f} Nm now that the {} can't render; the report has the most", masked_Nm,
                     parts_.front()->file.model.title));
  }
}

}  // namespace farfeel::master_station
