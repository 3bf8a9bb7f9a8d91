#include "tests/hardware_lab/usb_gadget.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace farfeel::hardware_lab {
namespace {

constexpr const char* kGadgets = "/sys/kernel/config/usb_gadget";
constexpr const char* kController = "dummy_udc.0";  // dummy_hcd's first
constexpr std::uint16_t kStranger = 0x1d6b;         // the Linux Foundation's

void make_folder(const std::string& path) {
  if (mkdir(path.c_str(), 0755) == 0 || errno == EEXIST) return;
  fmt::print(stderr, "cannot make {}: {}\n", path, std::strerror(errno));
  std::exit(1);
}

}  // namespace

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void write_or_die(const std::string& path, const std::string& text) {
  const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd >= 0 && write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size())) {
    close(fd);
    return;
  }
  fmt::print(stderr, "cannot write '{}' to {}: {}\n", text, path, std::strerror(errno));
  std::exit(1);
}

UsbGadget::UsbGadget(const std::string& name, const UsbIdentity& identity, const std::string& function)
    : path_(fmt::format("{}/{}", kGadgets, name)),
      function_path_(fmt::format("{}/functions/{}", path_, function)),
      link_path_(fmt::format("{}/configs/c.1/{}", path_, function)),
      vendor_(identity.vendor),
      product_(identity.product) {
  make_folder(path_);
  tell_ids(vendor_, product_);
  make_folder(path_ + "/strings/0x409");
  write_or_die(path_ + "/strings/0x409/manufacturer", identity.manufacturer);
  write_or_die(path_ + "/strings/0x409/product", identity.name);
  write_or_die(path_ + "/strings/0x409/serialnumber", identity.serial);
  make_folder(path_ + "/configs/c.1");
  make_folder(function_path_);
}

UsbGadget::~UsbGadget() {
  if (is_plugged_in_) pull_out();
  unlink(link_path_.c_str());
  for (const std::string& folder : {function_path_, path_ + "/configs/c.1", path_ + "/strings/0x409", path_}) {
    rmdir(folder.c_str());
  }
}

void UsbGadget::add_function() {
  if (symlink(function_path_.c_str(), link_path_.c_str()) == 0) return;
  fmt::print(stderr, "cannot add {}: {}\n", function_path_, std::strerror(errno));
  std::exit(1);
}

void UsbGadget::tell_ids(std::uint16_t vendor, std::uint16_t product) const {
  write_or_die(path_ + "/idVendor", fmt::format("{:#06x}", vendor));
  write_or_die(path_ + "/idProduct", fmt::format("{:#06x}", product));
}

void UsbGadget::plug_in(bool is_stranger) {
  tell_ids(is_stranger ? kStranger : vendor_, is_stranger ? kStranger : product_);
  write_or_die(path_ + "/UDC", kController);
  is_plugged_in_ = true;
}

std::int64_t UsbGadget::pull_out() {
  const std::int64_t before_ns = now_ns();
  write_or_die(path_ + "/UDC", "\n");
  is_plugged_in_ = false;
  return before_ns;
}

}  // namespace farfeel::hardware_lab
