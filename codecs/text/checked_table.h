// A table of a TOML file whose keys are known: it refuses any other key at once, and values that are not allowed, with
// file, line, what is wrong and what is allowed. For sources only: it brings the TOML library with it.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/text/toml.h"

namespace farfeel::codecs {

class CheckedTable {
 public:
  /// name: as a person writes it, "tool" for [tool]; empty for the file's top. Everything named outlives the table.
  CheckedTable(const toml::table& table, std::string name, std::string_view origin,
               std::span<const std::string_view> allowed);

  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] std::optional<std::string> text(std::string_view key) const;
  /// One of `words`, by its place there.
  [[nodiscard]] std::size_t choice(std::string_view key, std::size_t fallback,
                                   std::span<const std::string_view> words) const;
  [[nodiscard]] std::vector<std::string> texts(std::string_view key, const std::vector<std::string>& fallback) const;
  [[nodiscard]] bool flag(std::string_view key, bool fallback) const;
  [[nodiscard]] double number(std::string_view key, double fallback, double low, double high) const;
  [[nodiscard]] int whole(std::string_view key, int fallback, int low, int high) const;
  [[nodiscard]] std::optional<double> number(std::string_view key, double low, double high) const;
  /// Each component within +-limit.
  [[nodiscard]] glm::dvec3 vector(std::string_view key, const glm::dvec3& fallback, double limit = 100) const;
  /// Of unit length, whatever length was written, but not zero.
  [[nodiscard]] glm::dvec3 direction(std::string_view key, const glm::dvec3& fallback) const;
  [[nodiscard]] std::optional<CheckedTable> table(std::string_view key,
                                                  std::span<const std::string_view> allowed) const;
  [[nodiscard]] std::vector<CheckedTable> tables(std::string_view key, std::span<const std::string_view> allowed) const;

  /// Complains of a key that is there.
  [[noreturn]] void fail(std::string_view key, const std::string& what) const;
  /// Complains of the table as a whole.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  [[noreturn]] void fail_at(const toml::source_region& where, const std::string& what) const;
  [[nodiscard]] std::string path(std::string_view key) const;

  const toml::table* table_;
  std::string name_;
  std::string_view origin_;
};

}  // namespace farfeel::codecs
