// The bytes, little-endian:
//   u32 "FFRC", u16 version 1, u8 has_values, u8 0, text title, text made_with, names, f64 each (the settings),
//   u32 count and u64 each (the assets), u32 streams, each: text name, names of inputs, names of outputs, u32 records;
//   then, to the end, the records, packed. text: u16 length, bytes. names: u32 count, text each.
//
// Packed, each byte is told bit by bit from the highest on, with a model for each bit after the bits before it
// (codecs/tile/range_coder.h). A number is told as its bits, changed where those of the number at the same place in the
// record before were set: what goes on as it was is zeros, which are all but free. Hashes are told as they are.
#include "codecs/recording/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "codecs/tile/range_coder.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using transport::ByteReader;

constexpr std::uint32_t kMagic = 0x4352'4646;  // "FFRC"
constexpr std::uint16_t kVersion = 1;
/// The surest bit costs 1 / 355 of itself: what asks for more than that was not written here.
constexpr std::size_t kMostUnpacked = 400, kUnpackedAtLeast = 4096;

tl::unexpected<std::string> wrong(const std::string& why) {
  return tl::unexpected("the recording: " + why);
}

/// Models of one byte's bits, each after the bits before it.
using ByteModels = std::array<BitModel, 256>;

/// Of one number in a record: what it was in the record before, and the models of its eight bytes.
struct Column {
  std::uint64_t before = 0;
  std::array<ByteModels, 8> models;
};

class Packer {
 public:
  explicit Packer(std::vector<std::byte>& to) : to_(to) {}
  void byte(std::uint8_t& value, ByteModels& models) {
    std::size_t node = 1;
    for (int bit = 7; bit >= 0; --bit) {
      const bool is_set = (value >> bit & 1) != 0;
      to_.bit(is_set, models[node]);
      node = 2 * node + (is_set ? 1 : 0);
    }
  }
  void even(std::uint64_t& value, int bits) {
    for (int bit = bits - 1; bit >= 0; --bit) to_.even_bit((value >> bit & 1) != 0);
  }
  [[nodiscard]] static bool may_take(std::size_t /*bytes*/) { return true; }
  void finish() { to_.finish(); }

 private:
  RangeEncoder to_;
};

class Unpacker {
 public:
  explicit Unpacker(std::span<const std::byte> from)
      : from_(from), left_(kMostUnpacked * from.size() + kUnpackedAtLeast) {}
  void byte(std::uint8_t& value, ByteModels& models) {
    std::size_t node = 1;
    for (int bit = 0; bit < 8; ++bit) node = 2 * node + (from_.bit(models[node]) ? 1 : 0);
    value = static_cast<std::uint8_t>(node);
  }
  void even(std::uint64_t& value, int bits) {
    value = 0;
    for (int bit = 0; bit < bits; ++bit) value = value << 1 | (from_.even_bit() ? 1U : 0U);
  }
  /// Whether there can be so many more; to be asked before they are made room for.
  [[nodiscard]] bool may_take(std::size_t bytes) {
    if (bytes > left_) return false;
    left_ -= bytes;
    return true;
  }
  [[nodiscard]] bool is_whole() const { return from_.is_whole(); }

 private:
  RangeDecoder from_;
  std::size_t left_;
};

/// A stream's records, the same way written and read: Coder is one of the above.
template <typename Coder>
class RecordCoder {
 public:
  RecordCoder(Coder& coder, const Stream& head, bool has_values) : coder_(coder), head_(head) {
    inputs_.resize(head.inputs.size());
    values_.resize(has_values ? head.outputs.size() : 0);
  }

  /// False: out of bounds.
  [[nodiscard]] bool code(Record& record) {
    if (!resize(record.inputs, head_.inputs.size())) return false;
    for (std::size_t i = 0; i < inputs_.size(); ++i) number(record.inputs[i], inputs_[i]);
    if (!count(record.messages, kMostMessages, counts_[0])) return false;
    for (RecordedMessage& message : record.messages) {
      coder_.byte(message.kind, kinds_);
      if (!count(message.bytes, kMostMessageBytes, counts_[1])) return false;
      for (std::size_t i = 0; i < message.bytes.size(); ++i) {
        auto byte = std::to_integer<std::uint8_t>(message.bytes[i]);
        coder_.byte(byte, places_[message.kind % 2][std::min(i, kPlaces - 1)]);
        message.bytes[i] = std::byte{byte};
      }
    }
    Outcome& outcome = record.outcome;
    coder_.even(outcome.hash, 64);
    if (!resize(outcome.marks, head_.outputs.size())) return false;
    for (std::uint16_t& mark : outcome.marks) {
      std::uint64_t bits = mark;
      coder_.even(bits, 16);
      mark = static_cast<std::uint16_t>(bits);
    }
    if (!resize(outcome.values, values_.size())) return false;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (!count(outcome.values[i], kMostValues, counts_[2])) return false;
      for (double& value : outcome.values[i]) number(value, values_[i]);
    }
    return true;
  }

 private:
  static constexpr std::size_t kPlaces = 64;  // of a message's first bytes, each with models of its own

  void number(double& value, Column& column) {
    std::uint64_t bits = std::bit_cast<std::uint64_t>(value) ^ column.before;
    for (int k = 7; k >= 0; --k) {
      auto byte = static_cast<std::uint8_t>(bits >> 8 * k);
      coder_.byte(byte, column.models[static_cast<std::size_t>(k)]);
      bits = (bits & ~(std::uint64_t{0xFF} << 8 * k)) | std::uint64_t{byte} << 8 * k;
    }
    column.before ^= bits;
    value = std::bit_cast<double>(column.before);
  }
  template <typename T>
  [[nodiscard]] bool resize(std::vector<T>& list, std::size_t size) {
    if (!coder_.may_take(size * sizeof(T))) return false;
    list.resize(size);
    return true;
  }
  template <typename T>
  [[nodiscard]] bool count(std::vector<T>& list, std::size_t most, std::array<ByteModels, 2>& models) {
    auto high = static_cast<std::uint8_t>(list.size() >> 8), low = static_cast<std::uint8_t>(list.size());
    coder_.byte(high, models[0]), coder_.byte(low, models[1]);
    const std::size_t size = std::size_t{high} << 8 | low;
    return size <= most && resize(list, size);
  }

  Coder& coder_;
  const Stream& head_;
  std::vector<Column> inputs_, values_;
  std::array<std::array<ByteModels, 2>, 3> counts_;
  ByteModels kinds_;
  std::array<std::array<ByteModels, kPlaces>, 2> places_;
};

// The head.

class HeadWriter {
 public:
  template <typename T>
  void put(T value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    to.insert(to.end(), bytes.begin(), bytes.end());
  }
  void text(const std::string& text) {
    put(static_cast<std::uint16_t>(text.size()));
    const auto bytes = std::as_bytes(std::span(text));
    to.insert(to.end(), bytes.begin(), bytes.end());
  }
  void names(const std::vector<std::string>& names) {
    put(static_cast<std::uint32_t>(names.size()));
    for (const std::string& name : names) text(name);
  }
  std::vector<std::byte> to;
};

std::string text_in(ByteReader& r) {
  const auto bytes = r.bytes(r.u16());
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// How many there are, each of at least so many bytes; 0 where that cannot be.
std::size_t count_in(ByteReader& r, std::size_t most, std::size_t least_bytes, bool& is_sane) {
  const std::size_t count = r.u32();
  is_sane = is_sane && r.ok() && count <= most && count * least_bytes <= r.remaining();
  return is_sane ? count : 0;
}

std::vector<std::string> names_in(ByteReader& r, bool& is_sane) {
  std::vector<std::string> names(count_in(r, kMostNames, 2, is_sane));
  for (std::string& name : names) {
    name = text_in(r);
    is_sane = is_sane && name.size() <= kMostNameBytes;
  }
  return names;
}

/// What cannot be written; null if nothing.
const char* fault_of(const Recording& recording) {
  const auto is_long = [](const std::string& text) { return text.size() > kMostNameBytes; };
  const auto are_names = [&](const std::vector<std::string>& names) {
    return names.size() <= kMostNames && std::none_of(names.begin(), names.end(), is_long);
  };
  if (is_long(recording.title) || is_long(recording.made_with)) return "a text is too long";
  if (!are_names(recording.settings.names) || recording.settings.names.size() != recording.settings.values.size())
    return "the settings are too many, or not a value each";
  if (recording.assets.size() > kMostAssets || recording.streams.size() > kMostStreams) return "too much is in it";
  for (const Stream& stream : recording.streams) {
    if (is_long(stream.name) || !are_names(stream.inputs) || !are_names(stream.outputs))
      return "a head is out of bounds";
    if (stream.records.size() > kMostRecords) return "a stream has too many records";
    for (const Record& record : stream.records) {
      if (record.inputs.size() != stream.inputs.size() || record.outcome.marks.size() != stream.outputs.size() ||
          record.outcome.values.size() != (recording.has_values ? stream.outputs.size() : 0))
        return "a record does not fit its stream's head";
      if (record.messages.size() > kMostMessages) return "a record has too many messages";
      for (const RecordedMessage& message : record.messages)
        if (message.bytes.size() > kMostMessageBytes) return "a message is too long";
      for (const std::vector<double>& values : record.outcome.values)
        if (values.size() > kMostValues) return "an output has too many values";
    }
  }
  return nullptr;
}

}  // namespace

const Stream* Recording::find(std::string_view name) const {
  const auto at = std::find_if(streams.begin(), streams.end(), [&](const Stream& s) { return s.name == name; });
  return at == streams.end() ? nullptr : &*at;
}

tl::expected<std::vector<std::byte>, std::string> write_recording(const Recording& recording) {
  if (const char* why = fault_of(recording)) return wrong(why);
  HeadWriter head;
  head.put(kMagic);
  head.put(kVersion);
  head.put(static_cast<std::uint8_t>(recording.has_values));
  head.put(std::uint8_t{0});
  head.text(recording.title);
  head.text(recording.made_with);
  head.names(recording.settings.names);
  for (const double value : recording.settings.values) head.put(value);
  head.put(static_cast<std::uint32_t>(recording.assets.size()));
  for (const std::uint64_t hash : recording.assets) head.put(hash);
  head.put(static_cast<std::uint32_t>(recording.streams.size()));
  for (const Stream& stream : recording.streams) {
    head.text(stream.name);
    head.names(stream.inputs);
    head.names(stream.outputs);
    head.put(static_cast<std::uint32_t>(stream.records.size()));
  }
  Packer packer(head.to);
  for (const Stream& stream : recording.streams) {
    RecordCoder<Packer> coder(packer, stream, recording.has_values);
    for (Record record : stream.records)
      if (!coder.code(record)) return wrong("a record is out of bounds");
  }
  packer.finish();
  return std::move(head.to);
}

tl::expected<Recording, std::string> read_recording(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  if (r.u32() != kMagic || r.u16() != kVersion) return wrong("it does not begin as one of version 1");
  Recording recording;
  const std::uint8_t has_values = r.u8();
  recording.has_values = has_values == 1;
  bool is_sane = has_values <= 1 && r.u8() == 0;
  recording.title = text_in(r);
  recording.made_with = text_in(r);
  recording.settings.names = names_in(r, is_sane);
  for (std::size_t i = 0; i < recording.settings.names.size(); ++i) recording.settings.values.push_back(r.f64());
  recording.assets.resize(count_in(r, kMostAssets, 8, is_sane));
  for (std::uint64_t& hash : recording.assets) hash = r.u64();
  recording.streams.resize(count_in(r, kMostStreams, 14, is_sane));
  std::vector<std::size_t> counts;
  for (Stream& stream : recording.streams) {
    stream.name = text_in(r);
    stream.inputs = names_in(r, is_sane);
    stream.outputs = names_in(r, is_sane);
    counts.push_back(r.u32());
    is_sane = is_sane && stream.name.size() <= kMostNameBytes && counts.back() <= kMostRecords;
  }
  if (!is_sane || !r.ok() || recording.title.size() > kMostNameBytes || recording.made_with.size() > kMostNameBytes)
    return wrong("its head is cut short or out of bounds");
  Unpacker unpacker(r.bytes(r.remaining()));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    Stream& stream = recording.streams[i];
    RecordCoder<Unpacker> coder(unpacker, stream, recording.has_values);
    for (std::size_t k = 0; k < counts[i]; ++k) {
      if (!unpacker.may_take(sizeof(Record)) || !coder.code(stream.records.emplace_back()))
        return wrong("its records are out of bounds");
    }
  }
  if (!unpacker.is_whole()) return wrong("its length does not fit its contents");
  return recording;
}

}  // namespace farfeel::codecs
