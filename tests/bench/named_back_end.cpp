#include "tests/bench/named_back_end.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "haptic_core/penetration/historical/historical.h"
#include "haptic_core/penetration/simd.h"

namespace farfeel::bench {

using contact_service::DepthBackEnd;
using nlohmann::json;
using penetration::egl::Device;
using penetration::egl::EglBackEnd;

class NamedBackEnd::Remembering final : public penetration::BackEndMaker {
 public:
  explicit Remembering(std::shared_ptr<Device> device) : device_(std::move(device)) {}
  [[nodiscard]] std::unique_ptr<penetration::BackEnd> make(const penetration::Limits& limits) const override {
    auto made = penetration::egl::make_egl(device_, limits);
    if (!made) throw CLI::RuntimeError("all of the device's rings are taken", 1);
    last_ = made.get();
    return made;
  }
  [[nodiscard]] bool wants_window() const override { return false; }
  [[nodiscard]] const EglBackEnd* last() const { return last_; }

 private:
  std::shared_ptr<Device> device_;
  mutable const EglBackEnd* last_ = nullptr;
};

NamedBackEnd::NamedBackEnd(const std::string& name, const penetration::egl::DeviceOptions& options) : name_(name) {
  which_ = name == "simd" ? DepthBackEnd::kSimd : name == "reference" ? DepthBackEnd::kReference : DepthBackEnd::kGiven;
  if (name == "egl") {
    penetration::egl::DeviceOptions told = options;
    told.on_loss = [](const std::string& why) { fmt::print(stderr, "the device is lost: {}\n", why); };
    auto opened = Device::open(told);
    if (!opened) throw CLI::RuntimeError("egl: " + opened.error().message, 1);
    device_ = *opened;
    auto maker = std::make_unique<Remembering>(device_);
    remembering_ = maker.get();
    maker_ = std::move(maker);
  } else if (name == "historical") {
    if (auto tried = penetration::historical::make_historical({.coarse_triangles = 8}); !tried)
      throw CLI::RuntimeError("historical: " + tried.error().message, 1);
    maker_ = std::make_unique<penetration::historical::HistoricalMaker>();
  } else if (which_ == DepthBackEnd::kGiven) {
    throw CLI::ValidationError(name, "there are simd, reference, egl and historical");
  }
}
NamedBackEnd::~NamedBackEnd() = default;

std::unique_ptr<penetration::BackEnd> NamedBackEnd::make(const penetration::Limits& limits) const {
  if (maker_) return maker_->make(limits);
  return which_ == DepthBackEnd::kSimd ? penetration::make_simd(limits) : penetration::make_reference(limits);
}

const EglBackEnd* NamedBackEnd::last_egl() const {
  return remembering_ ? remembering_->last() : nullptr;
}

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
  const auto median = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  if (columns_->upload.empty()) return;
  row["upload_us"] = median(columns_->upload), row["dispatch_us"] = median(columns_->dispatch);
  row["readback_us"] = median(columns_->readback), row["prepare_us"] = median(columns_->prepare);
}

}  // namespace farfeel::bench
