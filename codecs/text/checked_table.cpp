#include "codecs/text/checked_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "codecs/text/nearest_word.h"

namespace farfeel::codecs {
namespace {

std::string bracketed(const std::string& name, bool is_list = false) {
  if (name.empty()) return {};
  return is_list ? fmt::format("[[{}]]", name) : fmt::format("[{}]", name);
}

}  // namespace

CheckedTable::CheckedTable(const toml::table& table, std::string name, std::string_view origin,
                           std::span<const std::string_view> allowed)
    : table_(&table), name_(std::move(name)), origin_(origin) {
  for (const auto& [key, node] : table) {
    if (std::find(allowed.begin(), allowed.end(), key.str()) != allowed.end()) continue;
    const std::string_view meant = nearest_word(key.str(), allowed);
    fail_at(key.source(),
            fmt::format("unknown key {}{}{}; allowed: {}", key.str(),
                        name_.empty() ? "" : fmt::format(" in {}", bracketed(name_)),
                        meant.empty() ? "" : fmt::format(", did you mean {}?", meant), fmt::join(allowed, ", ")));
  }
}

void CheckedTable::fail_at(const toml::source_region& where, const std::string& what) const {
  throw TableFault{fmt::format("{}:{}: {}", origin_, where.begin.line, what)};
}

void CheckedTable::fail(const std::string& what) const {
  fail_at(table_->source(), name_.empty() ? what : fmt::format("{}: {}", bracketed(name_), what));
}

void CheckedTable::fail(std::string_view key, const std::string& what) const {
  fail_at(table_->get(key)->source(), fmt::format("{} {}", path(key), what));
}

std::string CheckedTable::path(std::string_view key) const {
  return name_.empty() ? std::string(key) : name_ + "." + std::string(key);
}

bool CheckedTable::has(std::string_view key) const {
  return table_->contains(key);
}

std::optional<std::string> CheckedTable::text(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail_at(node->source(), path(key) + " must be a string, \"like this\"");
  return node->value<std::string>();
}

std::size_t CheckedTable::choice(std::string_view key, std::size_t fallback,
                                 std::span<const std::string_view> words) const {
  const std::optional<std::string> said = text(key);
  if (!said) return fallback;
  const auto found = std::find(words.begin(), words.end(), *said);
  if (found == words.end()) fail(key, fmt::format("must be one of \"{}\"", fmt::join(words, "\", \"")));
  return static_cast<std::size_t>(found - words.begin());
}

std::vector<std::string> CheckedTable::texts(std::string_view key, const std::vector<std::string>& fallback) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return fallback;
  const toml::array* array = node->as_array();
  std::vector<std::string> all;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    if ((*array)[i].is_string()) all.push_back(*(*array)[i].value<std::string>());
  }
  if (array == nullptr || all.size() != array->size())
    fail_at(node->source(), path(key) + " must be a list of strings, [\"like\", \"this\"]");
  return all;
}

bool CheckedTable::flag(std::string_view key, bool fallback) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return fallback;
  if (!node->is_boolean()) fail_at(node->source(), path(key) + " must be true or false");
  return *node->value<bool>();
}

double CheckedTable::number(std::string_view key, double fallback, double low, double high) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return fallback;
  const auto value = node->is_number() ? node->value<double>() : std::nullopt;
  if (!value || !(*value >= low && *value <= high)) {
    fail_at(node->source(), fmt::format("{} must be a number from {} to {}", path(key), low, high));
  }
  return *value;
}

int CheckedTable::whole(std::string_view key, int fallback, int low, int high) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return fallback;
  const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
  if (!value || *value < low || *value > high)
    fail_at(node->source(), fmt::format("{} must be a whole number from {} to {}", path(key), low, high));
  return static_cast<int>(*value);
}

std::optional<double> CheckedTable::number(std::string_view key, double low, double high) const {
  return has(key) ? std::optional(number(key, low, low, high)) : std::nullopt;
}

glm::dvec3 CheckedTable::vector(std::string_view key, const glm::dvec3& fallback, double limit) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return fallback;
  glm::dvec3 v;
  const toml::array* array = node->as_array();
  bool is_good = array != nullptr && array->size() == 3;
  for (std::size_t i = 0; is_good && i < 3; ++i) {
    const auto value = (*array)[i].is_number() ? (*array)[i].value<double>() : std::nullopt;
    is_good = value && std::abs(*value) <= limit;
    if (is_good) v[static_cast<int>(i)] = *value;
  }
  if (!is_good) {
    fail_at(node->source(),
            fmt::format("{} must be three numbers within +-{}, like [0.0, 0.0, 1.0]", path(key), limit));
  }
  return v;
}

glm::dvec3 CheckedTable::direction(std::string_view key, const glm::dvec3& fallback) const {
  const glm::dvec3 v = vector(key, fallback);
  if (!(glm::length(v) > 1e-6)) fail_at(table_->get(key)->source(), path(key) + " must not be zero");
  return glm::normalize(v);
}

std::optional<CheckedTable> CheckedTable::table(std::string_view key, std::span<const std::string_view> allowed) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) {
    fail_at(node->source(), fmt::format("{} must be a table, written {}", path(key), bracketed(path(key))));
  }
  return CheckedTable(*node->as_table(), path(key), origin_, allowed);
}

std::vector<CheckedTable> CheckedTable::tables(std::string_view key, std::span<const std::string_view> allowed) const {
  std::vector<CheckedTable> tables;
  const toml::node* node = table_->get(key);
  if (node == nullptr) return tables;
  if (!node->is_array_of_tables()) {
    fail_at(node->source(),
            fmt::format("{} must be a list of tables, each written {}", path(key), bracketed(path(key), true)));
  }
  for (const toml::node& each : *node->as_array()) tables.emplace_back(*each.as_table(), path(key), origin_, allowed);
  return tables;
}

}  // namespace farfeel::codecs
