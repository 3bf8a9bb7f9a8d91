#include "master_station/devices/driver/plug_in_driver.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cstring>

#include "master_station/devices/driver/velocity_estimate.h"
#include "master_station/devices/plug_in/plug_in_values.h"

namespace farfeel::devices {
namespace {

constexpr std::uint32_t kMaxDevices = 16;  ///< of one library
constexpr std::size_t kMaxText = 512;      ///< of an advice or an error

std::int64_t now_ns() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

/// No longer than `most`, in the same direction; zero where it is not finite.
glm::dvec3 capped(const glm::dvec3& v, double most) noexcept {
  if (!spatial::is_finite(v) || most <= 0) return glm::dvec3(0);
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (largest == 0) return v;
  const double length = largest * glm::length(v / largest);  // does not overflow
  return length > most ? v / largest * (most / (length / largest)) : v;
}

std::string text_of(const char* text, std::size_t size) {
  std::string copy(text, strnlen(text, size));
  std::replace_if(
      copy.begin(), copy.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return copy;
}

class PlugInDriver final : public Driver {
 public:
  PlugInDriver(PlugInLibrary library, FoundDevice identity, farfeel_device* device)
      : library_(std::move(library)), identity_(std::move(identity)), device_(device) {
    sample_.struct_size = sizeof sample_;
    sample_.orientation[0] = 1;
  }
  ~PlugInDriver() override { library_.table->close(device_); }

  /// What is wrong; empty: nothing.
  std::string describe() {
    farfeel_device_description description{};
    description.struct_size = sizeof description;
    if (library_.table->describe(device_, &description) != FARFEEL_DEVICE_OK) return "describe() failed";
    auto model = checked(description, identity_.model);
    if (!model) return model.error();
    model_ = std::move(*model);
    // Whoever feels the device reads its figures again from text, and would refuse them there.
    if (const auto read = parse_model(toml(model_), library_.name); !read) return read.error().message;
    if (library_.table->zero_force == nullptr) return {};
    farfeel_device_zero_force how{};
    how.struct_size = sizeof how;
    if (library_.table->zero_force(device_, &how) != FARFEEL_DEVICE_OK) return {};
    if (const char* const fault = fault_of(how)) return fmt::format("zero_force() gave {}", fault);
    ZeroForce zero{.fd = how.fd,
                   .how = how.is_usb_bulk != 0 ? ZeroForce::How::kUsbBulk : ZeroForce::How::kWrite,
                   .endpoint = std::uint8_t(how.endpoint),
                   .size = how.size,
                   .bytes = {}};
    std::memcpy(zero.bytes.data(), how.bytes, how.size);
    zero_force_ = zero;
    return {};
  }

  [[nodiscard]] const FoundDevice& identity() const noexcept override { return identity_; }

  Stage step(std::int64_t deadline_ns, const Command& command, Sample& newest) override {
    if (!command.is_force_on) is_force_to_wait_ = false;
    farfeel_device_command to_do{};
    to_do.struct_size = sizeof to_do;
    to_do.is_light_on = command.is_light_on ? 1 : 0;
    const bool is_meant = command.is_force_on && spatial::is_finite(command.F_hand_B.force_N) &&
                          spatial::is_finite(command.F_hand_B.torque_Nm);
    if (is_meant && stage_ == Stage::kReady && !is_force_to_wait_) {
      to_do.is_force_on = 1;
      const glm::dvec3 force_N = capped(command.F_hand_B.force_N, model_.max_force_N);
      const glm::dvec3 torque_Nm = capped(command.F_hand_B.torque_Nm, model_.max_torque_Nm);
      for (int i = 0; i < 3; ++i) to_do.force_B_N[i] = force_N[i], to_do.torque_B_Nm[i] = torque_Nm[i];
    }
    farfeel_device_sample told{};
    told.struct_size = sizeof told;
    told.orientation[0] = 1;
    const std::int32_t stage = library_.table->step(device_, deadline_ns, &to_do, &told);
    take(stage, told);
    newest = newest_;
    newest.stage = stage_;
    return stage_;
  }

  [[nodiscard]] std::string advice() const override {
    if (fault_ != nullptr)
      return fmt::format("the plug-in {} told {}: force stays off until the device is opened anew", library_.name,
                         fault_);
    if (stage_ == Stage::kReady) return {};
    char text[kMaxText] = "";
    library_.table->advice(device_, text, sizeof text);
    return text_of(text, sizeof text);
  }
  [[nodiscard]] std::optional<ZeroForce> zero_force() const override { return zero_force_; }
  [[nodiscard]] std::string model_toml() const override { return toml(model_); }

 private:
  void take(std::int32_t stage, const farfeel_device_sample& told) noexcept {
    if (stage == FARFEEL_DEVICE_ABSENT) {
      stage_ = Stage::kAbsent;
      return;
    }
    if (fault_ == nullptr) fault_ = fault_in(stage, told);
    if (fault_ != nullptr) {
      stage_ = Stage::kFault;
    } else {
      stage_ = static_cast<Stage>(stage);
      newest_ = sample_from(told);
      if (told.has_velocity == 0) {
        if (told.reports != sample_.reports) velocity_.update(newest_.X_BD, told.time_ns);
        newest_.V_BD_B = velocity_.twist();
      }
      sample_ = told;
    }
    if (stage_ != Stage::kReady) is_force_to_wait_ = true;
  }

  [[nodiscard]] const char* fault_in(std::int32_t stage, const farfeel_device_sample& told) const noexcept {
    switch (stage) {
      case FARFEEL_DEVICE_OPENING:
      case FARFEEL_DEVICE_FIRMWARE:
      case FARFEEL_DEVICE_HOMING:
      case FARFEEL_DEVICE_READY:
      case FARFEEL_DEVICE_FAULT:
        return fault_of(told, sample_, now_ns());
      default:
        return "a stage that there is not";
    }
  }

  PlugInLibrary library_;
  FoundDevice identity_;
  farfeel_device* device_;
  DeviceModel model_;
  std::optional<ZeroForce> zero_force_;
  Stage stage_ = Stage::kOpening;
  const char* fault_ = nullptr;  ///< what was told that cannot be
  bool is_force_to_wait_ = false;
  farfeel_device_sample sample_{};  ///< the last without fault
  Sample newest_;
  VelocityEstimate velocity_;
};

static_assert(int(Stage::kOpening) == FARFEEL_DEVICE_OPENING && int(Stage::kFirmware) == FARFEEL_DEVICE_FIRMWARE &&
              int(Stage::kHoming) == FARFEEL_DEVICE_HOMING && int(Stage::kReady) == FARFEEL_DEVICE_READY &&
              int(Stage::kFault) == FARFEEL_DEVICE_FAULT && int(Stage::kAbsent) == FARFEEL_DEVICE_ABSENT);

}  // namespace

const DriverFamily kPlugInFamily{"plug-in", find_plug_in_devices, open_plug_in_device};

std::vector<FoundDevice> find_plug_in_devices(const DriverOptions& options) {
  std::vector<FoundDevice> all;
  const auto add_trouble = [&](const std::string& path, const std::string& trouble) {
    all.push_back({.model = "plug-in", .serial = {}, .path = path, .trouble = trouble});
  };
  const std::vector<std::string> paths =
      options.plug_in.empty() ? installed_plug_ins() : std::vector<std::string>{options.plug_in};
  for (const std::string& path : paths) {
    const auto library = load_plug_in(path);
    if (!library) {
      add_trouble(path, library.error().message);
      continue;
    }
    for (std::uint32_t i = 0; i < kMaxDevices; ++i) {
      farfeel_device_found found{};
      found.struct_size = sizeof found;
      const std::int32_t result = library->table->find(i, &found);
      if (result == FARFEEL_DEVICE_END) break;
      tl::expected<FoundDevice, std::string> device = tl::unexpected(std::string("find() failed"));
      if (result == FARFEEL_DEVICE_OK) device = checked(found, library->path);
      if (!device) {
        add_trouble(path, fmt::format("the plug-in {} ({}) cannot be used: {}", library->name, path, device.error()));
        break;
      }
      all.push_back(*device);
    }
  }
  return all;
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open_plug_in_device(const FoundDevice& device,
                                                                       const DriverOptions&) {
  const auto library = load_plug_in(library_of(device.path));
  if (!library) return tl::unexpected(library.error());
  const auto failed = [&](const std::string& why) {
    return tl::unexpected(
        DeviceError{fmt::format("the plug-in {} did not open {}: {}", library->name, device.path, why)});
  };
  const auto found = found_again(device);
  if (!found) return failed(found.error());
  char error[kMaxText] = "";
  farfeel_device* opened = nullptr;
  if (library->table->open(&*found, &opened, error, sizeof error) != FARFEEL_DEVICE_OK)
    return failed(error[0] != '\0' ? text_of(error, sizeof error) : "it did not say why");
  if (opened == nullptr) return failed("open() returned no device");
  auto driver = std::make_unique<PlugInDriver>(*library, device, opened);
  if (const std::string why = driver->describe(); !why.empty()) return failed(why);
  return driver;
}

}  // namespace farfeel::devices
