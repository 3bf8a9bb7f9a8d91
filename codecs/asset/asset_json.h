// The members of an asset's JSON, and the arrays that they name.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "codecs/mesh/glb.h"

namespace farfeel::codecs {

/// Reads members one after another; the first failure sticks, and everything after it gives zeros.
class AssetJson {
 public:
  AssetJson(const nlohmann::json& gltf, std::span<const std::byte> binary) : gltf_(gltf), binary_(binary) {}

  const nlohmann::json& object(const nlohmann::json& in, const char* key) {
    static const nlohmann::json kNone = nlohmann::json::object();
    const auto found = in.is_object() ? in.find(key) : in.end();
    if (!in.is_object() || found == in.end()) {
      fail(fmt::format("\"{}\" is missing", key));
      return kNone;
    }
    return *found;
  }
  std::uint64_t integer(const nlohmann::json& in, const char* key, std::uint64_t most) {
    const auto value = bounded_integer(in, key, most);
    if (!value) fail(value.error());
    return value.value_or(0);
  }
  double number(const nlohmann::json& in, const char* key) {
    const auto value = finite_number(in, key);
    if (!value) fail(value.error());
    return value.value_or(0);
  }
  template <std::size_t N>
  std::array<double, N> numbers(const nlohmann::json& in, const char* key) {
    std::array<double, N> out{};
    const nlohmann::json& list = object(in, key);
    if (!list.is_array() || list.size() != N) {
      fail(fmt::format("\"{}\" is not a list of {} numbers", key, N));
      return out;
    }
    for (std::size_t i = 0; i < N; ++i) {
      if (!list[i].is_number()) {
        fail(fmt::format("\"{}\" is not a list of {} numbers", key, N));
      } else {
        out[i] = list[i].get<double>();
      }
    }
    return out;
  }
  /// The view's values; their number must be exactly `count`.
  template <typename T>
  std::vector<T> values(const nlohmann::json& in, const char* key, std::uint64_t count) {
    const std::span<const std::byte> view = bytes(in, key);
    if (view.size() % sizeof(T) != 0 || view.size() / sizeof(T) != count) {
      fail(fmt::format("\"{}\" has {} bytes, not {} values", key, view.size(), count));
      return {};
    }
    std::vector<T> out(count);
    if (count > 0) std::memcpy(out.data(), view.data(), view.size());
    return out;
  }
  [[nodiscard]] std::span<const std::byte> bytes(const nlohmann::json& in, const char* key) {
    constexpr std::uint64_t kMostViews = 1U << 28;
    const auto view = buffer_view(gltf_, binary_, integer(in, key, kMostViews));
    if (!view) fail(view.error());
    return view.value_or(std::span<const std::byte>());
  }
  void fail(std::string why) {
    if (error_.empty()) error_ = std::move(why);
  }
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  const nlohmann::json& gltf_;
  std::span<const std::byte> binary_;
  std::string error_;
};

}  // namespace farfeel::codecs
