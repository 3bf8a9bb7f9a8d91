#include "master_station/devices/channel/websocket_channel.h"

#include <arpa/inet.h>
#include <libwebsockets.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <ctime>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {
namespace {

constexpr std::size_t kReceiveBuffer = 4096;  // of one read; messages are put together from these
constexpr std::size_t kMaxSent = 4096;
constexpr unsigned kDescriptors = 16;                   // of libwebsockets' own table
constexpr std::int64_t kConnectionPoll_ns = 1'000'000;  // while there is no socket yet to wait for
constexpr unsigned kHandshakeTimeout_s = 3;

class Websocket final : public TextChannel {
 public:
  Websocket() : incoming_(kMaxMessage), newest_(kMaxMessage) {}
  ~Websocket() override {
    if (context_ != nullptr) lws_context_destroy(context_);
  }

  bool connect(const LoopbackAddress& address) {
    lws_set_log_level(0, nullptr);  // what went wrong is told by trouble()
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN;
    info.protocols = kProtocols.data();
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.fd_limit_per_thread = kDescriptors;
    info.pt_serv_buf_size = kReceiveBuffer;
    info.timeout_secs = kHandshakeTimeout_s;
    info.connect_timeout_secs = kHandshakeTimeout_s;
    info.user = this;
    context_ = lws_create_context(&info);
    if (context_ == nullptr) return false;
    const std::string host = "localhost:" + std::to_string(address.port);
    lws_client_connect_info to{};
    to.context = context_;
    to.address = address.host.c_str();
    to.port = address.port;
    to.path = address.path.c_str();
    to.host = host.c_str();
    to.origin = nullptr;
    to.local_protocol_name = kProtocols[0].name;
    to.pwsi = &socket_;
    lws_client_connect_via_info(&to);
    return true;  // what failed at once was told to the callback
  }

  [[nodiscard]] bool is_open() const noexcept override { return is_open_ && !is_gone_; }

  ChannelState send(std::string_view text) noexcept override {
    if (is_gone_) return ChannelState::kGone;
    if (!is_open_ || to_send_ > 0) return ChannelState::kNothing;
    if (text.empty() || text.size() > kMaxSent) return ChannelState::kStalled;
    std::memcpy(outgoing_.data() + LWS_PRE, text.data(), text.size());
    to_send_ = text.size();
    lws_callback_on_writable(socket_);
    service();
    return is_gone_ ? ChannelState::kGone : ChannelState::kDone;
  }

  ChannelState receive(std::string_view& text, std::int64_t deadline_ns) noexcept override {
    for (;;) {
      if (!is_gone_) service();
      if (newest_size_ > 0) {  // also what came before it hung up
        text = {newest_.data(), newest_size_};
        newest_size_ = 0;
        return ChannelState::kDone;
      }
      if (is_gone_) return ChannelState::kGone;
      const std::int64_t left_ns = deadline_ns - realtime::monotonic_now_ns();
      if (left_ns <= 0) return ChannelState::kNothing;
      wait(left_ns);
    }
  }

  [[nodiscard]] std::uint64_t messages() const noexcept override { return messages_; }
  [[nodiscard]] int descriptor() const noexcept override { return is_open() ? lws_get_socket_fd(socket_) : -1; }
  [[nodiscard]] std::string trouble() const override { return trouble_; }

  static int callback(lws* socket, lws_callback_reasons reason, void*, void* bytes, std::size_t size) {
    lws_context* const context = lws_get_context(socket);
    auto* const self = context != nullptr ? static_cast<Websocket*>(lws_context_user(context)) : nullptr;
    return self != nullptr ? self->on(socket, reason, static_cast<const char*>(bytes), size) : 0;
  }

 private:
  static const std::array<lws_protocols, 2> kProtocols;

  /// All that is ready, without waiting.
  void service() noexcept { lws_service(context_, -1); }

  void wait(std::int64_t left_ns) noexcept {
    const int fd = socket_ != nullptr && is_open_ ? lws_get_socket_fd(socket_) : -1;
    if (fd < 0) left_ns = std::min(left_ns, kConnectionPoll_ns);
    pollfd waits{.fd = fd, .events = POLLIN, .revents = 0};
    if (to_send_ > 0) waits.events |= POLLOUT;
    const timespec left{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
    ppoll(&waits, fd < 0 ? 0 : 1, &left, nullptr);
  }

  int on(lws* socket, lws_callback_reasons reason, const char* bytes, std::size_t size) {
    switch (reason) {
      case LWS_CALLBACK_CLIENT_ESTABLISHED:
        is_open_ = true;
        return 0;
      case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
        return gone("it does not answer as a WebSocket" +
                    (bytes != nullptr ? " (" + std::string(bytes, strnlen(bytes, size)) + ")" : std::string()));
      case LWS_CALLBACK_CLIENT_CLOSED:
        return gone("it hung up");
      case LWS_CALLBACK_CLIENT_RECEIVE:
        return take(socket, bytes, size);
      case LWS_CALLBACK_CLIENT_WRITEABLE:
        if (to_send_ == 0) return 0;
        if (lws_write(socket, outgoing_.data() + LWS_PRE, to_send_, LWS_WRITE_TEXT) < 0)
          return gone("it does not take what is sent");
        to_send_ = 0;
        return 0;
      default:
        return 0;
    }
  }

  int gone(std::string why) {
    if (!is_gone_) trouble_ = std::move(why);
    is_gone_ = true;
    return -1;
  }

  int take(lws* socket, const char* bytes, std::size_t size) {
    if (lws_is_first_fragment(socket) != 0) incoming_size_ = 0;
    if (size > kMaxMessage - incoming_size_) return gone("it said more than 65536 bytes in one message");
    if (size > 0) std::memcpy(incoming_.data() + incoming_size_, bytes, size);
    incoming_size_ += size;
    if (lws_is_final_fragment(socket) == 0 || lws_remaining_packet_payload(socket) > 0) return 0;
    std::swap(incoming_, newest_);
    newest_size_ = incoming_size_;
    incoming_size_ = 0;
    ++messages_;
    return 0;
  }

  lws_context* context_ = nullptr;
  lws* socket_ = nullptr;
  bool is_open_ = false, is_gone_ = false;
  std::string trouble_;
  std::vector<char> incoming_, newest_;
  std::size_t incoming_size_ = 0, newest_size_ = 0;
  std::uint64_t messages_ = 0;
  std::array<unsigned char, LWS_PRE + kMaxSent> outgoing_{};
  std::size_t to_send_ = 0;
};

const std::array<lws_protocols, 2> Websocket::kProtocols{{{.name = "farfeel",
                                                           .callback = &Websocket::callback,
                                                           .per_session_data_size = 0,
                                                           .rx_buffer_size = kReceiveBuffer,
                                                           .id = 0,
                                                           .user = nullptr,
                                                           .tx_packet_size = 0},
                                                          {}}};

}  // namespace

tl::expected<LoopbackAddress, std::string> loopback_address(std::string_view uri) {
  const auto refusal = [&](const char* why) { return tl::unexpected(std::string(uri) + " " + why); };
  constexpr std::string_view kScheme = "ws://";
  if (uri.substr(0, kScheme.size()) != kScheme) return refusal("does not begin with ws://");
  const std::string_view rest = uri.substr(kScheme.size());
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const std::string_view place = rest.substr(0, slash);
  const std::size_t colon = place.find(':');
  if (colon == std::string_view::npos) return refusal("names no port");
  LoopbackAddress address{
      .host = std::string(place.substr(0, colon)), .port = 0, .path = std::string(rest.substr(slash))};
  if (address.path.empty()) address.path = "/";
  const std::string_view port = place.substr(colon + 1);
  const auto result = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (result.ec != std::errc{} || result.ptr != port.data() + port.size() || address.port == 0)
    return refusal("has no port from 1 to 65535");
  if (address.host == "localhost") address.host = "127.0.0.1";
  in_addr ip{};
  if (inet_pton(AF_INET, address.host.c_str(), &ip) != 1 || (ntohl(ip.s_addr) >> 24) != 127)
    return refusal("is not on this machine: only localhost and 127.x.x.x are");
  return address;
}

tl::expected<std::unique_ptr<TextChannel>, std::string> open_websocket(const LoopbackAddress& address) {
  auto channel = std::make_unique<Websocket>();
  if (!channel->connect(address)) return tl::unexpected(std::string("libwebsockets makes no context"));
  return channel;
}

}  // namespace farfeel::devices
