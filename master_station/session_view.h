// A session's live view: the process that serves it, what it is told in words, and what it may ask for.
#pragma once

#include <sys/types.h>

#include "master_station/feed/session_feed.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "master_station/session/master_session.h"
#include "master_station/session_devices.h"

namespace farfeel::master_station {

/// farfeel-view beside this program, for this process' session. It prints its address on this program's standard output
/// and ends with this. Where it can't be started the session goes on without.
class ViewProcess {
 public:
  explicit ViewProcess(bool is_wanted);
  ViewProcess(const ViewProcess&) = delete;
  ViewProcess& operator=(const ViewProcess&) = delete;
  ~ViewProcess();

 private:
  pid_t pid_ = -1;
};

/// Some times a second, from main.
void tell_view(SessionFeed&, const HapticLoop&, MasterSession&, const SessionDevices&, const codecs::SceneDescription&);
/// Any thread but the haptic one.
[[nodiscard]] codecs::ViewAnswer obey(codecs::ViewVerb, HapticLoop&);

}  // namespace farfeel::master_station
