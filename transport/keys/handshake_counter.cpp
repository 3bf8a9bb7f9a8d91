#include "transport/keys/handshake_counter.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "transport/keys/checked_file.h"

namespace farfeel::transport {
namespace {

using Word = std::uint64_t;
using Shared = std::atomic_ref<Word>;
// Programs share the words by their addresses in a file: a lock hidden in the atomic would be each program's own.
static_assert(Shared::is_always_lock_free);

constexpr std::array<char, 8> kMagic = {'f', 'f', 'c', 'o', 'u', 'n', 't', '1'};
constexpr std::size_t kFileBytes = 64;
// Beyond the year 2262 no clock of 63 bits gets: a file that says more is broken.
constexpr Word kSaneMax = Word{1} << 63;

tl::unexpected<KeysError> system_error(std::string_view what, const std::string& path) {
  return tl::unexpected(
      KeysError{KeysErrorKind::kSystem, fmt::format("could not {} {}: {}", what, path, std::strerror(errno))});
}

// The first 16 of the hexadecimal digits that Linux draws at each start; 0, which no file agrees with, if unknown.
Word this_boot() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string text, digits;
  file >> text;
  for (const char c : text)
    if (c != '-' && digits.size() < 16) digits += c;
  if (digits.size() != 16 || digits.find_first_not_of("0123456789abcdef") != std::string::npos) return 0;
  return std::stoull(digits, nullptr, 16);
}

std::string fresh_file() {
  std::string text(kFileBytes, '\0');
  std::ranges::copy(kMagic, text.begin());
  return text;
}

// Raises a word to at least a value, whoever else does so at the same time.
void raise(Word& word, Word to) noexcept {
  Shared shared(word);
  Word now = shared.load();
  while (now < to && !shared.compare_exchange_weak(now, to)) {
  }
}

}  // namespace

struct HandshakeCounter::Words {
  std::array<char, 8> magic;
  Word boot, last, ceiling, ceiling_on_disk;
  std::array<Word, 3> zeros;
};

KeysResult<HandshakeCounter> HandshakeCounter::open(const std::string& path) {
  return open(path, this_boot());
}

KeysResult<HandshakeCounter> HandshakeCounter::open(const std::string& path, std::uint64_t boot) {
  static_assert(sizeof(Words) == kFileBytes);
  const auto lock = FolderLock::take(std::filesystem::path(path).parent_path().string());
  if (!lock) return tl::unexpected(lock.error());
  auto text = read_private_file(path);
  if (!text && text.error().kind == KeysErrorKind::kMissing) {
    if (const auto written = write_private_file(path, fresh_file()); !written) return tl::unexpected(written.error());
    text = fresh_file();
  }
  if (!text) return tl::unexpected(text.error());

  Words found{};
  if (text->size() == kFileBytes) std::memcpy(&found, text->data(), kFileBytes);
  if (found.magic != kMagic || found.last >= kSaneMax || found.ceiling >= kSaneMax)
    return tl::unexpected(KeysError{
        KeysErrorKind::kMalformed,
        fmt::format("{0} is no handshake counter, or it is broken. If this machine's clock is right, run:  rm '{0}'",
                    path)});

  const int fd = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) return system_error("open", path);
  void* at = mmap(nullptr, kFileBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  const int code = errno;
  close(fd);
  errno = code;
  if (at == MAP_FAILED) return system_error("map", path);
  HandshakeCounter counter(static_cast<Words*>(at));
  // Whoever runs since this start of the machine has said so: the numbers are those that were given. Otherwise some may
  // have been lost, and all of them were below the ceiling. Under the lock, so that nobody gives numbers meanwhile.
  if (boot == 0 || Shared(counter.words_->boot).load() != boot) {
    raise(counter.words_->last, Shared(counter.words_->ceiling).load());
    Shared(counter.words_->boot).store(boot);
  }
  return counter;
}

HandshakeCounter::HandshakeCounter(HandshakeCounter&& other) noexcept : words_(std::exchange(other.words_, nullptr)) {}

HandshakeCounter::~HandshakeCounter() {
  if (words_ != nullptr) munmap(words_, kFileBytes);
}

bool HandshakeCounter::raise_ceiling(std::uint64_t to) noexcept {
  raise(words_->ceiling, to);
  // What is on the disk afterwards is at least what stands here now, whoever raised it.
  const Word ceiling = Shared(words_->ceiling).load();
  const bool is_on_disk = msync(words_, kFileBytes, MS_SYNC) == 0;
  if (is_on_disk) raise(words_->ceiling_on_disk, ceiling);
  return is_on_disk;
}

std::uint64_t HandshakeCounter::next(std::int64_t wall_clock_ns) noexcept {
  const Word clock = wall_clock_ns > 0 ? static_cast<Word>(wall_clock_ns) : 0;
  Shared last(words_->last);
  Word before = last.load(), number = 0;
  do {
    number = std::max(clock, before + 1);
  } while (!last.compare_exchange_weak(before, number));
  if (number > Shared(words_->ceiling_on_disk).load()) (void)raise_ceiling(number + kAhead_ns);
  return number;
}

bool HandshakeCounter::keep_ahead(std::int64_t wall_clock_ns) noexcept {
  const Word clock = wall_clock_ns > 0 ? static_cast<Word>(wall_clock_ns) : 0;
  const Word soon = std::max(clock, Shared(words_->last).load());
  if (soon + kNear_ns < Shared(words_->ceiling_on_disk).load()) return true;
  return raise_ceiling(soon + kAhead_ns);
}

}  // namespace farfeel::transport
