#include "master_station/report/run_folder.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "master_station/report/report_page.h"

namespace farfeel::master_station {
namespace {

constexpr const char* kLinkLog = "link.log";  // of farfeel loopback, where there was a link

tl::unexpected<ReportError> not_made(const std::string& path, int error) {
  return tl::unexpected(
      ReportError{fmt::format("can't make the folder {}: {}; choose another with --out", path, std::strerror(error))});
}

}  // namespace

tl::expected<RunFolder, ReportError> RunFolder::take(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return not_made(path, error.value());
  const int lock = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock < 0) return not_made(path, errno);
  if (::flock(lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return RunFolder(path, lock);
  ::close(lock);
  return tl::unexpected(ReportError{fmt::format(
      "another session that runs now writes into {}: wait for its end, or choose another folder with --out", path)});
}

tl::expected<RunFolder, ReportError> RunFolder::make_new(const std::string& above) {
  std::error_code error;
  std::filesystem::create_directories(above, error);
  if (error) return not_made(above, error.value());
  const std::string time = fmt::format("{:%Y-%m-%d_%H-%M-%S}", fmt::localtime(std::time(nullptr)));
  for (int again = 1;; ++again) {
    const std::string name = again == 1 ? time : fmt::format("{}_{}", time, again);
    const std::string path = above + "/" + name;
    if (::mkdir(path.c_str(), 0777) == 0) {
      auto made = take(path);
      if (made) made->above_ = above;
      return made;
    }
    if (errno != EEXIST) return not_made(path, errno);
  }
}

tl::expected<RunFolder, ReportError> RunFolder::of(const std::string& named, const std::string& above) {
  return named.empty() ? make_new(above) : take(named);
}

RunFolder::~RunFolder() {
  if (lock_ < 0) return;
  if (!above_.empty()) ::rmdir(path_.c_str());  // only where it is empty
  ::close(lock_);
}

void RunFolder::begin() const {
  std::error_code ignored;
  for (const char* name : {kSummaryFile, kCsvFile, kReportFile, kScenePicture, kContactsPicture, kNoPicture, kLinkLog})
    std::filesystem::remove(path_ + "/" + name, ignored);
  if (above_.empty()) return;
  // By way of another name, so that `latest` always points to some run. A folder that somebody made of that name stays.
  const std::string beside = fmt::format("{}/.{}.{}", above_, kLatestRun, ::getpid());
  const std::string run = std::filesystem::path(path_).filename();
  if (::symlink(run.c_str(), beside.c_str()) != 0) return;
  if (::rename(beside.c_str(), fmt::format("{}/{}", above_, kLatestRun).c_str()) != 0) ::unlink(beside.c_str());
}

}  // namespace farfeel::master_station
