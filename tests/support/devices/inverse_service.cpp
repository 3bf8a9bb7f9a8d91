#include "tests/support/devices/inverse_service.h"

#include <libwebsockets.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {

using nlohmann::json;

struct InverseService::Server {
  struct Frame {
    std::string bytes;
    int flags;
  };

  explicit Server(InverseService& service) : is(service) {
    lws_set_log_level(0, nullptr);
    lws_context_creation_info info{};
    protocols[0].name = "inverse";
    protocols[0].callback = &Server::callback;
    protocols[0].rx_buffer_size = 8192;
    info.port = 0;
    info.iface = "127.0.0.1";
    info.protocols = protocols.data();
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.user = this;
    context = lws_create_context(&info);
    if (context == nullptr) throw std::runtime_error("the imitated service does not start");
    port = lws_get_vhost_listen_port(lws_get_vhost_by_name(context, "default"));
    thread = std::thread([this] {
      while (!stops) lws_service(context, 0);
    });
  }
  ~Server() {
    stops = true;
    lws_cancel_service(context);
    thread.join();
    lws_context_destroy(context);
  }

  static int callback(lws* socket, lws_callback_reasons reason, void*, void* bytes, std::size_t size) {
    lws_context* const context = lws_get_context(socket);
    auto* const self = context != nullptr ? static_cast<Server*>(lws_context_user(context)) : nullptr;
    return self != nullptr ? self->on(socket, reason, static_cast<const char*>(bytes), size) : 0;
  }

  // One client at a time is enough: a new one replaces the queue.
  int on(lws* socket, lws_callback_reasons reason, const char* bytes, std::size_t size) {
    switch (reason) {
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return is.refuses_ ? -1 : 0;
      case LWS_CALLBACK_ESTABLISHED:
        client = socket;
        frames.clear();
        asked.clear();
        if (is.fault_ != Fault::kSilence) send(socket, inventory().dump());
        return 0;
      case LWS_CALLBACK_CLOSED:
        if (client == socket) client = nullptr;
        return 0;
      case LWS_CALLBACK_RECEIVE:
        asked.append(bytes, size);
        if (lws_is_final_fragment(socket) == 0 || lws_remaining_packet_payload(socket) > 0) return 0;
        obey(asked);
        asked.clear();
        return answer(socket);
      case LWS_CALLBACK_SERVER_WRITEABLE: {
        if (socket != client || frames.empty()) return 0;
        std::vector<unsigned char> buffer(LWS_PRE + frames.front().bytes.size());
        std::copy(frames.front().bytes.begin(), frames.front().bytes.end(), buffer.begin() + LWS_PRE);
        const int flags = frames.front().flags;
        const std::size_t length = frames.front().bytes.size();
        frames.pop_front();
        if (lws_write(socket, buffer.data() + LWS_PRE, length, static_cast<lws_write_protocol>(flags)) < 0) return -1;
        if (!frames.empty()) lws_callback_on_writable(socket);
        return 0;
      }
      default:
        return 0;
    }
  }

  void obey(const std::string& text) {
    ++is.messages_;
    const json message = json::parse(text, nullptr, false);
    const std::scoped_lock lock(mutex);
    advance();
    try {
      const json& arm = message.at("inverse3").at(0);
      if (arm.at("device_id") != "049D") throw std::invalid_argument("another device");
      const json& values = arm.at("commands").at("set_cursor_force").at("values");
      force_N = {values.at("x"), values.at("y"), values.at("z")};
      for (const double f : force_N) greatest_N = std::max(greatest_N, std::abs(f));
    } catch (const std::exception&) {
      ++is.unreadable_;
    }
  }

  int answer(lws* socket) {
    const Fault fault = is.fault_;
    if (fault == Fault::kHangUp) return -1;
    if (fault == Fault::kSilence) return 0;
    json now = state(false);
    json& position = now["inverse3"][0]["state"]["cursor_position"];
    json& status = now["inverse3"][0]["status"];
    if (fault == Fault::kFar) position["x"] = 1e6;
    if (fault == Fault::kNull) position = nullptr;
    if (fault == Fault::kNotCalibrated) status["calibrated"] = false;
    if (fault == Fault::kNoPower) status["power_supply"] = false;
    if (fault == Fault::kNoArm) now["inverse3"] = json::array();
    std::string text = now.dump();
    if (fault == Fault::kOld) {
      before.push_back(text);
      if (before.size() > 3) before.pop_front();
      if (is.messages_ % 2 == 0) text = before.front();
    }
    if (fault == Fault::kTornText) text.resize(text.size() / 2);
    if (fault == Fault::kOtherText) text = R"({"inverse3":{"device_id":["049D"]},"wireless_verse_grip":7})";
    if (fault == Fault::kHuge) text = "{\"x\":\"" + std::string(200'000, 'x') + "\"}";
    if (fault == Fault::kPings) frames.push_back({"ping", LWS_WRITE_PING});
    if (fault == Fault::kFragments) {
      for (std::size_t at = 0; at < text.size(); at += 50) {
        const bool is_last = at + 50 >= text.size();
        frames.push_back({text.substr(at, 50),
                          (at == 0 ? LWS_WRITE_TEXT : LWS_WRITE_CONTINUATION) | (is_last ? 0 : LWS_WRITE_NO_FIN)});
      }
      lws_callback_on_writable(socket);
      return 0;
    }
    send(socket, text);
    return 0;
  }

  void send(lws* socket, const std::string& text) {
    frames.push_back({text, LWS_WRITE_TEXT});
    lws_callback_on_writable(socket);
  }

  json inventory() {
    json all = state(true);
    if (is.fault_ == Fault::kNoArm) all["inverse3"] = json::array();
    return all;
  }

  json state(bool is_inventory) {
    const std::scoped_lock lock(mutex);
    advance();
    const auto vector = [](const std::array<double, 3>& v) { return json{{"x", v[0]}, {"y", v[1]}, {"z", v[2]}}; };
    json arm = {{"device_id", "049D"},
                {"state",
                 {{"cursor_position", vector(p_m)},
                  {"cursor_velocity", vector(v_m_s)},
                  {"current_cursor_force", vector(force_N)},
                  {"control_mode", "force"}}},
                {"status", {{"calibrated", true}, {"in_use", true}, {"power_supply", true}, {"ready", true}}}};
    if (is_inventory)
      arm["config"] = {{"type", "inverse3"}, {"handedness", "right"}, {"basis", {{"permutation", basis}}}};
    json all = {{"inverse3", json::array({arm})}, {"wireless_verse_grip", json::array()}};
    if (is_inventory) all["session_id"] = 7;
    const unsigned down = is.buttons_;
    if (is.has_grip_)
      all["wireless_verse_grip"].push_back(
          {{"device_id", "61576"},
           {"state",
            {{"orientation", {{"w", 0.5}, {"x", 0.5}, {"y", 0.5}, {"z", 0.5}}},
             {"buttons", {{"a", (down & 1U) != 0}, {"b", (down & 2U) != 0}, {"c", (down & 4U) != 0}}},
             {"hall", 0}}}});
    return all;
  }

  void advance() {
    constexpr std::int64_t kStep_ns = 250'000;
    const std::int64_t to_ns = realtime::monotonic_now_ns();
    if (now_ns == 0 || to_ns - now_ns > 1'000'000'000) now_ns = to_ns;
    for (; now_ns + kStep_ns <= to_ns; now_ns += kStep_ns)
      for (std::size_t i = 0; i < 3; ++i) {
        v_m_s[i] += 1e-9 * kStep_ns *
                    (force_N[i] - kStiffness_N_per_m * (p_m[i] - held_m[i]) - kDamping_Ns_per_m * v_m_s[i]) / kMass_kg;
        p_m[i] += 1e-9 * kStep_ns * v_m_s[i];
      }
  }

  InverseService& is;
  std::array<lws_protocols, 2> protocols{};
  lws_context* context = nullptr;
  int port = 0;
  std::atomic<bool> stops{false};
  lws* client = nullptr;
  std::deque<Frame> frames;
  std::deque<std::string> before;
  std::string asked;
  std::mutex mutex;  ///< for what follows
  std::string basis = "XYZ";
  std::array<double, 3> p_m{}, v_m_s{}, force_N{}, held_m{};
  double greatest_N = 0;
  std::int64_t now_ns = 0;
  std::thread thread;
};

InverseService::InverseService() : server_(std::make_unique<Server>(*this)) {}
InverseService::~InverseService() = default;

std::string InverseService::uri() const {
  return "ws://localhost:" + std::to_string(server_->port);
}

void InverseService::set_basis(const std::string& permutation) {
  const std::scoped_lock lock(server_->mutex);
  server_->basis = permutation;
}

void InverseService::hold_at(const std::array<double, 3>& p_m) {
  const std::scoped_lock lock(server_->mutex);
  server_->held_m = p_m;
  if (server_->now_ns == 0) server_->p_m = p_m;
}

std::array<double, 3> InverseService::force_N() const {
  const std::scoped_lock lock(server_->mutex);
  return server_->force_N;
}

std::array<double, 3> InverseService::position_m() const {
  const std::scoped_lock lock(server_->mutex);
  return server_->p_m;
}

double InverseService::greatest_force_N() {
  const std::scoped_lock lock(server_->mutex);
  return std::exchange(server_->greatest_N, 0.0);
}

}  // namespace farfeel::devices
