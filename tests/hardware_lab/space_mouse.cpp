#include "tests/hardware_lab/hid_gadget.h"
#include "tests/hardware_lab/lab_device.h"
#include "tests/hardware_lab/nodes.h"
#include "tests/support/devices/space_mouse_emulator.h"

namespace farfeel::hardware_lab {
namespace {

constexpr unsigned kReportBytes = 16;
constexpr std::int16_t kDown = 300;  // z down of a SpaceMouse, of 350

class LabSpaceMouse final : public LabDevice {
 public:
  [[nodiscard]] std::string argument() const override { return "spacemouse"; }
  [[nodiscard]] std::string node() const override {
    const auto id = emulator_.identity();
    return hidraw_node(id.vendor, id.product);
  }
  void plug_in() override { gadget_.plug_in(); }
  bool plug_in_as_stranger() override {
    gadget_.plug_in(true);
    return true;
  }
  std::int64_t pull_out() override { return gadget_.pull_out(); }

  void rest() override { deflect(0); }
  void grip(bool is_held) override {
    const std::scoped_lock lock(gadget_.mutex());
    emulator_.press(is_held ? 1 : 0);
  }
  void press_down() override { deflect(kDown); }

  [[nodiscard]] bool has_force() const override { return false; }
  [[nodiscard]] double force_N() override { return 0; }

 private:
  void deflect(std::int16_t down) {
    const std::scoped_lock lock(gadget_.mutex());
    emulator_.deflect({0, 0, down, 0, 0, 0});
  }

  test_support::SpaceMouseEmulator emulator_{test_support::SpaceMouseReports::kCombined};
  HidGadget gadget_{emulator_, kReportBytes};
};

}  // namespace

std::unique_ptr<LabDevice> make_space_mouse() {
  return std::make_unique<LabSpaceMouse>();
}

}  // namespace farfeel::hardware_lab
