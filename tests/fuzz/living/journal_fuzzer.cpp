// Any bytes as a journal of edits: what is read is within its limits, and what is good ends where it says.

#include <cstdlib>

#include "slave_sim/living/journal.h"

using namespace farfeel;

namespace {

void demand(bool is_so) {
  if (!is_so) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto journal = std::as_bytes(std::span(bytes, size));
  const transport::ObjectHash of_zeros{};
  const auto read = slave_sim::read_journal(journal, of_zeros);
  if (!read) return 0;
  demand(read->good_bytes <= size);
  std::array<std::byte, codecs::kMostEditBytes> again;
  for (const slave_sim::JournalEntry& entry : read->entries) demand(codecs::write(entry.request, again) > 0);
  const auto good = slave_sim::read_journal(journal.first(read->good_bytes), of_zeros);
  demand(good && good->entries.size() == read->entries.size() && good->good_bytes == read->good_bytes);
  return 0;
}
