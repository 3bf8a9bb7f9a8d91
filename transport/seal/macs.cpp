#include "transport/seal/macs.h"

#include <sodium.h>

#include <algorithm>

namespace farfeel::transport {
namespace {

unsigned char* raw(std::byte* p) {
  return reinterpret_cast<unsigned char*>(p);
}
const unsigned char* raw(const std::byte* p) {
  return reinterpret_cast<const unsigned char*>(p);
}

constexpr char kMac1Label[8] = {'m', 'a', 'c', '1', '-', '-', '-', '-'};

std::span<const std::byte> before_mac1(std::span<const std::byte> d) {
  return d.first(d.size() - 2 * kMacBytes);
}
std::span<const std::byte> before_mac2(std::span<const std::byte> d) {
  return d.first(d.size() - kMacBytes);
}

}  // namespace

Mac16 keyed_mac(std::span<const std::byte> key, std::span<const std::byte> message) noexcept {
  Mac16 mac;
  crypto_generichash(raw(mac.data()), mac.size(), raw(message.data()), message.size(), raw(key.data()), key.size());
  return mac;
}

Key32 derived_key(const Key32& key, std::span<const std::byte> message) noexcept {
  Key32 derived;
  crypto_generichash(raw(derived.data()), derived.size(), raw(message.data()), message.size(), raw(key.data()),
                     key.size());
  return derived;
}

Key32 labelled_key(std::span<const char, 8> label, const Key32& public_key) noexcept {
  std::array<std::byte, 8 + kKeyBytes> input;
  std::ranges::copy(std::as_bytes(label), input.begin());
  std::ranges::copy(public_key, input.begin() + 8);
  Key32 key;
  crypto_generichash(raw(key.data()), key.size(), raw(input.data()), input.size(), nullptr, 0);
  return key;
}

Key32 mac1_key_of(const Key32& public_key) noexcept {
  return labelled_key(kMac1Label, public_key);
}

Mac16 mac1_in(std::span<const std::byte> datagram) noexcept {
  Mac16 mac;
  std::ranges::copy(datagram.last(2 * kMacBytes).first(kMacBytes), mac.begin());
  return mac;
}

void write_mac1(const Key32& mac1_key, std::span<std::byte> datagram) noexcept {
  std::ranges::copy(keyed_mac(mac1_key, before_mac1(datagram)), datagram.last(2 * kMacBytes).begin());
  std::ranges::fill(datagram.last(kMacBytes), std::byte{0});
}

void write_mac2(const Cookie& cookie, std::span<std::byte> datagram) noexcept {
  std::ranges::copy(keyed_mac(cookie, before_mac2(datagram)), datagram.last(kMacBytes).begin());
}

bool is_mac1_right(const Key32& mac1_key, std::span<const std::byte> datagram) noexcept {
  return is_same_secret(keyed_mac(mac1_key, before_mac1(datagram)), mac1_in(datagram));
}

bool is_mac2_right(const Cookie& cookie, std::span<const std::byte> datagram) noexcept {
  return is_same_secret(keyed_mac(cookie, before_mac2(datagram)), datagram.last(kMacBytes));
}

bool is_mac2_zero(std::span<const std::byte> datagram) noexcept {
  return std::ranges::all_of(datagram.last(kMacBytes), [](std::byte b) { return b == std::byte{0}; });
}

}  // namespace farfeel::transport
