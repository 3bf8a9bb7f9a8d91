// A question that is answered by a process of its own, with limits of its own, which is gone afterwards: for decoders
// of strangers' bytes that are not ours and that nobody can prove.
//
// The process is this program started anew (posix_spawn, which is safe beside threads and real-time loops where fork
// alone is not: no page of theirs is copied, no lock of theirs is held, and no key of theirs is in its memory). It
// knows by its command line that it is the one who answers, gives up everything else, and then reads the question. What
// it says is bytes from a stranger, too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace farfeel::transport {

struct ApartLimits {
  std::uint64_t memory_bytes = 0;  ///< of address space, program and libraries included; not in sanitizers' builds
  std::uint32_t seconds = 0;       ///< of a clock on the wall, and of the processor
  std::size_t answer_bytes = 0;
};

/// Blocks until the answer is here. Fails with a reason where the process died, said why it cannot, or reached a limit.
/// program: what to start, with arguments; its last two arguments are added: see answer_apart. Any thread; not in a
/// tick.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> ask_apart(std::vector<std::string> program,
                                                                          std::span<const std::byte> question,
                                                                          const ApartLimits&);

/// The answer, or why there is none.
using Answer = std::function<tl::expected<std::vector<std::byte>, std::string>(std::span<const std::byte> question)>;

/// At the other side, first of all in main: takes the limits from the two last arguments, confines itself, reads the
/// question from descriptor 0 and answers to descriptor 1. Gives what main is to return.
[[nodiscard]] int answer_apart(std::span<char* const> arguments, const Answer&);

}  // namespace farfeel::transport
