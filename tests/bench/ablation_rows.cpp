#include "tests/bench/ablation_rows.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "tests/bench/on_all_cores.h"

namespace farfeel::bench {
namespace {

constexpr std::array kFamilies{judge_changes, judge_real_shapes, judge_jabs, judge_moving_objects};

std::string name_of(const LoopCaseRow& row) {
  return fmt::format("{}, {}, {} hand, {:.0f} g, {:.0f} ms, {:.0f} % lost", row.name, row.rung, row.grip,
                     1e3 * row.mass_kg, 1e-6 * static_cast<double>(row.link.round_trip_ns), 100 * row.link.loss);
}

}  // namespace

AblationRows::AblationRows() : contact_(contact_cases()), families_{0} {
  const LoopCaseChoice listed{.only = {}, .link = {}, .takes = [this](const LoopCaseRow& row) {
                                loop_.push_back(row);
                                return false;
                              }};
  for (const auto& family : kFamilies) {
    static_cast<void>(family(listed));
    families_.push_back(loop_.size());
  }
  for (std::size_t i = 0; i < loop_.size(); ++i) {
    const LoopCaseRow& row = loop_[i];
    without_link_.push_back(i);
    for (std::size_t j = 0; j < loop_.size(); ++j) {
      const LoopCaseRow& other = loop_[j];
      if (other.link.round_trip_ns == 0 && other.name == row.name && other.rung == row.rung && other.grip == row.grip &&
          other.mass_kg == row.mass_kg)
        without_link_[i] = j;
    }
  }
}

std::vector<JudgedRow> AblationRows::judge(const std::set<std::size_t>& contact,
                                           const std::set<std::size_t>& loop) const {
  const std::vector<std::size_t> cases(contact.begin(), contact.end());
  std::vector<HardCaseRows> of_case(cases.size());
  on_all_cores(cases.size(), [&](std::size_t i) { contact_[cases[i]].judge(of_case[i]); });
  std::vector<JudgedRow> all;
  for (const HardCaseRows& rows : of_case) {
    for (const HardCaseRow& row : rows) all.push_back({row.name + ": " + row.figure, row.passes(), 0});
  }
  std::set<std::size_t> run = loop;
  for (const std::size_t row : loop) run.insert(without_link_[row]);
  for (std::size_t f = 0; f < kFamilies.size(); ++f) {
    if (run.lower_bound(families_[f]) == run.lower_bound(families_[f + 1])) continue;
    std::size_t at = families_[f];
    const LoopCaseChoice chosen{
        .only = {}, .link = {}, .takes = [&run, &at](const LoopCaseRow&) { return run.count(at++) > 0; }};
    for (const LoopCaseRow& row : with_forces_judged(kFamilies[f](chosen)))
      all.push_back({name_of(row), row.passes, row.link.round_trip_ns > 0 ? std::abs(1 - row.force_share) : 0});
  }
  return all;
}

}  // namespace farfeel::bench
