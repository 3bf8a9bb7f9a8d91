#include "tests/bench/work_history.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <ctime>
#include <fstream>
#include <set>

namespace farfeel::bench {

WorkHistory::WorkHistory(const std::filesystem::path& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    entries_.push_back(nlohmann::json::parse(line, nullptr, false));
    if (!entries_.back().is_object() || !entries_.back().contains("counts"))
      throw CLI::RuntimeError(fmt::format("{}: line {} is no entry of counts", path.string(), entries_.size()), 1);
  }
  if (entries_.empty()) throw CLI::RuntimeError(fmt::format("{} holds no counts", path.string()), 1);
}

std::vector<WorkDifference> WorkHistory::differences(const std::vector<CountedRow>& now) const {
  std::vector<WorkDifference> all;
  const nlohmann::json& counts = entries_.back()["counts"];
  for (const CountedRow& row : now) {
    const nlohmann::json before = counts.value(row.name, nlohmann::json::object());
    std::set<std::string> counted;
    const auto compare = [&](const std::string& counter, std::uint64_t was, std::uint64_t is) {
      const auto a = static_cast<double>(was), b = static_cast<double>(is);
      if (std::abs(b - a) > kSameWork * a) all.push_back({row.name, counter, was, is});
    };
    for (const auto& [counter, count] : row.counts) {
      counted.insert(counter);
      compare(counter, before.value(counter, std::uint64_t{0}), count);
    }
    for (const auto& [counter, count] : before.items())
      if (counted.count(counter) == 0) compare(counter, count.get<std::uint64_t>(), 0);
  }
  return all;
}

nlohmann::ordered_json to_json(const std::vector<CountedRow>& rows) {
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  for (const CountedRow& row : rows)
    for (const auto& [counter, count] : row.counts) all[row.name][counter] = count;
  return all;
}

void add_to_history(const std::filesystem::path& path, const std::string& commit, const std::string& why,
                    const std::vector<CountedRow>& rows) {
  const nlohmann::ordered_json entry{{"commit", commit},
                                     {"date", fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::time(nullptr)))},
                                     {"why", why},
                                     {"counts", to_json(rows)}};
  std::ofstream file(path, std::ios::app);
  file << entry.dump() << '\n';
  if (!file.flush()) throw CLI::RuntimeError(fmt::format("{} can't be written", path.string()), 1);
}

}  // namespace farfeel::bench
