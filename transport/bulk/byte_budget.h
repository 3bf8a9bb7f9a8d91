// A number of bytes that several owners share: of all peers of a scene, or of all objects of a peer. Thread-safe,
// lock-free.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace farfeel::transport {

class ByteBudget {
 public:
  explicit ByteBudget(std::uint64_t bytes) : free_(bytes) {}

  [[nodiscard]] std::uint64_t free_bytes() const { return free_.load(std::memory_order_relaxed); }
  /// False, and nothing is taken, if there are not as many left.
  [[nodiscard]] bool take(std::uint64_t bytes) {
    std::uint64_t left = free_.load(std::memory_order_relaxed);
    do {
      if (left < bytes) return false;
    } while (!free_.compare_exchange_weak(left, left - bytes, std::memory_order_relaxed));
    return true;
  }
  void give_back(std::uint64_t bytes) { free_.fetch_add(bytes, std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> free_;
};

/// Bytes taken from a peer's and a scene's budget, given back when it ends. Empty if either had too little.
class ByteReservation {
 public:
  ByteReservation() = default;
  ByteReservation(std::shared_ptr<ByteBudget> peer, std::shared_ptr<ByteBudget> scene, std::uint64_t bytes) {
    if (!peer->take(bytes)) return;
    if (!scene->take(bytes)) {
      peer->give_back(bytes);
      return;
    }
    peer_ = std::move(peer), scene_ = std::move(scene), bytes_ = bytes;
  }
  ByteReservation(ByteReservation&& other) noexcept
      : peer_(std::move(other.peer_)), scene_(std::move(other.scene_)), bytes_(std::exchange(other.bytes_, 0)) {}
  ByteReservation& operator=(ByteReservation&& other) noexcept {
    std::swap(peer_, other.peer_);
    std::swap(scene_, other.scene_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~ByteReservation() {
    if (bytes_ == 0) return;
    peer_->give_back(bytes_);
    scene_->give_back(bytes_);
  }
  [[nodiscard]] explicit operator bool() const { return bytes_ > 0; }

 private:
  std::shared_ptr<ByteBudget> peer_, scene_;
  std::uint64_t bytes_ = 0;
};

}  // namespace farfeel::transport
