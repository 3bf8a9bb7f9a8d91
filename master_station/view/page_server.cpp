#include "master_station/view/page_server.h"

#include <fmt/format.h>
#include <libwebsockets.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <set>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/view/page_files.h"

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kLeastBetween_ns = 12'000'000;  // ticks come every 8 ms: every other one, 60 a second
constexpr std::int64_t kPatience_ns = 5'000'000'000;   // for a token
constexpr std::size_t kMostClients = 16;
constexpr std::size_t kHttpPiece = 16 * 1024;
constexpr int kSendBuffer = 64 * 1024;  // of the kernel: what a stalled tab leaves there is old when it goes on
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self' {}; base-uri "
    "'none'; form-action 'none'; frame-ancestors 'none'";

std::string random_token() {
  std::array<unsigned char, codecs::kViewTokenBytes / 2> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) std::abort();
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

/// In a time that says nothing of where they differ.
bool is_same(std::string_view a, std::string_view b) {
  unsigned char differs = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    differs = static_cast<unsigned char>(differs | (a[i] ^ b[i]));
  return differs == 0;
}

std::string header(lws* socket, lws_token_indexes which) {
  std::array<char, 256> text{};
  const int size = lws_hdr_copy(socket, text.data(), static_cast<int>(text.size()), which);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : std::string();
}

/// One browser that looks.
struct Client {
  lws* socket = nullptr;
  bool is_known = false;  // it has told the token
  std::int64_t sent_ns = 0;
  std::size_t parts_sent = 0;
  bool has_history = false;
  NewestSession::Newest sent;
  std::optional<codecs::ViewTick> waiting;
  std::vector<std::uint64_t> in_flight;  // ticks that it has not taken yet
};

/// libwebsockets' memory of one connection.
struct Connection {
  Client* client;
  const PageFile* file;
  std::size_t sent;
};

}  // namespace

class PageServer::State {
 public:
  ~State() {
    if (context_ != nullptr) lws_context_destroy(context_);
  }

  bool listen(int asked_port) {
    lws_set_log_level(LLL_ERR, [](int, const char*) {});
    lws_context_creation_info info{};
    info.port = asked_port;
    info.iface = "127.0.0.1";
    info.protocols = kProtocols.data();
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.user = this;
    info.options = LWS_SERVER_OPTION_DISABLE_IPV6;
    context_ = lws_create_context(&info);
    if (context_ == nullptr) return false;
    port = lws_get_vhost_listen_port(lws_get_vhost_by_name(context_, "default"));
    host_ = fmt::format("127.0.0.1:{}", port);
    policy_ = fmt::format(fmt::runtime(kPolicy), "ws://" + host_);
    return port > 0;
  }

  int serve() {
    lws_service(context_, 0);
    return static_cast<int>(clients_.size());
  }
  void wake() { lws_cancel_service(context_); }

  static int callback(lws* socket, lws_callback_reasons reason, void* memory, void* bytes, std::size_t size) {
    lws_context* const context = lws_get_context(socket);
    auto* const self = context != nullptr ? static_cast<State*>(lws_context_user(context)) : nullptr;
    return self != nullptr ? self->on(socket, reason, static_cast<Connection*>(memory), bytes, size) : 0;
  }

  std::string token = random_token();
  int port = 0;
  NewestSession* session = nullptr;

 private:
  static const std::array<lws_protocols, 3> kProtocols;

  int on(lws* socket, lws_callback_reasons reason, Connection* connection, void* bytes, std::size_t size) {
    switch (reason) {
      case LWS_CALLBACK_HTTP:
        return answer(socket, *connection, {static_cast<const char*>(bytes), size});
      case LWS_CALLBACK_HTTP_WRITEABLE:
        return go_on(socket, *connection);
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        // A page of another site may open a WebSocket to here, and its browser says which.
        return header(socket, WSI_TOKEN_HOST) == host_ && header(socket, WSI_TOKEN_ORIGIN) == "http://" + host_ &&
                       clients_.size() < kMostClients
                   ? 0
                   : -1;
      case LWS_CALLBACK_ESTABLISHED:
        connection->client = new Client;
        connection->client->socket = socket;
        if (session != nullptr)  // what others asked before is not told
          connection->client->sent[NewestSession::kAnswer] = session->newest()[NewestSession::kAnswer];
        clients_.insert(connection->client);
        ::setsockopt(lws_get_socket_fd(socket), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
        lws_set_timeout(socket, PENDING_TIMEOUT_USER_OK, static_cast<int>(kPatience_ns / 1'000'000'000));
        return 0;
      case LWS_CALLBACK_CLOSED:
        if (connection != nullptr) forget(connection->client);
        return 0;
      case LWS_CALLBACK_RECEIVE:
        return hear(*connection->client, {static_cast<const std::byte*>(bytes), size});
      case LWS_CALLBACK_SERVER_WRITEABLE:
        return tell(*connection->client);
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        share();
        return 0;
      default:
        return 0;
    }
  }

  int refuse(lws* socket, unsigned status) {
    lws_return_http_status(socket, status, nullptr);
    return -1;
  }

  int answer(lws* socket, Connection& connection, std::string_view path) {
    // A name that leads to this machine by somebody else's DNS is no name of this page.
    if (header(socket, WSI_TOKEN_HOST) != host_) return refuse(socket, HTTP_STATUS_FORBIDDEN);
    if (path == "/favicon.ico") return refuse(socket, HTTP_STATUS_NO_CONTENT);  // browsers ask by themselves
    const auto files = page_files();
    const auto file = std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == path; });
    if (file == files.end()) return refuse(socket, HTTP_STATUS_NOT_FOUND);
    connection.file = &*file;
    connection.sent = 0;
    std::array<unsigned char, LWS_PRE + 2048> buffer{};
    unsigned char *start = buffer.data() + LWS_PRE, *at = start, *end = buffer.data() + buffer.size();
    const auto add = [&](const char* name, std::string_view value) {
      return lws_add_http_header_by_name(socket, reinterpret_cast<const unsigned char*>(name),
                                         reinterpret_cast<const unsigned char*>(value.data()),
                                         static_cast<int>(value.size()), &at, end) == 0;
    };
    if (lws_add_http_common_headers(socket, HTTP_STATUS_OK, std::string(file->type).c_str(), file->bytes.size(), &at,
                                    end) != 0 ||
        !add("content-security-policy:", policy_) || !add("x-content-type-options:", "nosniff") ||
        !add("referrer-policy:", "no-referrer") || !add("cache-control:", "no-store") ||
        !add("cross-origin-opener-policy:", "same-origin") || !add("cross-origin-resource-policy:", "same-origin") ||
        lws_finalize_write_http_header(socket, start, &at, end) != 0)
      return -1;
    lws_callback_on_writable(socket);
    return 0;
  }

  int go_on(lws* socket, Connection& connection) {
    if (connection.file == nullptr) return -1;
    std::array<unsigned char, LWS_PRE + kHttpPiece> buffer;
    const std::string_view left = connection.file->bytes.substr(connection.sent);
    const std::size_t piece = std::min(left.size(), kHttpPiece);
    std::memcpy(buffer.data() + LWS_PRE, left.data(), piece);
    const bool is_last = piece == left.size();
    if (lws_write(socket, buffer.data() + LWS_PRE, piece, is_last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) !=
        static_cast<int>(piece))
      return -1;
    connection.sent += piece;
    if (is_last) return lws_http_transaction_completed(socket) != 0 ? -1 : 0;
    lws_callback_on_writable(socket);
    return 0;
  }

  void forget(Client* client) {
    clients_.erase(client);
    delete client;
  }

  int hear(Client& client, std::span<const std::byte> message) {
    if (lws_is_first_fragment(client.socket) == 0 || lws_is_final_fragment(client.socket) == 0 ||
        message.size() > codecs::kMostViewRequestBytes)
      return -1;
    if (!client.is_known) {
      const auto told = codecs::read_view_token(message);
      if (!told || !is_same(*told, token)) {
        lws_close_reason(client.socket, LWS_CLOSE_STATUS_POLICY_VIOLATION, nullptr, 0);
        return -1;
      }
      client.is_known = true;
      lws_set_timeout(client.socket, NO_PENDING_TIMEOUT, 0);
    } else if (const auto taken = codecs::read_view_taken(message)) {
      std::erase_if(client.in_flight, [&](std::uint64_t number) { return number <= *taken; });
    } else if (const auto verb = codecs::read_view_control(message)) {
      if (session != nullptr) session->ask(*verb);
    } else {
      return -1;
    }
    lws_callback_on_writable(client.socket);
    return 0;
  }

  /// Gives everybody the newest tick, to be sent when it may be.
  void share() {
    if (session == nullptr) return;
    if (const auto tick = session->take_tick()) {
      for (Client* client : clients_) {
        codecs::ViewTick newest = *tick;
        if (client->waiting) newest.absorb(*client->waiting);
        client->waiting = std::move(newest);
      }
    }
    for (const Client* client : clients_) lws_callback_on_writable(client->socket);
  }

  int write(Client& client, std::span<const std::byte> message) {
    out_.resize(LWS_PRE + message.size());
    std::memcpy(out_.data() + LWS_PRE, message.data(), message.size());
    return lws_write(client.socket, out_.data() + LWS_PRE, message.size(), LWS_WRITE_BINARY) < 0 ? -1 : 0;
  }

  /// One message a call: the scene, how it went, what is new of words and tiles, then the newest tick where the client
  /// has credit.
  int tell(Client& client) {
    if (session == nullptr || !client.is_known) return 0;
    const auto parts = session->parts();
    if (client.parts_sent < parts.size()) {
      lws_callback_on_writable(client.socket);
      return write(client, *parts[client.parts_sent++]);
    }
    if (!client.has_history) {
      client.has_history = true;
      lws_callback_on_writable(client.socket);
      return write(client, codecs::write_view(session->history()));
    }
    const NewestSession::Newest newest = session->newest();
    for (std::size_t i = 0; i < newest.size(); ++i) {
      if (!newest[i] || newest[i] == client.sent[i]) continue;
      client.sent[i] = newest[i];
      lws_callback_on_writable(client.socket);
      return write(client, *newest[i]);
    }
    const std::int64_t now_ns = realtime::monotonic_now_ns();
    if (!client.waiting || client.in_flight.size() >= kMostTicksInFlight || now_ns - client.sent_ns < kLeastBetween_ns)
      return 0;
    client.sent_ns = now_ns;
    client.in_flight.push_back(client.waiting->number);
    const std::vector<std::byte> message = codecs::write_view(*client.waiting);
    client.waiting.reset();
    return write(client, message);
  }

  lws_context* context_ = nullptr;
  std::string host_, policy_;
  std::set<Client*> clients_;
  std::vector<unsigned char> out_;
};

const std::array<lws_protocols, 3> PageServer::State::kProtocols{{
    {"http", PageServer::State::callback, sizeof(Connection), 0, 0, nullptr, 0},
    {"farfeel-view", PageServer::State::callback, sizeof(Connection), codecs::kMostViewRequestBytes, 0, nullptr, 0},
    {nullptr, nullptr, 0, 0, 0, nullptr, 0},
}};

PageServer::PageServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
PageServer::~PageServer() = default;

tl::expected<std::unique_ptr<PageServer>, std::string> PageServer::start(int port) {
  auto state = std::make_unique<State>();
  if (!state->listen(port))
    return tl::unexpected(
        fmt::format("could not serve at 127.0.0.1{}", port > 0 ? fmt::format(":{}: is the port in use?", port) : ""));
  return std::unique_ptr<PageServer>(new PageServer(std::move(state)));
}

std::string PageServer::address() const {
  return fmt::format("http://127.0.0.1:{}/#{}", state_->port, state_->token);
}
int PageServer::port() const {
  return state_->port;
}
void PageServer::show(NewestSession& session) {
  state_->session = &session;
}
void PageServer::wake() {
  state_->wake();
}
int PageServer::serve() {
  return state_->serve();
}

}  // namespace farfeel::master_station
