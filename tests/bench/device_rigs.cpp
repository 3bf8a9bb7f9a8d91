#include "tests/bench/device_rigs.h"

#include <array>
#include <cstdlib>
#include <numbers>

#include "master_station/devices/driver/falcon_driver.h"
#include "master_station/devices/driver/inverse3_driver.h"
#include "master_station/devices/driver/pid_joystick_driver.h"
#include "master_station/devices/driver/plug_in_driver.h"
#include "master_station/devices/driver/space_mouse_driver.h"
#include "master_station/devices/driver/wooden_haptics_driver.h"
#include "tests/support/devices/emulated_evdev.h"
#include "tests/support/devices/emulated_hidraw.h"
#include "tests/support/devices/emulated_usbfs.h"
#include "tests/support/devices/inverse_service.h"
#include "tests/support/devices/space_mouse_emulator.h"
#include "tests/support/devices/under_umockdev.h"
#include "tests/support/devices/wooden_haptics_emulator.h"

namespace farfeel::bench {
namespace {

namespace ts = test_support;

struct FalconRig final : DeviceRig {
  void nudge(bool /*is_ready*/) override {}
  ts::MockDevices mock;
  ts::FalconEmulator device{{.has_firmware = true, .is_homed = true, .mechanics = {}}};
  ts::EmulatedUsbfs node{mock, device, 7, ts::EmulatedUsbfs::Node::kFifo};  // a plain file keeps who waits spinning
};

struct WoodenHapticsRig final : DeviceRig {
  void nudge(bool is_ready) override {
    if (is_ready) return;
    node.with_device([&] {
      device.put_at({0, 0, std::numbers::pi / 2});
      device.grasp(device.handle_B_m(), 2000);
      device.press_button();
    });
  }
  ts::MockDevices mock;
  ts::WoodenHapticsEmulator device;
  ts::EmulatedHidraw node{mock, device, 0};
};

struct SpaceMouseRig final : DeviceRig {
  void nudge(bool /*is_ready*/) override {
    deflected = -deflected;
    node.with_device([&] { device.deflect({deflected, 0, 0, 0, 0, 0}); });
  }
  std::int16_t deflected = 100;
  ts::MockDevices mock;
  ts::SpaceMouseEmulator device{ts::SpaceMouseReports::kCombined};
  ts::EmulatedHidraw node{mock, device, 0};
};

struct JoystickRig final : DeviceRig {
  void nudge(bool /*is_ready*/) override {
    pushed_N = -pushed_N;
    node.with_device([&] { device.push(pushed_N, 0); });
  }
  double pushed_N = 1;
  ts::MockDevices mock;
  devices::ForceJoystickEmulator device{2};
  ts::EmulatedEvdev node{mock, device, 3};
};

struct InverseRig final : DeviceRig {
  InverseRig() { setenv("FARFEEL_INVERSE3", service.uri().c_str(), 1); }
  void nudge(bool /*is_ready*/) override {}
  devices::InverseService service;
};

struct NoRig final : DeviceRig {
  void nudge(bool /*is_ready*/) override {}
};

template <typename Rig>
std::unique_ptr<DeviceRig> plugged_in() {
  return std::make_unique<Rig>();
}

}  // namespace

std::vector<BenchedDevice> benched_devices() {
  const std::string lacks = ts::why_not_under_umockdev();
  devices::DriverOptions example;
  example.plug_in = FARFEEL_PLUG_INS "/simulated_handle.so";
  return {
      {"falcon", "libusb, emulated usbfs node (umockdev)", devices::kFalconFamily, {}, plugged_in<FalconRig>, lacks},
      {"wooden-haptics",
       "hidapi, emulated hidraw node (umockdev)",
       devices::kWoodenHapticsFamily,
       {},
       plugged_in<WoodenHapticsRig>,
       lacks},
      {"spacemouse",
       "hidapi, emulated hidraw node (umockdev)",
       devices::kSpaceMouseFamily,
       {},
       plugged_in<SpaceMouseRig>,
       lacks},
      {"pid-joystick",
       "evdev, emulated input node (umockdev)",
       devices::kPidJoystickFamily,
       {},
       plugged_in<JoystickRig>,
       lacks},
      {"inverse3",
       "WebSocket, a service imitated on loopback",
       devices::kInverse3Family,
       {},
       plugged_in<InverseRig>,
       {}},
      {"simulated-handle", "plug-in, simulated in its library", devices::kPlugInFamily, example, plugged_in<NoRig>, {}},
  };
}

}  // namespace farfeel::bench
