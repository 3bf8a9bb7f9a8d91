#include "deploy/front/link_doctor.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "deploy/front/line_reader.h"
#include "master_station/report/report_page.h"
#include "master_station/report/session_summary.h"
#include "transport/net/datagram.h"
#include "transport/status/status_file.h"

namespace farfeel::front {
namespace {

constexpr double kFelt_ms = 1250, kSoftened_ms = 300;  // beyond: nothing is felt; surfaces that move are felt late
constexpr double kLossy = 0.05;
constexpr double kMostlyTiles = 0.9, kSomeTiles = 0.05;

double share(const master_station::LaneCount& lane) {
  const std::uint64_t told = lane.received + lane.lost;
  return told == 0 ? 0 : static_cast<double>(lane.lost) / static_cast<double>(told);
}

Finding round_trip(const master_station::SessionSummary& s) {
  Finding finding{"round trip", Health::kGood, fmt::format("p50 {:.1f}, p99 {:.1f} ms", s.rtt_ms.p50, s.rtt_ms.p99),
                  ""};
  if (!std::isfinite(s.rtt_ms.p50))
    return {"round trip", Health::kMissing, "no contacts came back", "see that the slave's machine keeps up"};
  if (s.rtt_ms.p50 > kFelt_ms) {
    finding.health = Health::kMissing;
    finding.remedy = fmt::format("beyond {:.0f} ms nothing is felt: take a slave that is nearer", kFelt_ms);
  } else if (s.rtt_ms.p50 > kSoftened_ms) {
    finding.health = Health::kLimited;
    finding.remedy = "what stands still is felt as well as ever; what moves or is edited is felt as late as this";
  }
  return finding;
}

Finding loss(const master_station::SessionSummary& s) {
  const double up = share(s.up), down = share(s.down);
  Finding finding{
      "loss", Health::kGood,
      fmt::format("{:.2f} % of {} poses, {:.2f} % of {} contact sets", 100 * up, s.up.sent, 100 * down, s.down.sent),
      ""};
  if (std::max(up, down) <= kLossy) return finding;
  finding.health = Health::kLimited;
  finding.remedy = "a cable in place of radio, or another way, loses less";
  return finding;
}

Finding packets(const transport::LinkStatus& status) {
  constexpr int kHeaders = 28;  // of IPv4 and UDP
  return {
      "packet size (MTU)", Health::kGood,
      fmt::format("packets of {} bytes pass, which is all that a session sends", status.bulk.longest_bytes + kHeaders),
      ""};
}

Finding marks(const transport::LinkStatus& status) {
  const int haptic = status.haptic.down.dscp, bulk = status.bulk.down.dscp;
  const std::string seen = fmt::format("contacts arrive with DSCP {}, tiles and scene with {}", haptic, bulk);
  if (haptic == static_cast<int>(transport::Dscp::kExpedited)) return {"marks (DSCP)", Health::kGood, seen, ""};
  return {
      "marks (DSCP)", Health::kLimited, seen,
      fmt::format("the slave sends {} and {}: a router on the way changes them, and treats contacts as all else; ask "
                  "who runs it to keep them",
                  static_cast<int>(transport::Dscp::kExpedited), static_cast<int>(transport::Dscp::kLowerEffort))};
}

Finding texture(const master_station::SessionSummary& s) {
  const double tiles = std::isfinite(s.local_model.tiles_share) ? s.local_model.tiles_share : 0;
  const std::string seen = fmt::format(
      "level {}: the surfaces themselves in {:.0f} % of the ticks, {} tiles of {:.0f} kB in {:.0f} s", s.loop.rung,
      100 * tiles, s.local_model.tiles, 1e-3 * static_cast<double>(s.local_model.tile_bytes), s.seconds);
  if (tiles >= kMostlyTiles) return {"texture", Health::kGood, "is felt; " + seen, ""};
  return {
      "texture", Health::kLimited, (tiles > kSomeTiles ? "is felt now and then; " : "is not felt; ") + seen,
      "in the other ticks contacts are felt as the slave sent them (level linear): the link brings heights late, or "
      "this machine's ticks take too long ('farfeel doctor')"};
}

/// A folder that is gone with this.
struct OwnFolder {
  std::string path;
  OwnFolder() {
    std::string name = std::filesystem::temp_directory_path() / "farfeel-doctor-XXXXXX";
    if (mkdtemp(name.data()) != nullptr) path = name;
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  ~OwnFolder() {
    std::error_code ignored;
    if (!path.empty()) std::filesystem::remove_all(path, ignored);
  }
};

/// The newest figures of that master's link.
void look(std::optional<transport::LinkStatus>& newest, pid_t master) {
  const auto folder = transport::link_status_folder();
  if (!folder) return;
  for (transport::LinkStatus& status : transport::read_link_statuses(*folder))
    if (status.pid == master && status.haptic.is_used) newest = std::move(status);
}

}  // namespace

std::vector<Finding> link_findings(const master_station::SessionSummary& s, const transport::LinkStatus& status,
                                   const std::vector<std::string>& mind) {
  std::vector<Finding> findings{round_trip(s), loss(s), packets(status), marks(status), texture(s)};
  for (const std::string& words : mind) findings.push_back({"the link", Health::kLimited, words, ""});
  return findings;
}

tl::expected<std::vector<Finding>, FrontError> examine_link(const LinkWishes& wishes) {
  const auto program = sibling("farfeel-master");
  if (!program) return tl::unexpected(program.error());
  const OwnFolder folder;
  if (folder.path.empty())
    return tl::unexpected(FrontError{"could not make a folder below the one for temporary files"});
  std::vector<std::string> arguments = {
      "--connect", wishes.to,   "--device",   "simulated", "--seconds", fmt::format("{}", wishes.seconds),
      "--out",     folder.path, "--progress", "machine",   "--no-view"};
  arguments.insert(arguments.end(), wishes.to_master.begin(), wishes.to_master.end());
  auto master = Child::start(*program, arguments, folder.path + "/master.log", Child::Output::kIsRead, false);
  if (!master) return tl::unexpected(master.error());
  std::optional<transport::LinkStatus> status;
  std::vector<std::string> mind;
  LineReader lines;
  bool has_output = true;
  while (!master->status()) {
    std::array<pollfd, 2> wait{pollfd{has_output ? master->output_fd() : -1, POLLIN, 0},
                               {master->ended_fd(), POLLIN, 0}};
    poll(wait.data(), wait.size(), 250);
    if (wait[0].revents != 0)
      has_output = lines.read_lines(master->output_fd(), [&](std::string_view line) {
        constexpr std::string_view kNote = "note: ";
        if (line.starts_with(kNote)) mind.emplace_back(line.substr(kNote.size()));
      });
    look(status, master->pid());
  }
  if (*master->status() != 0) return tl::unexpected(FrontError{master->obituary()});
  const auto summary = master_station::read_summary(folder.path);
  if (!summary) return tl::unexpected(FrontError{summary.error().message});
  if (!status) return tl::unexpected(FrontError{"the session told nothing of its link; try it for longer (--seconds)"});
  return link_findings(*summary, *status, mind);
}

}  // namespace farfeel::front
