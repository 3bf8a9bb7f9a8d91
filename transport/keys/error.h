// What can be wrong with keys and their files.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

namespace farfeel::transport {

enum class KeysErrorKind : std::uint8_t {
  kMissing,      ///< a file or folder that should be there is not
  kPermissions,  ///< others could read or change it
  kMalformed,    ///< text that is no key, name, date or list
  kConflict,     ///< it would contradict what is there already
  kSystem,       ///< the operating system said no
};

/// The message says what was tried, what was wrong and what to do.
struct KeysError {
  KeysErrorKind kind;
  std::string message;
};

template <typename T>
using KeysResult = tl::expected<T, KeysError>;

}  // namespace farfeel::transport
