#include "tests/bench/named_back_end.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <vector>

#include "slave_sim/depths/chosen_depths.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {

using nlohmann::json;
using penetration::egl::Device;

NamedBackEnd::NamedBackEnd(const std::string& name, const penetration::egl::DeviceOptions& options) : name_(name) {
  const auto tell_loss = [](const std::string& why) { fmt::print(stderr, "the device is lost: {}\n", why); };
  if (name != "egl") {
    auto chosen = slave_sim::choose_depths({.name = name, .on_loss = tell_loss});
    if (!chosen) throw CLI::RuntimeError(chosen.error(), 1);
    maker_ = std::move(chosen->maker);
    return;
  }
  penetration::egl::DeviceOptions told = options;
  told.on_loss = tell_loss;
  auto opened = Device::open(told);
  if (!opened) throw CLI::RuntimeError("egl: " + opened.error().message, 1);
  device_ = *opened;
  maker_ = [this](const penetration::Limits& limits) {
    auto made = penetration::egl::make_egl(device_, limits);
    if (!made) throw CLI::RuntimeError("all of the device's rings are taken", 1);
    last_egl_ = made.get();
    return made;
  };
}

NamedBackEnd::~NamedBackEnd() = default;

json NamedBackEnd::about() const {
  if (!device_) return json::object();
  const penetration::egl::DeviceInfo& info = device_->info();
  return {{"device", info.renderer},    {"vendor", info.vendor},           {"version", info.version},
          {"platform", info.platform},  {"is_software", info.is_software}, {"group", info.group},
          {"warmup_ms", info.warmup_ms}};
}

struct DeviceTimes::Columns {
  std::vector<double> upload, dispatch, readback, prepare;
};
DeviceTimes::DeviceTimes() : columns_(std::make_unique<Columns>()) {}
DeviceTimes::~DeviceTimes() = default;

void DeviceTimes::add(const penetration::egl::Tally& tally) {
  columns_->upload.push_back(tally.last.upload_us), columns_->dispatch.push_back(tally.last.dispatch_us);
  columns_->readback.push_back(tally.last.readback_us), columns_->prepare.push_back(tally.prepare_us);
}

void DeviceTimes::write(json& row) const {
  const auto median = [](const std::vector<double>& values) { return support::quantile(values, 0.5); };
  if (columns_->upload.empty()) return;
  row["upload_us"] = median(columns_->upload), row["dispatch_us"] = median(columns_->dispatch);
  row["readback_us"] = median(columns_->readback), row["prepare_us"] = median(columns_->prepare);
}

}  // namespace farfeel::bench
