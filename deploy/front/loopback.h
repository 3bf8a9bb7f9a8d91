// `farfeel loopback`: both stations on this machine, a link between them if asked, and a report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace farfeel::front {

struct LoopbackWishes {
  std::string scene = "file-cad";  ///< what the person is told; to_slave says which it is
  double seconds = 20;
  std::uint64_t seed = 1;
  std::string link;  ///< what farfeel-link understands; empty: none
  std::string out;   ///< empty: a new folder below out/loopback
  bool no_view = false;
  std::string command;                           ///< as the person typed it
  std::vector<std::string> to_master, to_slave;  ///< further arguments, handed on as they are
};

/// Returns the exit status: 0 when the session ran to its end, 130 when it was stopped by Ctrl-C, 1 when something
/// failed.
[[nodiscard]] int run_loopback(const LoopbackWishes&);

}  // namespace farfeel::front
