// Giving up what root may do, before the first socket is bound and before a second thread is there.
//
// A process that is bound to the port as an ordinary user shares the port's group (SO_REUSEPORT) with that user alone.
// All capabilities go, also those that real-time threads would need: whoever wants such threads asks for them, or
// raises RLIMIT_RTPRIO, before.
#pragma once

#include <string>
#include <tl/expected.hpp>

namespace farfeel::transport {

/// Started as root, the process becomes `user`; without one, whoever called sudo or started a setuid program. HOME,
/// USER and LOGNAME are that user's then, and XDG_* are unset. Where there is neither, or user is "root", it stays user
/// 0 without a capability. Ends with no capability in any set, no supplementary group but the user's own, and
/// no_new_privs. Started as somebody else, it gives up what that one has; `user` may then name only that one.
///
/// What was done, for a log. Fails with a reason where something could not be given up: then do not go on.
/// While there is one thread: capabilities belong to threads.
[[nodiscard]] tl::expected<std::string, std::string> drop_privileges(const std::string& user);

}  // namespace farfeel::transport
