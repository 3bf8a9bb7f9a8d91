// The edits of a scene on a disk, so that a node that was killed makes them again.
//
//   8 bytes "FFEDITS1", 32 bytes: which scene they are of; then entries:
//   u32 length of what follows, 8 bytes of its hash; 32 bytes key, u32 version, an edit request as on the wire
//
// Entries are appended by a thread of its own, and counted as durable once the disk has them. What a crash left half
// written at the end is left out at the next start.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/wire/edit_messages.h"
#include "transport/bulk/object.h"
#include "transport/seal/suite.h"

namespace farfeel::slave_sim {

/// An edit that was made.
struct JournalEntry {
  transport::Key32 key{};     ///< who asked for it; zeros: the timeline, of which it is the edit of that number, from 1
  std::uint32_t version = 0;  ///< of the scene that has it
  codecs::EditRequest request;
};

/// What stands in such a file.
struct JournalRead {
  std::vector<JournalEntry> entries;
  std::uint64_t good_bytes = 0;  ///< from the beginning; what follows is no entry
};
/// Of anybody's bytes, at most Journal::kMostBytes. Nothing where they do not begin as the file of that scene does.
[[nodiscard]] std::optional<JournalRead> read_journal(std::span<const std::byte>, const transport::ObjectHash& scene);

class Journal {
 public:
  static constexpr std::uint64_t kMostBytes = 64u << 20;

  /// Opens the folder's file, or makes both; nobody else may have it open. Reads what is in it.
  [[nodiscard]] static tl::expected<std::unique_ptr<Journal>, std::string> open(const std::string& folder);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// The edits to be made again, in their order, of a scene with that hash. Fails where the file is of another one.
  /// After it entries are appended. on_trouble: told once by the journal's thread, where the disk takes no more.
  [[nodiscard]] tl::expected<std::vector<JournalEntry>, std::string> begin(
      const transport::ObjectHash& scene, std::function<void(const std::string&)> on_trouble);
  /// One thread.
  void append(const JournalEntry&);
  /// All edits to this version are on the disk. Any thread.
  [[nodiscard]] std::uint32_t durable_version() const { return durable_.load(std::memory_order_acquire); }
  /// Bytes at the end of the file that were no entry, and are left out.
  [[nodiscard]] std::uint64_t torn_bytes() const { return torn_bytes_; }

 private:
  Journal(int descriptor, std::string path, std::vector<std::byte> bytes);
  void run(const std::stop_token&);
  [[nodiscard]] bool write_all(std::span<const std::byte>);

  int descriptor_;
  std::string path_;
  std::vector<std::byte> found_;  // until begin()
  std::uint64_t end_ = 0;         // of what is good in the file
  std::uint64_t torn_bytes_ = 0;
  std::function<void(const std::string&)> on_trouble_;
  std::atomic<std::uint32_t> durable_{0};

  std::mutex mutex_;
  std::condition_variable_any came_;
  std::vector<std::byte> waiting_;  // entries, as they are written
  std::uint32_t waiting_version_ = 0;
  bool is_lost_ = false;  // the disk took no more
  std::jthread thread_;
};

}  // namespace farfeel::slave_sim
