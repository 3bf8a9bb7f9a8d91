// farfeel-view: shows a running session of this machine in a browser. It is fed by the master's local socket, and
// nothing that it does, not even its death, holds up the haptic loop.
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>

#include "codecs/settings/command_line.h"
#include "codecs/view/message_stream.h"
#include "master_station/view/newest_session.h"
#include "master_station/view/page_files.h"
#include "master_station/view/page_server.h"

namespace farfeel::master_station {
namespace {

constexpr int kPatience_ms = 10'000;

std::atomic<bool> is_asked_to_end{false};

int fail(const std::string& message) {
  fmt::print(stderr, "farfeel-view: {}\n", message);
  return 1;
}

/// Asks, and says what came of it.
int ask(int session_pid, codecs::ViewVerb verb) {
  const auto socket = connect_to_feed(session_pid);
  if (!socket) return fail(socket.error());
  const std::vector<std::byte> message = codecs::framed(codecs::write_view(verb));
  if (socket->send(message) != message.size()) return fail("the session does not listen");
  codecs::MessageStream stream(codecs::kMostViewBytes);
  std::vector<std::byte> piece(64 * 1024);
  pollfd wait{socket->fd(), POLLIN, 0};
  while (!stream.is_broken() && ::poll(&wait, 1, kPatience_ms) > 0) {
    const auto got = socket->receive(piece);
    if (!got) break;
    stream.put(std::span(piece).first(*got));
    while (const auto told = stream.next()) {
      const auto answer = codecs::read_view_answer(*told);
      if (!answer) continue;  // the scene and its ticks
      if (!answer->is_done) return fail(answer->words);
      fmt::print("{}\n", answer->words);
      return 0;
    }
  }
  return fail("the session did not answer");
}

int view(int session_pid, int port) {
  if (!has_page())
    return fail(
        "this build has no page, because the npm packages three and uplot, or esbuild, were not there: run "
        "deploy/install-packages build, then 'cmake --preset release' and 'cmake --build --preset release --target "
        "programs'");
  auto socket = connect_to_feed(session_pid);
  if (!socket) return fail(socket.error());
  auto server = PageServer::start(port);
  if (!server) return fail(server.error());
  NewestSession session(*std::move(socket), [&server] { (*server)->wake(); });
  (*server)->show(session);
  fmt::print("view: {}\n", (*server)->address());
  std::fflush(stdout);
  while (!is_asked_to_end && !session.is_over()) (*server)->serve();
  return 0;
}

}  // namespace
}  // namespace farfeel::master_station

int main(int argc, char** argv) {
  using namespace farfeel::master_station;
  CLI::App app{
      "farfeel-view: shows a running session of this machine in a browser, and prints the address to open there. Every "
      "session on a terminal starts one by itself, unless told --no-view.",
      "farfeel-view"};
  int session = 0, port = 0;
  bool with_parent = false;
  farfeel::codecs::ViewVerb verb{};
  app.add_option("--session", session, "Process number of the session's farfeel-master; the only one unless told")
      ->configurable(false)
      ->check(CLI::Range(1, 1 << 30));
  app.add_option("--port", port, "On 127.0.0.1; any that is free unless told")->check(CLI::Range(1, 65535));
  using farfeel::codecs::ViewVerb;
  for (const auto& [flag, asked, what] :
       {std::tuple("--reset-fault", ViewVerb::kResetFault, "Ask the session to forget its fault"),
        {"--pause", ViewVerb::kPause, "Ask it to pause: the force fades, the hand lets go of the tool"},
        {"--resume", ViewVerb::kResume, "Ask it to go on: it is armed, and the device's own grip brings the force"},
        {"--recentre", ViewVerb::kRecentre,
         "Ask it, while it is paused, to bring the tool back to where it began: the hand takes hold of it there"}})
    app.add_flag_callback(
           flag, [&verb, asked = asked] { verb = asked; }, std::string(what) + "; as on the page, and show nothing")
        ->configurable(false);
  app.add_flag("--with-parent", with_parent, "End when the program that started it ends")->configurable(false);
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  if (with_parent) ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { is_asked_to_end = true; });
  return verb != ViewVerb{} ? ask(session, verb) : view(session, port);
}
