#include "master_station/devices/model/device_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "master_station/devices/model/built_in_models.h"
#include "master_station/devices/model/figures.h"
#include "master_station/devices/model/model_table.h"

namespace farfeel::devices {
namespace {

using codecs::CheckedTable;

constexpr std::array<std::string_view, 2> kTells{"pose", "rate"};
constexpr std::array<std::string_view, 2> kReports{"stream", "events"};
constexpr std::array<std::string_view, 3> kEnabling{"hold", "press", "station"};
constexpr double kMostReach_m = 5;
constexpr int kMostButton = 31;
constexpr double kLeastRate_Hz = 10;  // below, nothing is felt

void read_words(const CheckedTable& top, DeviceModel& model) {
  if (const auto title = top.text("title")) model.title = *title;
  model.tells = static_cast<Tells>(top.choice("tells", static_cast<std::size_t>(model.tells), kTells));
  model.reports = static_cast<Reports>(top.choice("reports", static_cast<std::size_t>(model.reports), kReports));
  model.enabling = static_cast<Enabling>(top.choice("enabling", static_cast<std::size_t>(model.enabling), kEnabling));
  model.is_in_newtons = top.flag("is_in_newtons", model.is_in_newtons);
  model.estimated = top.texts("estimated", model.estimated);
  for (const std::string& name : model.estimated) {
    const bool is_figure =
        name.starts_with("workspace_") ||
        std::any_of(kFigures.begin(), kFigures.end(), [&](const Figure& f) { return f.key == name; });
    if (!is_figure) top.fail("estimated", fmt::format("names {}, which is no figure of a device", name));
  }
}

void read_figures(const CheckedTable& top, DeviceModel& model) {
  for (const Figure& figure : kFigures)
    model.*figure.member = top.number(figure.key, model.*figure.member, figure.least, figure.most);
  for (const Count& count : kCounts) model.*count.member = top.whole(count.key, model.*count.member, 0, 3);
  model.enable_button = top.whole("enable_button", model.enable_button, -1, kMostButton);
  model.clutch_button = top.whole("clutch_button", model.clutch_button, -1, kMostButton);
  model.workspace_min_B_m = top.vector("workspace_min_B_m", model.workspace_min_B_m, kMostReach_m);
  model.workspace_max_B_m = top.vector("workspace_max_B_m", model.workspace_max_B_m, kMostReach_m);
}

/// What no figure says alone.
void check_together(const CheckedTable& top, const DeviceModel& model) {
  if (model.rate_Hz > 0 && model.rate_Hz < kLeastRate_Hz)
    top.fail(fmt::format("rate_Hz is {} Hz: at least {} Hz, or 0 for a device that goes with the tick", model.rate_Hz,
                         kLeastRate_Hz));
  for (int axis = 0; axis < 3; ++axis) {
    if (model.workspace_max_B_m[axis] < model.workspace_min_B_m[axis])
      top.fail("workspace_max_B_m is below workspace_min_B_m; both in metres, smallest first");
  }
  if (model.continuous_force_N > model.max_force_N)
    top.fail(fmt::format("continuous_force_N is {} N and max_force_N {} N: the greatest comes first",
                         model.continuous_force_N, model.max_force_N));
  if (model.continuous_torque_Nm > model.max_torque_Nm)
    top.fail(fmt::format("continuous_torque_Nm is {} Nm and max_torque_Nm {} Nm: the greatest comes first",
                         model.continuous_torque_Nm, model.max_torque_Nm));
  if (model.force_dof > 0) {
    if (!(model.max_force_N > 0)) top.fail("force_dof says that it pushes: max_force_N must be above 0 N");
    if (!(model.mass_kg > 0))
      top.fail("force_dof says that it pushes: mass_kg, felt at the handle, must be above 0 kg");
  }
  if (model.torque_dof > 0 && !(model.max_torque_Nm > 0 && model.inertia_kg_m2 > 0))
    top.fail("torque_dof says that it turns: max_torque_Nm [Nm] and inertia_kg_m2 [kg m2] must be above 0");
  if ((model.coupling_stiffness_N_per_m > 0 && model.force_dof == 0) ||
      (model.coupling_stiffness_Nm_per_rad > 0 && model.torque_dof == 0))
    top.fail("a coupling is stated along an axis on which the device gives no force");
  if (model.enabling != Enabling::kStation && model.enable_button < 0)
    top.fail("enabling needs enable_button, or must be \"station\"");
}

const std::vector<DeviceModel>& models() {
  static const std::vector<DeviceModel> all = [] {
    std::vector<DeviceModel> parsed;
    for (const BuiltInModel& each : kBuiltInModels) {
      DeviceModel named;
      named.name = each.name;
      auto model = parse_model(each.toml, std::string(each.name) + ".toml", named);
      if (!model) {  // a test parses each: this program was never tested
        std::fprintf(stderr, "%s\n", model.error().message.c_str());
        std::abort();
      }
      parsed.push_back(*std::move(model));
    }
    return parsed;
  }();
  return all;
}

}  // namespace

bool DeviceModel::is_estimated(std::string_view figure) const {
  return std::find(estimated.begin(), estimated.end(), figure) != estimated.end();
}

const DeviceModel* find_model(std::string_view name) {
  for (const DeviceModel& model : models()) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const DeviceModel& model : models()) names.push_back(model.name);
  return names;
}

DeviceModel read_model(const CheckedTable& top, const DeviceModel& base) {
  DeviceModel model = base;
  read_words(top, model);
  read_figures(top, model);
  check_together(top, model);
  return model;
}

tl::expected<DeviceModel, ModelError> parse_model(std::string_view toml, std::string_view file,
                                                  const DeviceModel& base) {
  try {
    const toml::table root = toml::parse(toml, file);
    return read_model(CheckedTable(root, "", file, model_keys()), base);
  } catch (const toml::parse_error& error) {
    return tl::unexpected(
        ModelError{fmt::format("{}:{}: not TOML: {}", file, error.source().begin.line, error.description())});
  } catch (const codecs::TableFault& fault) {
    return tl::unexpected(ModelError{fault.message});
  }
}

}  // namespace farfeel::devices
