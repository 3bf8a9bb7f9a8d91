#include "master_station/devices/host/watched.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr int kBarHalf = 10;  // characters on each side
constexpr double kDegrees = 57.29577951308232;
constexpr unsigned kButtons = 32;
constexpr std::size_t kValue = 67, kAdviceLines = 3;  // a terminal of 80 columns does not wrap what is drawn over

std::string pressed(const Sample& sample) {
  std::string all;
  for (unsigned i = 0; i < kButtons; ++i)
    if (sample.has_button(i)) all += fmt::format("{}{}", all.empty() ? "" : " ", i);
  return all.empty() ? std::string("none") : all;
}

std::string three(const glm::dvec3& v, double scale, const char* unit) {
  return fmt::format("{:9.2f} {:9.2f} {:9.2f} {}", v.x * scale, v.y * scale, v.z * scale, unit);
}

}  // namespace

std::string bar(double share) {
  std::string text(2 * kBarHalf + 1, '-');
  text[kBarHalf] = '|';
  const int end = std::isfinite(share) ? static_cast<int>(std::lround(std::clamp(share, -1.0, 1.0) * kBarHalf)) : 0;
  for (int i = std::min(end, 0); i <= std::max(end, 0); ++i)
    if (i != 0) text[static_cast<std::size_t>(kBarHalf + i)] = '#';
  return '[' + text + ']';
}

std::string picture(const Watched& watched) {
  const Sample& s = watched.sample;
  std::string text;
  const auto add = [&text](const char* what, const std::string& value) {
    text += fmt::format("{:<12}{:<{}.{}}\n", what, value, kValue, kValue);
  };
  add("device", watched.name);
  add("stage", std::string(name(s.stage)));
  const std::string advice = watched.advice.empty() ? "nothing; force stays off here" : watched.advice;
  for (std::size_t i = 0; i < kAdviceLines; ++i)
    add(i == 0 ? "to do" : "", advice.size() > i * kValue ? advice.substr(i * kValue, kValue) : std::string());
  add("position", three(s.X_BD.p, 1e3, "mm    right, away, up"));
  add("turned", three(spatial::vector_from_rotation(s.X_BD.R), kDegrees, "deg   about right, away, up"));
  add("velocity", three(s.V_BD_B.linear_m_s, 1e3, "mm/s"));
  add("turning", three(s.V_BD_B.angular_rad_s, kDegrees, "deg/s"));
  for (int i = 0; i < 3; ++i) {
    add(i == 0 ? "deflection" : "",
        fmt::format("{} push {}   turn {}", "xyz"[i], bar(s.deflection.push[i]), bar(s.deflection.turn[i])));
  }
  add("buttons", pressed(s));
  add("reports", fmt::format("{:.0f} a second; the newest is {:.1f} ms old; a step takes {:.3f} ms", watched.reports_Hz,
                             watched.age_ms, watched.exchange_ms));
  return text;
}

std::string line(const Watched& watched) {
  const Sample& s = watched.sample;
  const auto three_of = [](const glm::dvec3& v, double scale) {
    return fmt::format("{:.2f},{:.2f},{:.2f}", v.x * scale, v.y * scale, v.z * scale);
  };
  return fmt::format(
      "{} {} position_mm={} turned_deg={} velocity_mm_s={} push={} turn={} buttons={} reports_Hz={:.0f} age_ms={:.1f} "
      "step_ms={:.3f}{}{}",
      watched.name, name(s.stage), three_of(s.X_BD.p, 1e3), three_of(spatial::vector_from_rotation(s.X_BD.R), kDegrees),
      three_of(s.V_BD_B.linear_m_s, 1e3), three_of(s.deflection.push, 1), three_of(s.deflection.turn, 1), pressed(s),
      watched.reports_Hz, watched.age_ms, watched.exchange_ms, watched.advice.empty() ? "" : " ", watched.advice);
}

}  // namespace farfeel::devices
