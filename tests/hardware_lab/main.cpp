// In the guest of deploy/hardware-lab: emulated devices, and the stations that feel through them.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sched.h>
#include <sys/stat.h>
#include <grp.h>

#include <chrono>
#include <thread>

#include "tests/hardware_lab/lab_device.h"
#include "tests/hardware_lab/person.h"
#include "tests/hardware_lab/usb_gadget.h"

int main() {
  using namespace farfeel;
  using namespace farfeel::hardware_lab;
  sched_param hardware{};
  hardware.sched_priority = 60;
  sched_setscheduler(0, SCHED_FIFO, &hardware);
  auto mouse = make_space_mouse();
  for (int i = 0; i < 3; ++i) {
    const std::int64_t t = now_ns();
    mouse->plug_in();
    std::string node;
    while ((node = mouse->node()).empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::int64_t t1 = now_ns();
    struct stat about {};
    while (stat(node.c_str(), &about) != 0 || about.st_gid != 46) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (now_ns() - t > 5'000'000'000) break;
    }
    fmt::print("{} after {} ms; gid {} mode {:o} after {} ms\n", node, (t1 - t) / 1'000'000, about.st_gid, about.st_mode,
               (now_ns() - t) / 1'000'000);
    PersonsProgram list({"farfeel-device", "list"}, "/tmp/list");
    while (list.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    fmt::print("{}\n", list.printed());
    const std::int64_t t2 = mouse->pull_out();
    fmt::print("pull_out took {} us\n", (now_ns() - t2) / 1000);
    std::fflush(stdout);
  }
  return 0;
}
