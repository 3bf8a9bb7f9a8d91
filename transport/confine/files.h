// Landlock: which files this process, and what it starts, may still open.
// https://docs.kernel.org/userspace-api/landlock.html
//
// Rights stand on folders and files as they are now: a file may be replaced inside a folder, a folder that is put in
// place of another one has no rights. TCP and signals to other processes go with them where the kernel can do that.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace farfeel::transport {

/// Paths of folders, for all that lies below, or of files. Those that are not there are left out.
struct FileRights {
  std::vector<std::string> read;   ///< and list
  std::vector<std::string> write;  ///< read, write, make, rename within and remove
  std::vector<std::string> use;    ///< devices: read, write, ioctl
};

/// Adds what any program's libraries read: themselves, time zones, the processors' list.
void add_system_files(FileRights&);

/// The version of Landlock that is in use from now on. Fails with a reason where the kernel has none: nothing has
/// changed then. Rights that were already open stay. For the calling thread and those that it starts: call it while
/// there is no other. Needs no_new_privs (privileges.h).
[[nodiscard]] tl::expected<int, std::string> restrict_files(const FileRights&);

}  // namespace farfeel::transport
