#include "deploy/front/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace farfeel::front {

std::optional<Progress> progress_from(std::string_view line) {
  constexpr std::string_view kWord = "progress ";
  if (!line.starts_with(kWord)) return std::nullopt;
  line.remove_prefix(kWord.size());
  Progress p;
  while (!line.empty()) {
    const auto end = std::min(line.find(' '), line.size());
    const std::string_view field = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
    const auto equals = field.find('=');
    if (equals == std::string_view::npos) continue;
    const std::string_view key = field.substr(0, equals);
    const std::string value(field.substr(equals + 1));
    if (key == "state") p.state = value;
    for (const auto& [name, to] : {std::pair("t", &p.t_s), std::pair("of", &p.of_s), std::pair("force", &p.force_N),
                                   std::pair("contacts", &p.contacts), std::pair("rtt", &p.rtt_ms)})
      if (key == name) *to = std::strtod(value.c_str(), nullptr);
  }
  return p;
}

std::string shown(const Progress& p) {
  constexpr int kCells = 20;
  const double share = p.of_s > 0 && std::isfinite(p.t_s) ? std::clamp(p.t_s / p.of_s, 0.0, 1.0) : 0;
  const int full = static_cast<int>(std::lround(share * kCells));
  std::string bar;
  for (int i = 0; i < kCells; ++i) bar += i < full ? '#' : '.';
  const std::string rtt = std::isfinite(p.rtt_ms) ? fmt::format("{:.1f} ms", p.rtt_ms) : "-";
  return fmt::format("{:5.1f} of {:.0f} s [{}] {:<8} {:5.2f} N  {:2.0f} contacts  rtt {}", p.t_s, p.of_s, bar, p.state,
                     p.force_N, p.contacts, rtt);
}

}  // namespace farfeel::front
