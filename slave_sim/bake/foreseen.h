// What a bake will take, told before it begins: an upper bound of its memory, and about how long it runs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace farfeel::slave_sim {

struct Foreseen {
  double bytes = 0;    ///< at most: of memory that is in use at once, from reading the file on
  double seconds = 0;  ///< about: on two cores of a server that have nothing else to do
};

/// Of so many bakes of a mesh of so many triangles, with textures of at most that side.
[[nodiscard]] Foreseen foreseen(std::size_t triangles, std::uint32_t texture, int bakes);

/// What the machine has to give, and the process may take; infinite where nobody knows.
[[nodiscard]] double memory_there();
/// The largest texture up to `most`, by halves, with which a bake of so many triangles takes no more; nothing where
/// even one of 256 does.
[[nodiscard]] std::optional<std::uint32_t> texture_within(double bytes, std::size_t triangles, std::uint32_t most);

/// For a person: that there is less memory than that, by the machine's or by the process's own limit, and what to do.
/// Nothing where there is enough, or where nobody knows.
[[nodiscard]] std::optional<std::string> words_about_memory(const Foreseen&);

/// "0.9 GB and about 40 s".
[[nodiscard]] std::string in_words(const Foreseen&);

}  // namespace farfeel::slave_sim
