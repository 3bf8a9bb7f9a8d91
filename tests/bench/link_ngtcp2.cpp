// QUIC by ngtcp2 0.12 and GnuTLS: one connection, DATAGRAM frames alone. Nothing is paced, no connection times out, and
// acknowledgements ride on the datagrams; the certificate, made for the occasion, is checked by nobody: what is timed
// is the connection that stands.
#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <gnutls/x509.h>
#include <ngtcp2/ngtcp2.h>
#include <ngtcp2/ngtcp2_crypto.h>
#include <ngtcp2/ngtcp2_crypto_gnutls.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <optional>
#include <utility>

#include "tests/bench/connected_sockets.h"
#include "tests/bench/link_method.h"
#include "transport/net/arrival_clock.h"

namespace farfeel::bench {
namespace {

constexpr std::size_t kMostDatagram = 1'500, kConnectionIdBytes = 8;
constexpr std::int64_t kConnect_ns = 2'000'000'000;

/// A key and a certificate of its own.
class Credentials {
 public:
  Credentials() {
    gnutls_certificate_allocate_credentials(&credentials_);
    gnutls_x509_privkey_t key = nullptr;
    gnutls_x509_crt_t certificate = nullptr;
    gnutls_x509_privkey_init(&key);
    gnutls_x509_crt_init(&certificate);
    const std::array<unsigned char, 1> serial{1};
    const std::time_t now = std::time(nullptr);
    is_good_ =
        gnutls_x509_privkey_generate(key, GNUTLS_PK_ECDSA, GNUTLS_CURVE_TO_BITS(GNUTLS_ECC_CURVE_SECP256R1), 0) == 0 &&
        gnutls_x509_crt_set_version(certificate, 3) == 0 &&
        gnutls_x509_crt_set_serial(certificate, serial.data(), serial.size()) == 0 &&
        gnutls_x509_crt_set_activation_time(certificate, now - 3600) == 0 &&
        gnutls_x509_crt_set_expiration_time(certificate, now + 86400) == 0 &&
        gnutls_x509_crt_set_key(certificate, key) == 0 &&
        gnutls_x509_crt_sign2(certificate, certificate, key, GNUTLS_DIG_SHA256, 0) == 0 &&
        gnutls_certificate_set_x509_key(credentials_, &certificate, 1, key) == 0;
    gnutls_x509_crt_deinit(certificate);
    gnutls_x509_privkey_deinit(key);
  }
  Credentials(const Credentials&) = delete;
  Credentials& operator=(const Credentials&) = delete;
  ~Credentials() { gnutls_certificate_free_credentials(credentials_); }
  [[nodiscard]] bool is_good() const { return is_good_; }
  [[nodiscard]] gnutls_certificate_credentials_t get() const { return credentials_; }

 private:
  gnutls_certificate_credentials_t credentials_ = nullptr;
  bool is_good_ = false;
};

ngtcp2_tstamp now() {
  return static_cast<ngtcp2_tstamp>(transport::monotonic_ns());
}

ngtcp2_cid random_id() {
  ngtcp2_cid id;
  id.datalen = kConnectionIdBytes;
  gnutls_rnd(GNUTLS_RND_RANDOM, id.data, id.datalen);
  return id;
}

class QuicEnd final : public LinkEnd {
 public:
  QuicEnd(int socket, bool is_server, const Credentials& credentials, transport::Suite suite)
      : socket_(socket), is_server_(is_server) {
    local_size_ = remote_size_ = sizeof(sockaddr_storage);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&local_), &local_size_);
    getpeername(socket_, reinterpret_cast<sockaddr*>(&remote_), &remote_size_);
    gnutls_init(&session_, is_server ? GNUTLS_SERVER | GNUTLS_NO_AUTO_SEND_TICKET : GNUTLS_CLIENT);
    // Initial packets are sealed by AES-128-GCM whatever is agreed on.
    const char* priority =
        suite == transport::Suite::kAesGcm
            ? "NORMAL:-VERS-ALL:+VERS-TLS1.3:-CIPHER-ALL:+AES-256-GCM:%DISABLE_TLS13_COMPAT_MODE"
            : "NORMAL:-VERS-ALL:+VERS-TLS1.3:-CIPHER-ALL:+CHACHA20-POLY1305:%DISABLE_TLS13_COMPAT_MODE";
    is_good_ = gnutls_priority_set_direct(session_, priority, nullptr) == 0 &&
               gnutls_credentials_set(session_, GNUTLS_CRD_CERTIFICATE, credentials.get()) == 0 &&
               (is_server ? ngtcp2_crypto_gnutls_configure_server_session(session_)
                          : ngtcp2_crypto_gnutls_configure_client_session(session_)) == 0;
    reference_.get_conn = [](ngtcp2_crypto_conn_ref* of) { return static_cast<QuicEnd*>(of->user_data)->connection_; };
    reference_.user_data = this;
    gnutls_session_set_ptr(session_, &reference_);
    if (!is_server) {
      const ngtcp2_cid to = random_id(), from = random_id();
      make_connection(to, from, NGTCP2_PROTO_VER_V1, nullptr);
    }
  }
  QuicEnd(const QuicEnd&) = delete;
  QuicEnd& operator=(const QuicEnd&) = delete;
  ~QuicEnd() override {
    if (connection_ != nullptr) ngtcp2_conn_del(connection_);
    gnutls_deinit(session_);
  }

  bool send(std::span<const std::byte> message) override {
    std::array<std::uint8_t, kMostDatagram> packet;
    ngtcp2_vec data{reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(message.data())), message.size()};
    int is_accepted = 0;
    for (int i = 0; i < kMostPackets && is_accepted == 0; ++i) {
      const ngtcp2_ssize size =
          ngtcp2_conn_writev_datagram(connection_, nullptr, nullptr, packet.data(), packet.size(), &is_accepted,
                                      NGTCP2_WRITE_DATAGRAM_FLAG_NONE, 0, &data, 1, now());
      if (size <= 0) return false;
      put(packet, size);
    }
    return is_accepted != 0;
  }

  std::size_t receive(std::span<std::byte> to) override {
    arrived_ = 0;
    to_ = to;
    if (!read_one()) serve_timers();
    return arrived_;
  }

  void wait_until(std::int64_t until_ns) override { wait_readable(socket_, until_ns); }

  /// One step of the handshake.
  void pump() {
    while (read_one()) {
    }
    if (connection_ == nullptr) return;
    serve_timers();
    write_all();
  }
  [[nodiscard]] bool is_good() const { return is_good_; }
  [[nodiscard]] bool is_connected() const {
    return connection_ != nullptr && ngtcp2_conn_get_handshake_completed(connection_) != 0;
  }

 private:
  static constexpr int kMostPackets = 4;  // that are written beside a message

  void make_connection(const ngtcp2_cid& to, const ngtcp2_cid& from, std::uint32_t version,
                       const ngtcp2_cid* original) {
    ngtcp2_callbacks callbacks{};
    callbacks.client_initial = ngtcp2_crypto_client_initial_cb;
    callbacks.recv_client_initial = ngtcp2_crypto_recv_client_initial_cb;
    callbacks.recv_crypto_data = ngtcp2_crypto_recv_crypto_data_cb;
    callbacks.encrypt = ngtcp2_crypto_encrypt_cb;
    callbacks.decrypt = ngtcp2_crypto_decrypt_cb;
    callbacks.hp_mask = ngtcp2_crypto_hp_mask_cb;
    callbacks.recv_retry = ngtcp2_crypto_recv_retry_cb;
    callbacks.update_key = ngtcp2_crypto_update_key_cb;
    callbacks.delete_crypto_aead_ctx = ngtcp2_crypto_delete_crypto_aead_ctx_cb;
    callbacks.delete_crypto_cipher_ctx = ngtcp2_crypto_delete_crypto_cipher_ctx_cb;
    callbacks.get_path_challenge_data = ngtcp2_crypto_get_path_challenge_data_cb;
    callbacks.version_negotiation = ngtcp2_crypto_version_negotiation_cb;
    callbacks.rand = [](std::uint8_t* bytes, std::size_t size, const ngtcp2_rand_ctx*) {
      gnutls_rnd(GNUTLS_RND_RANDOM, bytes, size);
    };
    callbacks.get_new_connection_id = [](ngtcp2_conn*, ngtcp2_cid* id, std::uint8_t* token, std::size_t size, void*) {
      id->datalen = size;
      gnutls_rnd(GNUTLS_RND_RANDOM, id->data, size);
      gnutls_rnd(GNUTLS_RND_RANDOM, token, NGTCP2_STATELESS_RESET_TOKENLEN);
      return 0;
    };
    callbacks.recv_datagram = [](ngtcp2_conn*, std::uint32_t, const std::uint8_t* bytes, std::size_t size, void* self) {
      static_cast<QuicEnd*>(self)->take(bytes, size);
      return 0;
    };
    ngtcp2_settings settings;
    ngtcp2_settings_default(&settings);
    settings.initial_ts = now();
    ngtcp2_transport_params parameters;
    ngtcp2_transport_params_default(&parameters);
    parameters.max_idle_timeout = 0;
    parameters.max_datagram_frame_size = 65'535;
    if (original != nullptr) parameters.original_dcid = *original;
    const ngtcp2_path path = this->path();
    const int failed = is_server_ ? ngtcp2_conn_server_new(&connection_, &to, &from, &path, version, &callbacks,
                                                           &settings, &parameters, nullptr, this)
                                  : ngtcp2_conn_client_new(&connection_, &to, &from, &path, version, &callbacks,
                                                           &settings, &parameters, nullptr, this);
    is_good_ = is_good_ && failed == 0;
    if (failed == 0) ngtcp2_conn_set_tls_native_handle(connection_, session_);
  }

  ngtcp2_path path() {
    return {{reinterpret_cast<sockaddr*>(&local_), local_size_},
            {reinterpret_cast<sockaddr*>(&remote_), remote_size_},
            nullptr};
  }

  /// Whether a packet was there.
  bool read_one() {
    std::array<std::uint8_t, kMostDatagram> packet;
    const ssize_t size = recv(socket_, packet.data(), packet.size(), MSG_DONTWAIT);
    if (size <= 0) return false;
    if (connection_ == nullptr) {
      ngtcp2_pkt_hd head;
      if (!is_server_ || ngtcp2_accept(&head, packet.data(), static_cast<std::size_t>(size)) != 0) return true;
      make_connection(head.scid, random_id(), head.version, &head.dcid);
    }
    const ngtcp2_path path = this->path();
    const ngtcp2_pkt_info info{};
    const int result =
        ngtcp2_conn_read_pkt(connection_, &path, &info, packet.data(), static_cast<std::size_t>(size), now());
    is_good_ = is_good_ && result == 0;
    return true;
  }

  void write_all() {
    std::array<std::uint8_t, kMostDatagram> packet;
    for (;;) {
      const ngtcp2_ssize size =
          ngtcp2_conn_write_pkt(connection_, nullptr, nullptr, packet.data(), packet.size(), now());
      if (size <= 0) return;
      put(packet, size);
    }
  }

  void serve_timers() {
    if (connection_ == nullptr || ngtcp2_conn_get_expiry(connection_) > now()) return;
    is_good_ = is_good_ && ngtcp2_conn_handle_expiry(connection_, now()) == 0;
    write_all();
  }

  void put(std::span<const std::uint8_t> packet, ngtcp2_ssize size) {
    (void)::send(socket_, packet.data(), static_cast<std::size_t>(size), MSG_DONTWAIT);
  }

  void take(const std::uint8_t* bytes, std::size_t size) {
    arrived_ = std::min(size, to_.size());
    std::copy_n(reinterpret_cast<const std::byte*>(bytes), arrived_, to_.begin());
  }

  int socket_;
  bool is_server_, is_good_ = false;
  sockaddr_storage local_{}, remote_{};
  socklen_t local_size_ = 0, remote_size_ = 0;
  gnutls_session_t session_ = nullptr;
  ngtcp2_crypto_conn_ref reference_{};
  ngtcp2_conn* connection_ = nullptr;
  std::span<std::byte> to_;
  std::size_t arrived_ = 0;
};

class Quic final : public LinkMethod {
 public:
  Quic(ConnectedSockets sockets, transport::Suite suite)
      : sockets_(std::move(sockets)),
        master_(sockets_.master(), false, credentials_, suite),
        slave_(sockets_.slave(), true, credentials_, suite) {}
  /// Empty if both ends agree that it stands.
  std::string connect() {
    if (!credentials_.is_good()) return "GnuTLS makes no certificate";
    const std::int64_t until_ns = transport::monotonic_ns() + kConnect_ns;
    while (transport::monotonic_ns() < until_ns && !(master_.is_connected() && slave_.is_connected())) {
      master_.pump();
      slave_.pump();
      if (!master_.is_good() || !slave_.is_good()) break;
    }
    for (int i = 0; i < 10; ++i) master_.pump(), slave_.pump();  // what the handshake leaves to be confirmed
    return master_.is_connected() && slave_.is_connected() ? "" : "ngtcp2's handshake fails";
  }
  LinkEnd& master() override { return master_; }
  LinkEnd& slave() override { return slave_; }

 private:
  ConnectedSockets sockets_;
  Credentials credentials_;
  QuicEnd master_, slave_;
};

}  // namespace

MadeMethod make_ngtcp2(const TwoEnds& ends, transport::Suite suite) {
  auto sockets = ConnectedSockets::open(ends);
  if (!sockets) return tl::unexpected(sockets.error());
  auto made = std::make_unique<Quic>(std::move(*sockets), suite);
  if (const std::string failed = made->connect(); !failed.empty()) return tl::unexpected(failed);
  return made;
}

}  // namespace farfeel::bench
