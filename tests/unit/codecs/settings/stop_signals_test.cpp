#include "codecs/settings/stop_signals.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/in_child.h"

namespace farfeel::codecs {
namespace {

TEST(StopSignals, EndAProgramAtOnceWhileItSaysSoAndWaitAfterwards) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const auto at_once = test_support::in_child([signal] {
      const sigset_t held = hold_stop_signals();
      const StopsEndAtOnce meanwhile(held);
      ::kill(::getpid(), signal);
      ::sleep(60);
      return std::string("it went on");
    });
    EXPECT_EQ(at_once.signal(), signal) << at_once.words;
    const auto later = test_support::in_child([signal] {
      const sigset_t held = hold_stop_signals();
      { const StopsEndAtOnce meanwhile(held); }
      ::kill(::getpid(), signal);
      int came = 0;
      sigwait(&held, &came);
      return std::string(came == signal ? "waited" : "another");
    });
    EXPECT_EQ(later.words, "waited");
  }
}

}  // namespace
}  // namespace farfeel::codecs
