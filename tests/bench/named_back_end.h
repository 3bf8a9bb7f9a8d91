// A back end of the penetration depth by its name, opened once for a benchmark.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "haptic_core/penetration/egl/egl_back_end.h"

namespace farfeel::bench {

class NamedBackEnd {
 public:
  /// As in slave_sim::DepthWish, but that egl's device is timed; throws CLI::RuntimeError with the reason where it
  /// can't be had.
  explicit NamedBackEnd(const std::string& name, const penetration::egl::DeviceOptions& = {.is_timed = true});
  ~NamedBackEnd();
  NamedBackEnd(const NamedBackEnd&) = delete;
  NamedBackEnd& operator=(const NamedBackEnd&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Empty: simd.
  [[nodiscard]] const penetration::BackEndMaker& maker() const { return maker_; }
  /// Null unless it is egl.
  [[nodiscard]] const std::shared_ptr<penetration::egl::Device>& device() const { return device_; }
  /// The one made last, while it lives; null unless it is egl.
  [[nodiscard]] const penetration::egl::EglBackEnd* last_egl() const { return last_egl_; }

  /// device, platform, version, is_software, group and warmup_ms, where there is a device.
  [[nodiscard]] nlohmann::json about() const;

 private:
  std::string name_;
  std::shared_ptr<penetration::egl::Device> device_;
  penetration::BackEndMaker maker_;
  const penetration::egl::EglBackEnd* last_egl_ = nullptr;
};

/// Adds the device's shares of frames, and their medians.
class DeviceTimes {
 public:
  ~DeviceTimes();
  DeviceTimes();
  void add(const penetration::egl::Tally&);
  /// upload_us, dispatch_us, readback_us, prepare_us; nothing where nothing was added.
  void write(nlohmann::json& row) const;

 private:
  struct Columns;
  std::unique_ptr<Columns> columns_;
};

}  // namespace farfeel::bench
