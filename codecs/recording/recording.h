// A recording: everything that came into a session's ticks and answers, and a hash of what came out, as a file.
//
// The format knows no haptics. A recording holds settings by name, the hashes of the assets that it needs, and streams;
// a stream is one record after another: numbers that its head names, messages as they came, and the outcome. Whoever
// records says what the numbers are; see master_station/recording and slave_sim/recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/recording/numbers.h"
#include "codecs/recording/outcome.h"

namespace farfeel::codecs {

// Bounds of the format: the writer refuses to exceed them, the reader refuses them before it allocates.
inline constexpr std::size_t kMostNames = 4096;  ///< of settings, of a stream's inputs and outputs
inline constexpr std::size_t kMostNameBytes = 200, kMostAssets = 16, kMostStreams = 16;
inline constexpr std::size_t kMostRecords = 1 << 20;
inline constexpr std::size_t kMostMessages = 4096, kMostMessageBytes = 4096;  ///< of a record
inline constexpr std::size_t kMostValues = 4096;                              ///< of an output

struct RecordedMessage {
  std::uint8_t kind = 0;  ///< the stream's recorder knows
  std::vector<std::byte> bytes;
  friend bool operator==(const RecordedMessage&, const RecordedMessage&) = default;
};

struct Record {
  std::vector<double> inputs;  ///< one a name
  std::vector<RecordedMessage> messages;
  Outcome outcome;
  friend bool operator==(const Record&, const Record&) = default;
};

struct Stream {
  std::string name;
  std::vector<std::string> inputs, outputs;
  std::vector<Record> records;
  friend bool operator==(const Stream&, const Stream&) = default;
};

struct Recording {
  std::string title;
  /// Where the same bits may be expected: compiler, libraries, kernels.
  std::string made_with;
  bool has_values = false;  ///< outcomes hold the outputs' values
  Numbers settings;
  std::vector<std::uint64_t> assets;
  std::vector<Stream> streams;

  /// Null: there is none of that name.
  [[nodiscard]] const Stream* find(std::string_view name) const;
  friend bool operator==(const Recording&, const Recording&) = default;
};

/// Fails on what is out of bounds, and on records that do not fit their stream's head.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> write_recording(const Recording&);
/// For bytes from anybody: bounds are checked before anything is allocated.
[[nodiscard]] tl::expected<Recording, std::string> read_recording(std::span<const std::byte>);

}  // namespace farfeel::codecs
