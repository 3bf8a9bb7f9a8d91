#include "master_station/devices/channel/libusb_channel.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libusb.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {

namespace {

constexpr unsigned kControl_ms = 1000;
constexpr std::int64_t kCancel_ns = 1'000'000'000;  // the kernel gives cancelled transfers back at once

/// bus and address of /dev/bus/usb/BBB/DDD.
bool is_at(libusb_device* device, const std::string& path) {
  return fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device), libusb_get_device_address(device)) ==
         path;
}

std::string why_not_opened(const FoundUsb& found, int error) {
  switch (error) {
    case LIBUSB_ERROR_ACCESS:
      return fmt::format(
          "no permission for {}: install deploy/udev/70-farfeel.rules in /etc/udev/rules.d, then plug "
          "the device in again",
          found.path);
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return fmt::format("{} was unplugged while it was opened", found.path);
    case LIBUSB_ERROR_BUSY: {
      const std::string user = other_user_of(found.path);
      return fmt::format("{} is busy: {} uses it; end that program", found.path,
                         user.empty() ? "another program" : user);
    }
    default:
      return fmt::format("{} could not be opened: {}", found.path, libusb_strerror(error));
  }
}

}  // namespace

tl::expected<std::unique_ptr<LibusbChannel>, std::string> LibusbChannel::open(const FoundUsb& found,
                                                                              const UsbEndpoints& endpoints) {
  std::unique_ptr<LibusbChannel> channel(new LibusbChannel);
  if (const std::string trouble = channel->start(found, endpoints); !trouble.empty()) return tl::unexpected(trouble);
  return channel;
}

/// A libusb_error.
int LibusbChannel::open_node(const FoundUsb& found) {
  fd_ = ::open(found.path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd_ < 0) return errno == EACCES || errno == EPERM ? LIBUSB_ERROR_ACCESS : LIBUSB_ERROR_NO_DEVICE;
  if (libusb_wrap_sys_device(context_, fd_, &handle_) == LIBUSB_SUCCESS) return LIBUSB_SUCCESS;
  ::close(fd_);
  fd_ = -1;
  libusb_device** all = nullptr;
  const ssize_t count = libusb_get_device_list(context_, &all);
  int result = LIBUSB_ERROR_NO_DEVICE;
  for (ssize_t i = 0; i < count; ++i)
    if (is_at(all[i], found.path)) result = libusb_open(all[i], &handle_);
  if (count >= 0) libusb_free_device_list(all, 1);
  return result;
}

std::string LibusbChannel::start(const FoundUsb& found, const UsbEndpoints& endpoints) {
  endpoints_ = endpoints;
  if (const int error = libusb_init(&context_); error != LIBUSB_SUCCESS) {
    context_ = nullptr;
    return fmt::format("libusb could not be started: {}", libusb_strerror(error));
  }
  if (const int error = open_node(found); error != LIBUSB_SUCCESS) return why_not_opened(found, error);
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  if (const int error = libusb_claim_interface(handle_, endpoints.interface); error != LIBUSB_SUCCESS)
    return why_not_opened(found, error);
  is_claimed_ = true;

  const libusb_pollfd** all = libusb_get_pollfds(context_);
  for (std::size_t i = 0; all != nullptr && all[i] != nullptr && wake_count_ < wake_.size(); ++i)
    wake_[wake_count_++] = {all[i]->fd, all[i]->events, 0};
  libusb_free_pollfds(all);

  const auto make = [&](Slot& slot, std::uint8_t endpoint) {
    slot.channel = this;
    slot.transfer = libusb_alloc_transfer(0);
    if (slot.transfer == nullptr) return false;
    libusb_fill_bulk_transfer(slot.transfer, handle_, endpoint, slot.bytes.data(), static_cast<int>(kTransferBytes),
                              on_end, &slot, 0);
    return true;
  };
  bool is_made = make(out_, endpoints.out);
  for (Slot& slot : in_) is_made = is_made && make(slot, endpoints.in);
  if (!is_made) return "no memory for USB transfers";
  for (Slot& slot : in_) submit(slot);
  if (is_gone_) return why_not_opened(found, LIBUSB_ERROR_NO_DEVICE);
  return {};
}

LibusbChannel::~LibusbChannel() {
  const auto each = [&](auto use) {
    for (Slot& slot : in_) use(slot);
    use(out_);
  };
  bool is_any_under_way = false;
  each([](Slot& slot) {
    if (slot.is_under_way) libusb_cancel_transfer(slot.transfer);
  });
  const std::int64_t end_ns = realtime::monotonic_now_ns() + kCancel_ns;
  do {
    is_any_under_way = false;
    each([&](const Slot& slot) { is_any_under_way |= slot.is_under_way; });
    if (is_any_under_way) handle_events(std::min(end_ns, realtime::monotonic_now_ns() + 1'000'000));
  } while (is_any_under_way && realtime::monotonic_now_ns() < end_ns);
  each([](Slot& slot) {
    if (!slot.is_under_way) libusb_free_transfer(slot.transfer);
  });
  if (is_claimed_) libusb_release_interface(handle_, endpoints_.interface);
  if (handle_ != nullptr) libusb_close(handle_);
  if (fd_ >= 0) ::close(fd_);
  if (context_ != nullptr) libusb_exit(context_);
}

void LibusbChannel::on_end(libusb_transfer* transfer) {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  LibusbChannel& self = *slot.channel;
  slot.is_under_way = false;
  if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) self.is_gone_ = true;
  if (&slot == &self.out_)
    self.has_sent_ended_ = true;
  else
    self.ended_[self.ended_count_++] = static_cast<std::uint8_t>(&slot - self.in_.data());
}

void LibusbChannel::submit(Slot& slot) noexcept {
  const int error = libusb_submit_transfer(slot.transfer);
  slot.is_under_way = error == LIBUSB_SUCCESS;
  // A read that cannot be started is not started again: only a device that went, or a kernel without memory, does that.
  if (!slot.is_under_way) is_gone_ = true;
}

/// Waits for any event until then, and handles all that there are. libusb itself waits in whole milliseconds.
void LibusbChannel::handle_events(std::int64_t deadline_ns) noexcept {
  const std::int64_t left_ns = std::max<std::int64_t>(0, deadline_ns - realtime::monotonic_now_ns());
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  for (nfds_t i = 0; i < wake_count_; ++i) wake_[i].revents = 0;
  (void)::ppoll(wake_.data(), wake_count_, &left, nullptr);
  timeval none{0, 0};
  libusb_handle_events_timeout_completed(context_, &none, nullptr);
}

Transferred LibusbChannel::result_of(const libusb_transfer& transfer) noexcept {
  switch (transfer.status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return {ChannelState::kDone, static_cast<std::size_t>(transfer.actual_length)};
    case LIBUSB_TRANSFER_STALL:
      return {ChannelState::kStalled, 0};
    case LIBUSB_TRANSFER_NO_DEVICE:
      return {ChannelState::kGone, 0};
    default:
      return {ChannelState::kNothing, 0};  // a line error: what was to come is lost
  }
}

Transferred LibusbChannel::control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                                   std::uint16_t index) noexcept {
  return control_in(request_type, request, value, index, {});
}

Transferred LibusbChannel::control_in(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                                      std::uint16_t index, std::span<std::byte> data) noexcept {
  if (is_gone_) return {ChannelState::kGone, 0};
  const int n = libusb_control_transfer(handle_, request_type, request, value, index,
                                        reinterpret_cast<unsigned char*>(data.data()),
                                        static_cast<std::uint16_t>(data.size()), kControl_ms);
  if (n == LIBUSB_ERROR_NO_DEVICE) is_gone_ = true;
  if (is_gone_) return {ChannelState::kGone, 0};
  if (n == LIBUSB_ERROR_TIMEOUT) return {ChannelState::kNothing, 0};
  if (n < 0) return {ChannelState::kStalled, 0};
  return {ChannelState::kDone, static_cast<std::size_t>(n)};
}

Transferred LibusbChannel::send(std::span<const std::byte> bytes) noexcept {
  if (out_.is_under_way) handle_events(0);
  if (is_gone_) return {ChannelState::kGone, 0};
  if (out_.is_under_way || bytes.size() > kTransferBytes) return {ChannelState::kNothing, 0};
  if (has_sent_ended_) {
    has_sent_ended_ = false;
    const Transferred before = result_of(*out_.transfer);
    if (before.state == ChannelState::kStalled) clear_halt(endpoints_.out);
    if (before.state == ChannelState::kStalled || before.state == ChannelState::kGone) return before;
  }
  std::memcpy(out_.bytes.data(), bytes.data(), bytes.size());
  out_.transfer->length = static_cast<int>(bytes.size());
  submit(out_);
  if (is_gone_) return {ChannelState::kGone, 0};
  return {ChannelState::kDone, bytes.size()};
}

void LibusbChannel::clear_halt(std::uint8_t endpoint) noexcept {
  if (libusb_clear_halt(handle_, endpoint) == LIBUSB_ERROR_NO_DEVICE) is_gone_ = true;
}

/// A halt may be cleared when no transfer is under way on its endpoint: then all begin anew.
void LibusbChannel::read_on(Slot& slot) noexcept {
  if (is_gone_) return;
  if (!is_halted_) return submit(slot);
  const auto waits = [](const Slot& one) { return one.is_under_way; };
  if (ended_count_ != 0 || std::ranges::any_of(in_, waits)) return;
  clear_halt(endpoints_.in);
  is_halted_ = false;
  for (Slot& one : in_)
    if (!is_gone_) submit(one);
}

Transferred LibusbChannel::receive(std::span<std::byte> bytes, std::int64_t deadline_ns) noexcept {
  for (bool has_waited = false;; has_waited = true) {
    if (is_gone_) return {ChannelState::kGone, 0};
    if (ended_count_ == 0) {
      if (has_waited && realtime::monotonic_now_ns() >= deadline_ns) return {};
      handle_events(has_waited ? deadline_ns : 0);
      continue;
    }
    Slot& slot = in_[ended_[0]];
    std::shift_left(ended_.begin(), ended_.end(), 1);
    --ended_count_;
    Transferred came = result_of(*slot.transfer);
    came.bytes = std::min(came.bytes, bytes.size());
    std::memcpy(bytes.data(), slot.bytes.data(), came.bytes);
    if (came.state == ChannelState::kStalled && !is_halted_) {
      is_halted_ = true;
      for (Slot& other : in_)
        if (other.is_under_way) libusb_cancel_transfer(other.transfer);
    }
    read_on(slot);
    if (came.state != ChannelState::kNothing) return came;
  }
}

}  // namespace farfeel::devices
