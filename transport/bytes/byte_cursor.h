// Little-endian fields written to and read from bytes, never past the end.
//
// Every message of the wire is written and read through these two, so that one place decides byte order and bounds.
// Neither allocates, throws or reads out of range: running past the end is remembered, and asked for once, at the end.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace farfeel::transport {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian: swap bytes here for this machine");

class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::byte> to) noexcept : to_(to) {}

  void u8(std::uint8_t v) noexcept { put(v); }
  void u16(std::uint16_t v) noexcept { put(v); }
  void u32(std::uint32_t v) noexcept { put(v); }
  void u64(std::uint64_t v) noexcept { put(v); }
  void i64(std::int64_t v) noexcept { put(v); }
  void f32(double v) noexcept { put(static_cast<float>(v)); }  ///< rounded; the range is the caller's business
  void f64(double v) noexcept { put(v); }
  void bytes(std::span<const std::byte> v) noexcept { raw(v.data(), v.size()); }
  /// Zero bytes up to a total of size; nothing if there are as many already.
  void pad_to(std::size_t size) noexcept {
    while (size_ < size && ok_) put(std::uint8_t{0});
  }

  [[nodiscard]] bool ok() const noexcept { return ok_; }  ///< whether everything fitted
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::span<const std::byte> written() const noexcept { return to_.first(size_); }

 private:
  template <typename T>
  void put(T v) noexcept {
    raw(&v, sizeof v);
  }
  void raw(const void* from, std::size_t n) noexcept {
    ok_ = ok_ && n <= to_.size() - size_;
    if (!ok_ || n == 0) return;
    std::memcpy(to_.data() + size_, from, n);
    size_ += n;
  }

  std::span<std::byte> to_;
  std::size_t size_ = 0;
  bool ok_ = true;
};

/// Past the end every read gives zero, and ok() is false from then on.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> from) noexcept : from_(from) {}

  [[nodiscard]] std::uint8_t u8() noexcept { return get<std::uint8_t>(); }
  [[nodiscard]] std::uint16_t u16() noexcept { return get<std::uint16_t>(); }
  [[nodiscard]] std::uint32_t u32() noexcept { return get<std::uint32_t>(); }
  [[nodiscard]] std::uint64_t u64() noexcept { return get<std::uint64_t>(); }
  [[nodiscard]] std::int64_t i64() noexcept { return get<std::int64_t>(); }
  [[nodiscard]] double f32() noexcept { return static_cast<double>(get<float>()); }
  [[nodiscard]] double f64() noexcept { return get<double>(); }
  /// The next n bytes, in place; empty if there are not so many.
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t n) noexcept {
    ok_ = ok_ && n <= from_.size() - at_;
    if (!ok_) return {};
    at_ += n;
    return from_.subspan(at_ - n, n);
  }

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t remaining() const noexcept { return from_.size() - at_; }
  [[nodiscard]] bool is_at_end() const noexcept { return ok_ && at_ == from_.size(); }

 private:
  template <typename T>
  T get() noexcept {
    T v{};
    const auto from = bytes(sizeof v);
    if (!from.empty()) std::memcpy(&v, from.data(), sizeof v);
    return v;
  }

  std::span<const std::byte> from_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace farfeel::transport
