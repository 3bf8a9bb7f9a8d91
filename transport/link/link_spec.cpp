#include "transport/link/link_spec.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "codecs/text/nearest_word.h"

namespace farfeel::transport {
namespace {

struct Unit {
  std::string_view name;
  double factor;
};
constexpr std::array<Unit, 3> kTimes{{{"ms", 1e6}, {"us", 1e3}, {"s", 1e9}}};  // to nanoseconds
constexpr std::array<Unit, 3> kRates{{{"kbit", 1e3}, {"Mbit", 1e6}, {"Gbit", 1e9}}};
constexpr std::array<Unit, 1> kShares{{{"%", 0.01}}};
constexpr double kLongest_ns = 60e9;
constexpr std::array<std::string_view, 9> kKeys = {"rtt",       "jitter", "loss",  "burst", "reorder",
                                                   "duplicate", "rate",   "queue", "mtu"};

constexpr const char* kGrammar =
    "Write for example \"rtt=100ms jitter=5ms loss=1%,burst=4 reorder=0.5% duplicate=0.1% rate=20Mbit queue=50ms "
    "mtu=1400\"; "
    "times take us, ms or s, shares %, rates kbit, Mbit or Gbit, mtu bytes";

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

template <std::size_t N>
std::optional<double> quantity(std::string_view text, const std::array<Unit, N>& units) {
  for (const Unit& unit : units) {
    if (!text.ends_with(unit.name)) continue;
    const auto value = number(text.substr(0, text.size() - unit.name.size()));
    return value ? std::optional(*value * unit.factor) : std::nullopt;
  }
  return std::nullopt;
}

tl::unexpected<Error> unreadable(const std::string& why) {
  return tl::unexpected(Error{ErrorKind::kAddress, "cannot read the link: " + why + ". " + kGrammar});
}

/// Sets one key; the reason if it cannot.
std::optional<std::string> set(LinkSpec& spec, std::string_view key, std::string_view value) {
  const std::string shown = std::string(key) + "=" + std::string(value);
  const auto time = [&](std::int64_t& to) -> std::optional<std::string> {
    const auto ns = quantity(value, kTimes);
    if (!ns) return "'" + shown + "' is not a time";
    if (!(*ns >= 0 && *ns <= kLongest_ns)) return "'" + shown + "' must be within 0 and 60 s";
    to = std::llround(*ns);
    return std::nullopt;
  };
  const auto share = [&](double& to) -> std::optional<std::string> {
    const auto part = quantity(value, kShares);
    if (!part) return "'" + shown + "' is not a percentage";
    if (!(*part >= 0 && *part <= 1)) return "'" + shown + "' must be within 0 % and 100 %";
    to = *part;
    return std::nullopt;
  };
  if (key == "rtt") return time(spec.round_trip_ns);
  if (key == "jitter") return time(spec.jitter_ns);
  if (key == "queue") return time(spec.queue_ns);
  if (key == "loss") return share(spec.loss);
  if (key == "reorder") return share(spec.reorder);
  if (key == "duplicate") return share(spec.duplicate);
  if (key == "burst") {
    const auto length = number(value);
    if (!length || !(*length >= 1 && *length <= 1e6))
      return "'" + shown + "' must be a number of datagrams, at least 1";
    spec.burst = *length;
    return std::nullopt;
  }
  if (key == "rate") {
    const auto rate = quantity(value, kRates);
    if (!rate || !(*rate >= 1e3 && *rate <= 1e12)) return "'" + shown + "' must be a rate of at least 1kbit";
    spec.rate_bit_per_s = *rate;
    return std::nullopt;
  }
  if (key == "mtu") {
    const auto bytes = number(value);
    if (!bytes || !(*bytes >= 68 && *bytes <= 65535)) return "'" + shown + "' must be within 68 and 65535 bytes";
    spec.mtu_bytes = static_cast<std::size_t>(*bytes);
    return std::nullopt;
  }
  const std::string_view meant = codecs::nearest_word(key, kKeys);
  return fmt::format("there is no '{}'{} There are {}", key,
                     meant.empty() ? "." : fmt::format("; did you mean '{}'?", meant), fmt::join(kKeys, ", "));
}

}  // namespace

tl::expected<LinkSpec, Error> parse_link_spec(const std::string& text) {
  LinkSpec spec;
  std::set<std::string, std::less<>> seen;
  std::string words = text;
  for (char& c : words) {
    if (c == ',') c = ' ';  // "loss=1%,burst=4" reads as one thing and is two keys
  }
  std::istringstream stream(words);
  for (std::string word; stream >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) return unreadable("'" + word + "' is not KEY=VALUE");
    const std::string_view key = std::string_view(word).substr(0, equals);
    if (!seen.emplace(key).second) return unreadable("'" + std::string(key) + "' is said twice");
    if (auto why = set(spec, key, std::string_view(word).substr(equals + 1))) return unreadable(*why);
  }
  if (spec.burst > 1 && spec.loss == 0) return unreadable("'burst' needs 'loss'");
  // A burst of mean length b and a mean loss p leave p / (b (1 - p)) as the chance that one begins.
  if (spec.burst > 1 && spec.loss < 1 && spec.loss / (spec.burst * (1 - spec.loss)) > 1)
    return unreadable("so much loss cannot come in bursts so short");
  return spec;
}

std::string to_string(const LinkSpec& spec) {
  std::ostringstream out;
  const auto word = [&](bool is_set, std::string_view key, double value, std::string_view unit) {
    if (is_set) out << (out.tellp() > 0 ? " " : "") << key << "=" << value << unit;
  };
  const auto ms = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-6; };
  word(spec.round_trip_ns > 0, "rtt", ms(spec.round_trip_ns), "ms");
  word(spec.jitter_ns > 0, "jitter", ms(spec.jitter_ns), "ms");
  word(spec.loss > 0, "loss", spec.loss * 100, "%");
  word(spec.loss > 0 && spec.burst > 1, "burst", spec.burst, "");
  word(spec.reorder > 0, "reorder", spec.reorder * 100, "%");
  word(spec.duplicate > 0, "duplicate", spec.duplicate * 100, "%");
  word(spec.rate_bit_per_s > 0, "rate", spec.rate_bit_per_s * 1e-6, "Mbit");
  word(spec.rate_bit_per_s > 0, "queue", ms(spec.queue_ns), "ms");
  word(spec.mtu_bytes > 0, "mtu", static_cast<double>(spec.mtu_bytes), "");
  return out.str();
}

}  // namespace farfeel::transport
