// A USB device with one bulk endpoint each way, by libusb's asynchronous transfers on the caller's thread.
//
// It opens the usbfs node itself and hands it to libusb, so that the keeper can have a duplicate: a duplicate is the
// same open file, and shares what is claimed. Where the kernel or an old libusb does not go along, libusb opens it, and
// descriptor() is -1. kInTransfers reads are always under way, and one write. Transfers and buffers are made at
// opening; libusb itself allocates the kernel's structure for each that it submits, on the caller's thread.
#pragma once

#include <poll.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "master_station/devices/channel/channel.h"
#include "master_station/devices/channel/usb_listing.h"

struct libusb_context;
struct libusb_device_handle;
struct libusb_transfer;

namespace farfeel::devices {

struct UsbEndpoints {
  int interface = 0;
  std::uint8_t in = 0, out = 0;
};

class LibusbChannel final : public UsbChannel {
 public:
  static constexpr std::size_t kInTransfers = 8;
  static constexpr std::size_t kTransferBytes = 512;  ///< each way; one packet of high speed, eight of full speed

  /// Takes a kernel driver off the interface, and gives it back at the end. The error is for a person: what, why, what
  /// to do.
  [[nodiscard]] static tl::expected<std::unique_ptr<LibusbChannel>, std::string> open(const FoundUsb&,
                                                                                      const UsbEndpoints&);
  ~LibusbChannel() override;

  Transferred control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                      std::uint16_t index) noexcept override;
  Transferred control_in(std::uint8_t request_type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
                         std::span<std::byte> data) noexcept override;
  /// At most kTransferBytes; more is not taken.
  Transferred send(std::span<const std::byte> bytes) noexcept override;
  Transferred receive(std::span<std::byte> bytes, std::int64_t deadline_ns) noexcept override;
  [[nodiscard]] int descriptor() const noexcept override { return fd_; }
  [[nodiscard]] std::uint8_t out_endpoint() const noexcept override { return endpoints_.out; }

 private:
  struct Slot {
    LibusbChannel* channel = nullptr;
    libusb_transfer* transfer = nullptr;
    bool is_under_way = false;
    std::array<unsigned char, kTransferBytes> bytes{};
  };

  LibusbChannel() = default;
  [[nodiscard]] std::string start(const FoundUsb&, const UsbEndpoints&);
  [[nodiscard]] int open_node(const FoundUsb&);
  static void on_end(libusb_transfer*);
  void submit(Slot&) noexcept;
  void read_on(Slot&) noexcept;
  void clear_halt(std::uint8_t endpoint) noexcept;
  void handle_events(std::int64_t deadline_ns) noexcept;
  [[nodiscard]] Transferred result_of(const libusb_transfer&) noexcept;

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  int fd_ = -1;
  UsbEndpoints endpoints_;
  bool is_claimed_ = false, is_gone_ = false;
  bool is_halted_ = false;  // the IN endpoint: its transfers are being cancelled
  std::array<Slot, kInTransfers> in_;
  Slot out_;
  std::array<std::uint8_t, kInTransfers> ended_{};  // slots of in_, the oldest first
  std::size_t ended_count_ = 0;
  bool has_sent_ended_ = false;  // and its result was not told yet
  std::array<pollfd, 8> wake_{};
  nfds_t wake_count_ = 0;
};

}  // namespace farfeel::devices
