#include "master_station/devices/channel/websocket_channel.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "haptic_core/realtime/periodic_loop.h"
#include "tests/support/devices/inverse_service.h"

namespace farfeel::devices {
namespace {

constexpr std::int64_t kLong_ns = 5'000'000'000;  // only what fails waits so long

std::int64_t in(std::int64_t time_ns) {
  return realtime::monotonic_now_ns() + time_ns;
}

std::unique_ptr<TextChannel> connected(const std::string& uri) {
  const auto address = loopback_address(uri);
  if (!address) {
    ADD_FAILURE() << address.error();
    return nullptr;
  }
  auto channel = open_websocket(*address);
  EXPECT_TRUE(channel);
  return channel ? std::move(*channel) : nullptr;
}

/// A TCP port of this machine on which somebody listens and says nothing, or what he is told to.
class Listener {
 public:
  Listener() : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    EXPECT_EQ(bind(fd_, reinterpret_cast<sockaddr*>(&at), size), 0);
    EXPECT_EQ(listen(fd_, 4), 0);
    EXPECT_EQ(getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size), 0);
    port_ = ntohs(at.sin_port);
  }
  ~Listener() { close(fd_); }
  [[nodiscard]] std::string uri() const { return "ws://localhost:" + std::to_string(port_); }
  [[nodiscard]] int accepted() const { return accept(fd_, nullptr, nullptr); }

 private:
  int fd_, port_ = 0;
};

TEST(LoopbackAddress, is_of_this_machine_or_refused) {
  EXPECT_EQ(loopback_address("ws://localhost:10001")->host, "127.0.0.1");
  EXPECT_EQ(loopback_address("ws://localhost:10001")->path, "/");
  EXPECT_EQ(loopback_address("ws://127.8.9.10:65535/a/b")->path, "/a/b");
  EXPECT_EQ(loopback_address("ws://127.8.9.10:65535/a/b")->port, 65535);
  for (const char* uri :
       {"", "localhost:10001", "wss://localhost:1", "http://localhost:1", "ws://localhost",
        "ws://localhost:", "ws://localhost:0", "ws://localhost:65536", "ws://localhost:1x", "ws://localhost:-1",
        "ws://192.168.0.1:10001", "ws://example.org:10001", "ws://128.0.0.1:1", "ws://[::1]:1", "ws://:1"})
    EXPECT_FALSE(loopback_address(uri)) << uri;
}

TEST(WebsocketChannel, says_and_hears) {
  InverseService service;
  const auto channel = connected(service.uri());
  EXPECT_FALSE(channel->is_open());
  EXPECT_EQ(channel->send("too early"), ChannelState::kNothing);
  std::string_view text;
  ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone) << channel->trouble();
  EXPECT_TRUE(channel->is_open());
  EXPECT_NE(text.find("session_id"), std::string_view::npos);
  EXPECT_GE(channel->descriptor(), 0);
  for (std::uint64_t i = 1; i <= 50; ++i) {
    ASSERT_EQ(channel->send("anything"), ChannelState::kDone);
    ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone);
    EXPECT_EQ(channel->messages(), i + 1);
    EXPECT_EQ(text.front(), '{');
    EXPECT_EQ(text.back(), '}');
  }
  EXPECT_EQ(channel->receive(text, in(1'000'000)), ChannelState::kNothing);
  EXPECT_EQ(channel->send(std::string(5000, 'x')), ChannelState::kStalled);  // longer than anything that is meant
}

TEST(WebsocketChannel, puts_parts_together_and_answers_pings) {
  InverseService service;
  const auto channel = connected(service.uri());
  std::string_view text;
  ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone);
  for (const auto fault : {InverseService::Fault::kFragments, InverseService::Fault::kPings}) {
    service.set(fault);
    for (int i = 0; i < 20; ++i) {
      const std::uint64_t before = channel->messages();
      ASSERT_EQ(channel->send("x"), ChannelState::kDone);
      ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone) << channel->trouble();
      EXPECT_EQ(channel->messages(), before + 1);
      EXPECT_EQ(text.substr(0, 12), R"({"inverse3":)");
      EXPECT_EQ(text.back(), '}');
    }
  }
}

TEST(WebsocketChannel, only_the_newest_is_told) {
  InverseService service;
  const auto channel = connected(service.uri());
  std::string_view text;
  ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone);
  for (int i = 0; i < 3; ++i) {
    const std::int64_t end_ns = in(kLong_ns);
    while (channel->send("x") == ChannelState::kNothing && realtime::monotonic_now_ns() < end_ns) {
    }
  }
  const std::int64_t end_ns = in(kLong_ns);
  int told = 0;
  while (channel->messages() < 4 && realtime::monotonic_now_ns() < end_ns)
    told += channel->receive(text, in(1'000'000)) == ChannelState::kDone;
  EXPECT_EQ(channel->messages(), 4U);
  EXPECT_LE(told, 3);
  EXPECT_EQ(channel->receive(text, 0), ChannelState::kNothing);
}

TEST(WebsocketChannel, a_message_without_end_is_hung_up_on) {
  InverseService service;
  const auto channel = connected(service.uri());
  std::string_view text;
  ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone);
  service.set(InverseService::Fault::kHuge);
  channel->send("x");
  EXPECT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kGone);
  EXPECT_NE(channel->trouble().find("65536"), std::string::npos);
  EXPECT_EQ(channel->send("x"), ChannelState::kGone);
  EXPECT_EQ(channel->descriptor(), -1);
}

TEST(WebsocketChannel, says_when_the_other_end_hangs_up) {
  InverseService service;
  const auto channel = connected(service.uri());
  std::string_view text;
  ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone);
  service.set(InverseService::Fault::kHangUp);
  channel->send("x");
  EXPECT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kGone);
  EXPECT_NE(channel->trouble().find("hung up"), std::string::npos);
}

TEST(WebsocketChannel, says_when_the_service_ends) {
  auto service = std::make_unique<InverseService>();
  const auto channel = connected(service->uri());
  std::string_view text;
  ASSERT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kDone);
  service.reset();
  EXPECT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kGone);
}

TEST(WebsocketChannel, a_refused_handshake_is_gone) {
  InverseService service;
  service.refuse_connections(true);
  const auto channel = connected(service.uri());
  std::string_view text;
  EXPECT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kGone);
  EXPECT_NE(channel->trouble(), "");
}

TEST(WebsocketChannel, nobody_listening_is_gone) {
  std::string uri;
  {
    const Listener listener;
    uri = listener.uri();
  }
  const auto channel = connected(uri);
  std::string_view text;
  EXPECT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kGone);
}

TEST(WebsocketChannel, who_listens_and_says_nothing_holds_nobody_up) {
  const Listener listener;
  const auto channel = connected(listener.uri());
  std::string_view text;
  EXPECT_EQ(channel->receive(text, in(30'000'000)), ChannelState::kNothing);
  EXPECT_FALSE(channel->is_open());
}

TEST(WebsocketChannel, who_answers_otherwise_is_gone) {
  const Listener listener;
  const auto channel = connected(listener.uri());
  std::string_view text;
  EXPECT_EQ(channel->receive(text, in(10'000'000)), ChannelState::kNothing);
  const int peer = listener.accepted();
  const std::string answer = "SSH-2.0-something\r\n\r\n";
  EXPECT_EQ(write(peer, answer.data(), answer.size()), static_cast<ssize_t>(answer.size()));
  close(peer);
  EXPECT_EQ(channel->receive(text, in(kLong_ns)), ChannelState::kGone);
}

}  // namespace
}  // namespace farfeel::devices
