#include "master_station/devices/host/owner_thread.h"

namespace farfeel::devices {

tl::expected<std::unique_ptr<OwnerThread>, std::string> OwnerThread::start(std::span<const DriverFamily> families,
                                                                           WantedDevice wanted, DriverOptions options) {
  auto link = MappedLink::create();
  if (!link) return tl::unexpected(link.error());
  return std::unique_ptr<OwnerThread>(
      new OwnerThread(*std::move(link), families, std::move(wanted), std::move(options)));
}

OwnerThread::OwnerThread(MappedLink link, std::span<const DriverFamily> families, WantedDevice wanted,
                         DriverOptions options)
    : link_(std::move(link)),
      owner_(link_.memory(), link_.fd(), families, std::move(wanted), std::move(options)),
      thread_([this] { owner_.run(stop_); }) {}

OwnerThread::~OwnerThread() {
  stop_ = true;
  thread_.join();
}

Sample OwnerThread::sample() const noexcept {
  Sample sample;
  static_cast<void>(link_.memory().sample.load(sample));
  return sample;
}

OpenedDevice OwnerThread::opened() const noexcept {
  OpenedDevice opened;
  static_cast<void>(link_.memory().opened.load(opened));
  return opened;
}

std::string OwnerThread::advice() const {
  FixedText<512> text;
  return link_.memory().advice.load(text) ? text.text() : std::string();
}

}  // namespace farfeel::devices
