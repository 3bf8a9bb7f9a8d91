// seccomp: which system calls this process may still make.
//
// Two answers are given to what is not allowed. A call that nothing here makes and that takes over a machine (start a
// program, trace a process, mount, load into the kernel) ends the process: it is not ours any more, and an operator's
// hand is safer with a slave that is gone than with one that obeys somebody else. Every other call is answered "no such
// call", as by an older kernel: a C library that was renewed and tries a newer call knows what to do then.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

namespace farfeel::transport {

enum class Calls : std::uint8_t {
  kServer,            ///< UDP sockets, threads, memory that is no code, files to read, and to write those that are
                      ///< open already; no program to start
  kServerWithDriver,  ///< beside a graphics driver, of which nobody knows what it calls: all but what takes over a
                      ///< machine, and that is refused instead of ending the process
  kAnswerer,          ///< read, write, memory, end; every other call ends the process (apart.h)
};

/// From now on, for all threads that there are and will be. Fails with a reason where the kernel or the container has
/// no seccomp: nothing has changed then. Sets no_new_privs. In a build with sanitizers, which make calls of their own,
/// every set is kServerWithDriver, but for tracing, which the leak check needs.
[[nodiscard]] tl::expected<void, std::string> restrict_calls(Calls);

/// In words, for a log: "starts no program, ..."
[[nodiscard]] const char* words(Calls) noexcept;

}  // namespace farfeel::transport
