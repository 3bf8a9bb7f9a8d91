#include "transport/status/status_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "transport/keys/checked_file.h"

namespace farfeel::transport {
namespace {

using nlohmann::json;

constexpr std::size_t kFileBytes = 8192;  // a status is of 4 kB

// Each struct once, for both ways: visit(name, field).
template <class Visit>
void fields(Visit&& visit, DelayStatus& s) {
  visit("p50_ms", s.p50_ms), visit("p99_ms", s.p99_ms), visit("max_ms", s.most_ms), visit("samples", s.samples);
  visit("least_ms", s.least_ms);
}
template <class Visit>
void fields(Visit&& visit, DirectionStatus& s) {
  visit("sent", s.sent), visit("arrived", s.arrived);
  visit("sent_bytes", s.sent_bytes), visit("arrived_bytes", s.arrived_bytes);
  visit("lost", s.lost), visit("bursts", s.bursts), visit("longest_burst", s.longest_burst);
  visit("late", s.late), visit("duplicate", s.duplicate);
  visit("malformed", s.malformed), visit("unknown_keys", s.unknown_keys), visit("forged", s.forged);
  visit("unusable", s.unusable), visit("congestion_marks", s.congestion_marks), visit("dscp", s.dscp);
  visit("one_way_excess", s.one_way_excess), visit("jitter_ms", s.jitter_ms);
}
template <class Visit>
void fields(Visit&& visit, LaneStatus& s) {
  visit("is_used", s.is_used), visit("silent_ms", s.silent_ms);
  visit("round_trip", s.round_trip), visit("peer_waiting", s.peer_waiting);
  visit("up", s.up), visit("down", s.down), visit("rekeys", s.rekeys), visit("migrations", s.migrations);
  visit("longest_bytes", s.longest_bytes);
}
template <class Visit>
void fields(Visit&& visit, BulkStatus& s) {
  visit("least_round_trip_ms", s.least_round_trip_ms), visit("delivered_mbit", s.delivered_mbit),
      visit("queue_ms", s.queue_ms), visit("message_bytes", s.message_bytes);
}
template <class Visit>
void fields(Visit&& visit, HandshakeStatus& s) {
  visit("initiations", s.initiations), visit("answered", s.answered), visit("cookies", s.cookies);
  visit("refused", s.refused), visit("dropped", s.dropped);
}
template <class Visit>
void fields(Visit&& visit, LinkStatus& s) {
  visit("role", s.role), visit("pid", s.pid), visit("uptime_s", s.uptime_s), visit("local", s.local);
  visit("peer", s.peer), visit("peer_name", s.peer_name), visit("cipher", s.cipher), visit("trouble", s.trouble);
  visit("sessions", s.sessions), visit("haptic", s.haptic), visit("bulk", s.bulk), visit("bulk_pace", s.bulk_pace);
  visit("handshakes", s.handshakes);
}

template <class T>
constexpr bool kIsStruct = std::is_class_v<T> && !std::is_same_v<T, std::string>;

template <class T>
json written(T value) {
  if constexpr (kIsStruct<T>) {
    json out;
    fields([&](const char* name, auto& field) { out[name] = written(field); }, value);
    return out;
  } else if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value) ? json(value) : json();
  } else {
    return value;
  }
}

template <class T>
void read(const json& from, T& value) {
  if constexpr (kIsStruct<T>) {
    fields([&](const char* name, auto& field) { read(from.at(name), field); }, value);
  } else if constexpr (std::is_floating_point_v<T>) {
    value = from.is_null() ? kUnmeasured : from.get<T>();
  } else {
    value = from.get<T>();
  }
}

}  // namespace

std::string to_json(const LinkStatus& status) {
  return written(status).dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

tl::expected<LinkStatus, Error> link_status_from_json(std::string_view text) {
  LinkStatus status;
  try {
    read(json::parse(text), status);
  } catch (const json::exception& error) {
    return tl::unexpected(Error{ErrorKind::kProtocol, fmt::format("no link status: {}", error.what())});
  }
  return status;
}

tl::expected<std::string, Error> link_status_folder() {
  const auto folder = make_runtime_folder("links");
  if (!folder) return tl::unexpected(Error{ErrorKind::kSocket, folder.error().message});
  return *folder;
}

tl::expected<StatusFile, Error> StatusFile::open(const std::string& folder) {
  (void)read_link_statuses(folder);  // sweeps
  const std::string path = fmt::format("{}/{}.json", folder, getpid());
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return tl::unexpected(Error{ErrorKind::kSocket, fmt::format("{}: {}", path, std::strerror(errno))});
  return StatusFile(fd);
}

tl::expected<StatusFile, Error> open_status_file() {
  const auto folder = link_status_folder();
  if (!folder) return tl::unexpected(folder.error());
  return StatusFile::open(*folder);
}

StatusFile::~StatusFile() {
  if (fd_ >= 0) close(fd_);
}

// Always of one length, so that one call replaces all of it.
void StatusFile::write(const LinkStatus& status) const noexcept {
  try {
    LinkStatus told = status;
    told.pid = getpid();
    std::string text = to_json(told);
    if (text.size() > kFileBytes) return;
    text.resize(kFileBytes, ' ');
    (void)!pwrite(fd_, text.data(), text.size(), 0);
  } catch (const std::exception&) {  // no memory: the next one may do
  }
}

namespace {

// A file that is being written may be read as half of each: then once more.
std::optional<LinkStatus> read_file(const std::filesystem::path& path) {
  for (int i = 0; i < 3; ++i) {
    std::string text(kFileBytes, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (auto status = link_status_from_json(text)) return *std::move(status);
  }
  return std::nullopt;
}

bool is_alive(const std::string& number) {
  int pid = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), pid);
  return error != std::errc{} || end != number.data() + number.size() || pid <= 0 || kill(pid, 0) == 0 ||
         errno != ESRCH;
}

}  // namespace

std::vector<LinkStatus> read_link_statuses(const std::string& folder) {
  std::vector<LinkStatus> all;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() != ".json") continue;
    if (!is_alive(entry.path().stem())) {
      unlink(entry.path().c_str());
      continue;
    }
    auto status = read_file(entry.path());
    struct stat s {};
    if (!status || stat(entry.path().c_str(), &s) != 0) continue;
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    status->age_s = static_cast<double>(now.tv_sec - s.st_mtim.tv_sec) +
                    1e-9 * static_cast<double>(now.tv_nsec - s.st_mtim.tv_nsec);
    all.push_back(std::move(*status));
  }
  std::sort(all.begin(), all.end(), [](const LinkStatus& a, const LinkStatus& b) { return a.pid < b.pid; });
  return all;
}

}  // namespace farfeel::transport
