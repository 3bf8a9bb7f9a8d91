#include "master_station/devices/host/found_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "codecs/text/nearest_word.h"
#include "master_station/devices/host/owner.h"

namespace farfeel::devices {
namespace {

std::string printable(std::string_view text) {
  std::string clean(text);
  for (char& c : clean)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return clean;
}

std::string names(std::span<const DriverFamily> families) {
  std::string all;
  for (const DriverFamily& family : families) all += fmt::format("{}{}", all.empty() ? "" : ", ", family.name);
  return all.empty() ? std::string("nothing: this program was built without drivers") : all;
}

std::string_view word(Tells tells) {
  return tells == Tells::kPose ? "pose" : "rate";
}

}  // namespace

std::vector<ListedDevice> listed_devices(std::span<const DriverFamily> families, const DriverOptions& options,
                                         ModelLookup lookup) {
  std::vector<ListedDevice> all;
  for (const DriverFamily& family : families) {
    for (FoundDevice& found : family.find(options)) {
      ListedDevice listed;
      listed.family = family.name;
      for (std::string* text : {&found.model, &found.serial, &found.path, &found.trouble}) *text = printable(*text);
      if (const DeviceModel* const model = lookup(found.model)) {
        listed.model = *model;
        listed.has_data = true;
      } else {
        listed.model.name = listed.model.title = found.model;
      }
      listed.found = std::move(found);
      all.push_back(std::move(listed));
    }
  }
  return all;
}

std::string trouble_with_name(std::string_view typed, std::span<const DriverFamily> families,
                              const DriverOptions& options) {
  const WantedDevice wanted = parse_wanted(typed);
  if (wanted.serial.empty() && typed.ends_with(':'))
    return fmt::format("{}: a serial number is missing after the colon", typed);
  if (wanted.name == "simulated")
    return "simulated: that device is in farfeel-master, and no hardware; there is nothing to look at";
  std::vector<std::string> known{"auto"};
  for (const DriverFamily& family : families) {
    known.emplace_back(family.name);
    if (family.name == wanted.name) return {};
  }
  if (wanted.name == known.front()) return {};
  for (const DriverFamily& family : families)  // a plug-in's devices have names of their own
    for (const FoundDevice& found : family.find(options)) {
      if (found.model == wanted.name) return {};
      if (std::find(known.begin(), known.end(), found.model) == known.end()) known.push_back(printable(found.model));
    }
  const std::string_view near =
      codecs::nearest_word(wanted.name, std::vector<std::string_view>(known.begin(), known.end()));
  return fmt::format("{}: no device is known by that name; {}there are {}", typed,
                     near.empty() ? "" : fmt::format("did you mean {}? ", near), fmt::join(known, ", "));
}

std::string abilities(const DeviceModel& model) {
  std::string told;
  if (model.position_dof + model.rotation_dof == 0) {
    told = "tells what its driver finds";
  } else if (model.tells == Tells::kRate) {
    told = fmt::format("deflection of {} axes", model.position_dof + model.rotation_dof);
  } else {
    told = model.rotation_dof == 0
               ? fmt::format("position of {}", model.position_dof)
               : fmt::format("position of {}, rotation of {}", model.position_dof, model.rotation_dof);
  }
  if (model.force_dof + model.torque_dof == 0) return told + "; no force";
  told += fmt::format("; force of {}", model.force_dof);
  if (model.torque_dof > 0) told += fmt::format(", torque of {}", model.torque_dof);
  if (!model.is_in_newtons) told += ", in no known unit until it is calibrated";
  return told;
}

std::string list_for_person(std::span<const ListedDevice> all, std::span<const DriverFamily> families) {
  if (all.empty()) {
    return fmt::format(
        "No haptic device is plugged in.\nLooked for: {}.\nA device that is plugged in and not listed: "
        "farfeel doctor says what stands in its way.\n",
        names(families));
  }
  std::string text;
  for (const ListedDevice& one : all) {
    text +=
        fmt::format("{}{}{}\n", one.model.title, one.found.serial.empty() ? "" : ", serial number ", one.found.serial);
    text +=
        fmt::format("    --device  {}{}{}\n", one.found.model, one.found.serial.empty() ? "" : ":", one.found.serial);
    text += fmt::format("    at        {}\n", one.found.path);
    text += fmt::format("    can       {}\n", one.has_data ? abilities(one.model) : "no data of this model");
    text += fmt::format("    proven    {}\n", kProof);
    text += fmt::format(
        "    {}\n", one.found.trouble.empty() ? "ready to be opened" : fmt::format("trouble   {}", one.found.trouble));
  }
  return text;
}

std::string list_as_json(std::span<const ListedDevice> all, std::span<const DriverFamily> families) {
  using nlohmann::json;
  json rows = json::array(), looked_for = json::array();
  for (const ListedDevice& one : all) {
    rows.push_back({{"model", one.found.model},
                    {"title", one.model.title},
                    {"family", one.family},
                    {"serial", one.found.serial},
                    {"path", one.found.path},
                    {"tells", word(one.model.tells)},
                    {"position_dof", one.model.position_dof},
                    {"rotation_dof", one.model.rotation_dof},
                    {"force_dof", one.model.force_dof},
                    {"torque_dof", one.model.torque_dof},
                    {"is_in_newtons", one.model.is_in_newtons},
                    {"has_data", one.has_data},
                    {"proven", kProof},
                    {"trouble", one.found.trouble}});
  }
  for (const DriverFamily& family : families) looked_for.push_back(family.name);
  const json everything = {{"devices", rows}, {"looked_for", looked_for}};
  return everything.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string list_for_station(std::span<const ListedDevice> all) {
  std::string text;
  for (const ListedDevice& one : all) {
    text += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\n", one.found.model, one.found.serial, one.found.path,
                        one.model.force_dof, word(one.model.tells), one.found.trouble);
  }
  return text;
}

}  // namespace farfeel::devices
