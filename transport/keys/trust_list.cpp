#include "transport/keys/trust_list.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>

#include "transport/keys/checked_file.h"

namespace farfeel::transport {
namespace {

// A file's times are of the kernel's coarse clock. Two changes within a few milliseconds can bear the same one, so a
// file that was changed so recently is read again at the next look.
constexpr std::int64_t kCoarse_ns = 1'000'000'000;

std::int64_t nanoseconds(const timespec& t) {
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + static_cast<std::int64_t>(t.tv_nsec);
}

std::int64_t wall_clock_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return nanoseconds(now);
}

}  // namespace

TrustList::Look TrustList::look() const noexcept {
  struct stat s {};
  if (stat(path_.c_str(), &s) != 0) return {};
  return {true, s.st_ino, s.st_dev, s.st_size, nanoseconds(s.st_mtim), nanoseconds(s.st_ctim)};
}

KeysResult<TrustEntries> TrustList::read() const {
  auto text = read_private_file(path_);
  if (!text && text.error().kind == KeysErrorKind::kMissing) return TrustEntries{};
  if (!text) return tl::unexpected(text.error());
  TrustEntries read = read_trust_text(*text);
  wipe(std::as_writable_bytes(std::span(*text)));
  if (!read.trouble.empty()) read.trouble = fmt::format("{}, {}: mend or remove that line", path_, read.trouble);
  return read;
}

KeysResult<TrustList> TrustList::open(std::string path) {
  TrustList list(std::move(path));
  list.seen_ = list.look();
  auto read = list.read();
  if (!read) return tl::unexpected(read.error());
  if (!read->trouble.empty()) return tl::unexpected(KeysError{KeysErrorKind::kMalformed, read->trouble});
  list.entries_ = std::move(read->entries);
  return list;
}

TrustList::Found TrustList::find(const Key32& public_key, std::int64_t now_ns) const noexcept {
  for (const TrustEntry& entry : entries_)
    if (entry.public_key == public_key)
      return {entry.is_expired(now_ns) ? Standing::kExpired : Standing::kTrusted, &entry};
  return {};
}

const TrustEntry* TrustList::find_name(std::string_view name) const noexcept {
  const auto at = std::ranges::find(entries_, name, &TrustEntry::name);
  return at == entries_.end() ? nullptr : &*at;
}

bool TrustList::refresh() {
  const Look now = look();
  if (now == seen_ && is_sure_) return false;
  const std::int64_t age_ns = wall_clock_ns() - now.changed_ns;
  is_sure_ = !now.is_there || age_ns < 0 || age_ns > kCoarse_ns;
  seen_ = now;
  auto fresh = read();
  if (!fresh) {
    // Nothing is known of the file's lines: who was trusted stays, nobody is added, and the next look tries again.
    is_sure_ = false;
    const bool is_news = trouble_ != fresh.error().message;
    trouble_ = fresh.error().message;
    return is_news;
  }
  if (!fresh->trouble.empty()) {
    std::erase_if(fresh->entries, [&](const TrustEntry& entry) {
      return std::ranges::none_of(entries_, [&](const TrustEntry& old) {
        return old.name == entry.name && old.public_key == entry.public_key;
      });
    });
  }
  entries_ = std::move(fresh->entries);
  trouble_ = std::move(fresh->trouble);
  return true;
}

}  // namespace farfeel::transport
