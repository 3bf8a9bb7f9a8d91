#include "slave_sim/living/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::array kMagic{std::byte{'F'}, std::byte{'F'}, std::byte{'E'}, std::byte{'D'},
                            std::byte{'I'}, std::byte{'T'}, std::byte{'S'}, std::byte{'1'}};
constexpr std::size_t kHeadBytes = kMagic.size() + sizeof(transport::ObjectHash), kCheckBytes = 8;
constexpr std::size_t kBeforeEntry = 4 + kCheckBytes, kBeforeRequest = sizeof(transport::Key32) + 4;

std::span<const std::byte> checked_part(const transport::ObjectHash& hash) {
  return std::span(hash).first(kCheckBytes);
}

/// The entry at the beginning of the bytes, which lose it; nothing where there is none that is whole.
std::optional<JournalEntry> take_entry(std::span<const std::byte>& bytes) {
  transport::ByteReader r(bytes);
  const std::uint32_t size = r.u32();
  const auto check = r.bytes(kCheckBytes), entry = r.bytes(size);
  if (!r.ok() || size < kBeforeRequest || !std::ranges::equal(check, checked_part(transport::hash_of(entry))))
    return std::nullopt;
  transport::ByteReader in(entry);
  JournalEntry read;
  std::ranges::copy(in.bytes(read.key.size()), read.key.begin());
  read.version = in.u32();
  auto request = codecs::read_edit_request(entry.subspan(kBeforeRequest));
  if (!request) return std::nullopt;
  read.request = *std::move(request);
  bytes = bytes.subspan(kBeforeEntry + size);
  return read;
}

std::vector<std::byte> bytes_of(const JournalEntry& entry) {
  std::vector<std::byte> all(kBeforeEntry + kBeforeRequest + codecs::kMostEditBytes);
  transport::ByteWriter in{std::span(all).subspan(kBeforeEntry)};
  in.bytes(entry.key);
  in.u32(entry.version);
  const std::size_t size =
      kBeforeRequest + codecs::write(entry.request, std::span(all).subspan(kBeforeEntry + kBeforeRequest));
  all.resize(kBeforeEntry + size);
  transport::ByteWriter w(all);
  w.u32(static_cast<std::uint32_t>(size));
  w.bytes(checked_part(transport::hash_of(std::span(all).subspan(kBeforeEntry))));
  return all;
}

std::array<std::byte, kHeadBytes> head_of(const transport::ObjectHash& scene) {
  std::array<std::byte, kHeadBytes> head;
  std::ranges::copy(scene, std::ranges::copy(kMagic, head.begin()).out);
  return head;
}

}  // namespace

std::optional<JournalRead> read_journal(std::span<const std::byte> bytes, const transport::ObjectHash& scene) {
  if (bytes.size() < kHeadBytes || !std::ranges::equal(bytes.first(kHeadBytes), head_of(scene))) return std::nullopt;
  JournalRead read;
  std::span<const std::byte> rest = bytes.subspan(kHeadBytes);
  while (auto entry = take_entry(rest)) read.entries.push_back(*std::move(entry));
  read.good_bytes = bytes.size() - rest.size();
  return read;
}

tl::expected<std::unique_ptr<Journal>, std::string> Journal::open(const std::string& folder) {
  const auto failed = [&](const std::string& what) {
    return tl::unexpected(fmt::format("the scene's changes cannot be kept in {}: {}", folder, what));
  };
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string path = folder + "/edits";
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (descriptor < 0) return failed(std::strerror(errno));
  const auto give_up = [&](const std::string& what) {
    ::close(descriptor);
    return failed(what);
  };
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0)
    return give_up("another slave has it: give each a folder of its own");
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) return give_up("'edits' is no file");
  if (static_cast<std::uint64_t>(status.st_size) > kMostBytes)
    return give_up(fmt::format("'edits' is larger than {} MiB", kMostBytes >> 20));
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t got = ::pread(descriptor, bytes.data() + at, bytes.size() - at, static_cast<off_t>(at));
    if (got <= 0) return give_up(got < 0 ? std::strerror(errno) : "'edits' grew shorter while it was read");
    at += static_cast<std::size_t>(got);
  }
  // The folder has to know of a file that is new.
  if (const int parent = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); parent >= 0) {
    (void)::fsync(parent);
    ::close(parent);
  }
  return std::unique_ptr<Journal>(new Journal(descriptor, path, std::move(bytes)));
}

Journal::Journal(int descriptor, std::string path, std::vector<std::byte> bytes)
    : descriptor_(descriptor), path_(std::move(path)), found_(std::move(bytes)) {}

Journal::~Journal() {
  thread_ = {};  // writes what waits
  ::close(descriptor_);
}

tl::expected<std::vector<JournalEntry>, std::string> Journal::begin(
    const transport::ObjectHash& scene, std::function<void(const std::string&)> on_trouble) {
  on_trouble_ = std::move(on_trouble);
  std::vector<JournalEntry> entries;
  if (found_.size() < kHeadBytes) {  // new, or killed while it was made
    if (!write_all(head_of(scene))) return tl::unexpected(fmt::format("{}: {}", path_, std::strerror(errno)));
    end_ = kHeadBytes;
  } else if (auto read = read_journal(found_, scene)) {
    entries = std::move(read->entries);
    end_ = read->good_bytes;
    torn_bytes_ = found_.size() - end_;
  } else {
    return tl::unexpected(path_ +
                          " holds the edits of another scene, or of this one as it was before its file or an asset "
                          "changed: give this one a folder of its own");
  }
  found_ = {};
  if (torn_bytes_ > 0 && ::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0)
    return tl::unexpected(fmt::format("{}: {}", path_, std::strerror(errno)));
  if (!entries.empty()) durable_.store(entries.back().version, std::memory_order_release);
  thread_ = std::jthread([this](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "journal");
    run(stop);
  });
  return entries;
}

bool Journal::write_all(std::span<const std::byte> bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data() + at, bytes.size() - at, static_cast<off_t>(end_ + at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    at += static_cast<std::size_t>(written);
  }
  return ::fdatasync(descriptor_) == 0;
}

void Journal::append(const JournalEntry& entry) {
  const std::vector<std::byte> bytes = bytes_of(entry);
  const std::lock_guard lock(mutex_);
  if (is_lost_) return;
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  waiting_version_ = entry.version;
  came_.notify_one();
}

void Journal::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (came_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
    const std::vector<std::byte> group = std::exchange(waiting_, {});
    const std::uint32_t version = waiting_version_;
    lock.unlock();
    errno = EFBIG;
    const bool is_kept = end_ + group.size() <= kMostBytes && write_all(group);
    const int why = errno;
    if (is_kept) {
      end_ += group.size();
      durable_.store(version, std::memory_order_release);
    } else {
      on_trouble_(fmt::format("changes of the scene are not kept any more, from version {} on: {}: {}",
                              durable_version() + 1, path_, std::strerror(why)));
    }
    lock.lock();
    if (!is_kept) {  // what comes later would build on what is not there
      is_lost_ = true;
      waiting_.clear();
    }
  }
}

}  // namespace farfeel::slave_sim
