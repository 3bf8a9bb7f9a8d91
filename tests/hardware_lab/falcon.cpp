#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <glm/geometric.hpp>
#include <thread>

#include "tests/hardware_lab/bulk_gadget.h"
#include "tests/hardware_lab/lab_device.h"
#include "tests/hardware_lab/nodes.h"
#include "tests/support/devices/falcon_emulator.h"

namespace farfeel::hardware_lab {
namespace {

using test_support::FalconEmulator;
using test_support::FalconHand;

constexpr const char* kFirmware = "/tmp/falcon-firmware.bin";

// The hand, in the emulator's frame: y is up, z towards the person.
constexpr glm::dvec3 kMiddle_F_m{0, 0, 0.12}, kOut_F_m{0, 0, 0.165}, kIn_F_m{0, 0, 0.085}, kLow_F_m{0, -0.045, 0.12};
constexpr double kSoft_N_per_m = 150, kSoft_Ns_per_m = 8;    // an arm that presses
constexpr double kFirm_N_per_m = 2000, kFirm_Ns_per_m = 40;  // and one that moves the grip through its travel
constexpr auto kHandStep = std::chrono::milliseconds(400);
constexpr std::uint8_t kAnyButton = 0b0100;  // the middle one, as the published tables number them

/// What has the form of firmware: the true one may not be shipped.
void write_made_up_firmware() {
  constexpr unsigned kBlocks = 2, kWords = 500, kHead = 22;
  std::vector<char> bytes(kHead, 0);
  bytes[0] = static_cast<char>(0xaa), bytes[1] = 0x08;  // the key of SPRU095
  for (unsigned block = 0; block < kBlocks; ++block) {
    bytes.push_back(static_cast<char>(kWords & 255U)), bytes.push_back(static_cast<char>(kWords >> 8U));
    for (unsigned i = 0; i < 4 + 2 * kWords; ++i) bytes.push_back(static_cast<char>(7 * i + 3));
  }
  bytes.insert(bytes.end(), 2, 0);
  std::ofstream(kFirmware, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  chmod(kFirmware, 0644);
}

class LabFalcon final : public LabDevice {
 public:
  LabFalcon() : hand_([this] { move_hand(); }) { write_made_up_firmware(); }
  ~LabFalcon() override {
    is_over_ = true;
    hand_.join();
  }

  [[nodiscard]] std::string argument() const override { return "falcon"; }
  [[nodiscard]] std::vector<std::string> more_arguments() const override { return {"--firmware", kFirmware}; }
  [[nodiscard]] std::string node() const override {
    return usb_node(FalconEmulator::kVendor, FalconEmulator::kProduct);
  }
  void plug_in() override { gadget_.plug_in(); }
  bool plug_in_as_stranger() override {
    gadget_.plug_in(true);
    return true;
  }
  std::int64_t pull_out() override { return gadget_.pull_out(); }

  void rest() override { is_pressing_ = false; }
  void press_down() override { is_pressing_ = true; }
  void grip(bool is_held) override {
    const std::scoped_lock lock(gadget_.mutex());
    emulator_.press(is_held ? kAnyButton : 0);
  }
  [[nodiscard]] bool has_force() const override { return true; }
  [[nodiscard]] double force_N() override {
    const std::scoped_lock lock(gadget_.mutex());
    emulator_.advance(now_ns());
    return glm::length(emulator_.mechanism().motor_force_F_N());
  }
  [[nodiscard]] std::optional<double> watchdog_s() override {
    const std::scoped_lock lock(gadget_.mutex());
    const std::int64_t took_ns = emulator_.watchdog_took_ns();
    return took_ns > 0 ? std::optional(static_cast<double>(took_ns) * 1e-9) : std::nullopt;
  }
  bool stall() override {
    gadget_.stall();
    return true;
  }

 private:
  /// Out and in while the device wants to be homed; else where it is told to be.
  void move_hand() {
    for (bool is_out = false; !is_over_; is_out = !is_out) {
      {
        const std::scoped_lock lock(gadget_.mutex());
        const bool is_homing = emulator_.is_running() && !emulator_.is_homed();
        const glm::dvec3 target = is_homing ? (is_out ? kOut_F_m : kIn_F_m) : is_pressing_ ? kLow_F_m : kMiddle_F_m;
        emulator_.set_hand({.target_F_m = target,
                            .stiffness_N_per_m = is_pressing_ ? kSoft_N_per_m : kFirm_N_per_m,
                            .damping_Ns_per_m = is_pressing_ ? kSoft_Ns_per_m : kFirm_Ns_per_m,
                            .force_F_N = {0, 0, 0}});
      }
      std::this_thread::sleep_for(kHandStep / 4);
      if (!is_pressing_) std::this_thread::sleep_for(kHandStep);
    }
  }

  FalconEmulator emulator_;
  BulkGadget gadget_{emulator_,
                     {FalconEmulator::kVendor, FalconEmulator::kProduct, std::string(FalconEmulator::kManufacturer),
                      std::string(FalconEmulator::kProductName), std::string(FalconEmulator::kSerial)}};
  std::atomic<bool> is_over_{false}, is_pressing_{false};
  std::thread hand_;
};

}  // namespace

std::unique_ptr<LabDevice> make_falcon() {
  return std::make_unique<LabFalcon>();
}

}  // namespace farfeel::hardware_lab
