// A HID device in software: reports in, reports out, no I/O of its own. In memory, behind hidraw under umockdev, or as
// a uhid device, it is the same object.
//
// Time is an argument, on any clock that does not go back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace farfeel::test_support {

struct HidIdentity {
  std::uint16_t vendor = 0, product = 0;
  std::string_view name, serial;
};

class HidEmulator {
 public:
  virtual ~HidEmulator() = default;

  [[nodiscard]] virtual HidIdentity identity() const = 0;
  [[nodiscard]] virtual std::span<const std::byte> report_descriptor() const = 0;
  /// An output report as write() on a hidraw node has it, and UHID_OUTPUT: the id first, 0 where reports have none.
  virtual void take_output(std::span<const std::byte> report, std::int64_t time_ns) = 0;
  /// The next input report as read() on a hidraw node has it, and UHID_INPUT2: the id first, only where reports have
  /// one. Returns its size; 0: there is none by now. `to` holds at least 64 bytes.
  virtual std::size_t give_input(std::span<std::byte> to, std::int64_t time_ns) = 0;
  /// to[0] says which; 0: there is none.
  virtual std::size_t get_feature(std::span<std::byte> /*to*/) { return 0; }
  virtual bool set_feature(std::span<const std::byte> /*report*/) { return false; }
};

}  // namespace farfeel::test_support
