#include "master_station/devices/driver/inverse3_driver.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {
namespace {

constexpr const char* kDefaultUri = "ws://localhost:10001";
constexpr std::int64_t kInventory_ns = 500'000'000;    // a service on this machine takes some ms
constexpr std::int64_t kGone_ns = 1'000'000'000;       // so long without an answer it is not there any more
constexpr std::int64_t kGripSilence_ns = 100'000'000;  // its radio may miss some
constexpr std::int64_t kLastWord_ns = 5'000'000;

std::string service_uri() {
  const char* const uri = std::getenv("FARFEEL_INVERSE3");
  return uri != nullptr && *uri != '\0' ? uri : kDefaultUri;
}

tl::expected<std::unique_ptr<TextChannel>, std::string> connected(const std::string& uri) {
  const auto address = loopback_address(uri);
  if (!address) return tl::unexpected(address.error());
  return open_websocket(*address);
}

std::vector<FoundDevice> find(const DriverOptions&) {
  const std::string uri = service_uri();
  const auto trouble = [&](std::string what) {
    return std::vector<FoundDevice>{{.model = "inverse3", .serial = {}, .path = uri, .trouble = std::move(what)}};
  };
  const auto channel = connected(uri);
  if (!channel) return trouble(channel.error());
  const std::int64_t end_ns = realtime::monotonic_now_ns() + kInventory_ns;
  std::string_view text;
  const ChannelState state = (*channel)->receive(text, end_ns);
  if (state == ChannelState::kGone) return {};  // no service, or what is at this port is none
  if (state == ChannelState::kNothing)
    return (*channel)->is_open() ? trouble("what listens at " + uri +
                                           " does not say which devices it has: is it Haply's "
                                           "service, 3.1 or later?")
                                 : std::vector<FoundDevice>{};
  const auto update = codecs::decode_inverse3(text);
  if (!update) return trouble("what listens at " + uri + " does not speak as Haply's service does");
  std::vector<FoundDevice> found;
  for (std::size_t i = 0; i < update->arm_count; ++i)
    found.push_back(
        {.model = "inverse3", .serial = std::string(update->arms[i].id.text()), .path = uri, .trouble = {}});
  return found;
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open_found(const FoundDevice& device, const DriverOptions&) {
  auto channel = connected(device.path);
  if (!channel) return tl::unexpected(DeviceError{channel.error()});
  return Inverse3Driver::open(std::move(*channel), device);
}

}  // namespace

const DriverFamily kInverse3Family{"inverse3", find, open_found};

Inverse3Driver::Inverse3Driver(std::unique_ptr<TextChannel> channel, FoundDevice identity, std::int64_t silence_ns)
    : channel_(std::move(channel)), identity_(std::move(identity)), silence_ns_(silence_ns) {}

tl::expected<std::unique_ptr<Driver>, DeviceError> Inverse3Driver::open(std::unique_ptr<TextChannel> channel,
                                                                        FoundDevice identity, std::int64_t silence_ns) {
  std::unique_ptr<Inverse3Driver> driver(new Inverse3Driver(std::move(channel), std::move(identity), silence_ns));
  driver->hear(realtime::monotonic_now_ns() + kInventory_ns);
  if (!driver->is_begun_ || driver->stage_ == Stage::kAbsent) return tl::unexpected(DeviceError{driver->advice()});
  return driver;
}

Inverse3Driver::~Inverse3Driver() {
  if (!channel_->is_open()) return;
  const std::int64_t now_ns = realtime::monotonic_now_ns();
  std::string_view text;
  if (is_begun_) send(glm::dvec3(0), now_ns);
  channel_->receive(text, now_ns + kLastWord_ns);
}

Stage Inverse3Driver::step(std::int64_t deadline_ns, const Command& command, Sample& newest) {
  const std::int64_t now_ns = realtime::monotonic_now_ns();
  if (!command.is_force_on) is_force_to_wait_ = false;
  hear(0);  // what came since
  const bool is_answered = channel_->messages() != messages_at_send_ || sent_ns_ == 0;
  if (!is_answered && now_ns - sent_ns_ > silence_ns_) fault("the service does not answer");
  if (is_answered && stage_ != Stage::kAbsent) {
    const bool is_on = command.is_force_on && stage_ == Stage::kReady && !is_force_to_wait_ &&
                       spatial::is_finite(command.F_hand_B.force_N);
    glm::dvec3 force_N = is_on ? command.F_hand_B.force_N : glm::dvec3(0);
    const double largest = std::max({std::abs(force_N.x), std::abs(force_N.y), std::abs(force_N.z)});
    if (largest > kMaxForce_N) force_N *= kMaxForce_N / largest;  // so that the length below does not overflow
    if (const double length = glm::length(force_N); length > kMaxForce_N) force_N *= kMaxForce_N / length;
    send(force_N, now_ns);
  }
  if (stage_ != Stage::kAbsent) hear(deadline_ns);
  if (now_ns - newest_.polled_ns > kGone_ns) stage_ = Stage::kAbsent;
  if (stage_ != Stage::kReady) is_force_to_wait_ = true;
  newest = newest_;
  newest.stage = stage_;
  return stage_;
}

void Inverse3Driver::send(const glm::dvec3& force_B_N, std::int64_t now_ns) noexcept {
  const std::size_t size = codecs::encode_inverse3_force(text_, identity_.serial, force_B_N);
  const std::uint64_t messages = channel_->messages();
  const ChannelState state = channel_->send({text_.data(), size});
  if (state == ChannelState::kGone) stage_ = Stage::kAbsent;
  if (state != ChannelState::kDone) return;
  messages_at_send_ = messages;
  sent_ns_ = now_ns;
}

void Inverse3Driver::hear(std::int64_t deadline_ns) noexcept {
  std::string_view text;
  const ChannelState state = channel_->receive(text, deadline_ns);
  if (state == ChannelState::kGone) stage_ = Stage::kAbsent;
  if (state == ChannelState::kDone) take(text, realtime::monotonic_now_ns());
}

/// Tells the service at once, too: the next step may be late.
void Inverse3Driver::fault(const char* why) noexcept {
  if (stage_ == Stage::kAbsent) return;
  stage_ = Stage::kFault;
  why_ = why;
  is_force_to_wait_ = true;
  send(glm::dvec3(0), realtime::monotonic_now_ns());
}

void Inverse3Driver::take(std::string_view text, std::int64_t now_ns) noexcept {
  newest_.polled_ns = now_ns;
  const bool is_inventory = !is_begun_;
  is_begun_ = true;
  const auto update = codecs::decode_inverse3(text);
  if (!update) return fault("the service says what is no state of devices: look for a newer Farfeel, or its log");
  const codecs::Inverse3State* const arm = update->arm(identity_.serial);
  if (arm == nullptr) {
    stage_ = Stage::kAbsent;
    return;
  }
  if (is_inventory && update->grip_count > 0) {
    has_grip_ = true;
    grip_ = update->grips[0].id;
    grip_ns_ = now_ns;
  }
  is_turned_ = is_turned_ || arm->has_other_basis;  // only the list of devices tells
  if (is_turned_) return fault("the service has its axes turned: set the basis to XYZ in Haply's Hub");
  if (!arm->has_power) return fault("the arm has no power: plug its supply in");
  if (!arm->has_position) return fault("the service tells no position that can be");
  if (!take_grip(*update, now_ns)) return fault("the VerseGrip tells no orientation: wake it, or charge it");
  newest_.X_BD.p = arm->position_m;
  newest_.time_ns = now_ns;
  ++newest_.reports;
  velocity_.update(newest_.X_BD, now_ns);
  newest_.V_BD_B = velocity_.twist();
  if (arm->has_velocity) newest_.V_BD_B.linear_m_s = arm->velocity_m_s;
  if (!arm->is_calibrated || !arm->is_ready) {
    if (stage_ == Stage::kReady) fault("");
    stage_ = Stage::kHoming;
    why_ = "calibrate the arm: move it as Haply's Hub shows";
    return;
  }
  stage_ = Stage::kReady;
  why_ = nullptr;
}

/// False: the grip that was there is silent. What it said last holds until then.
bool Inverse3Driver::take_grip(const codecs::Inverse3Update& update, std::int64_t now_ns) noexcept {
  if (!has_grip_) return true;
  const auto* const end = update.grips.begin() + update.grip_count;
  const auto* const grip =
      std::find_if(update.grips.begin(), end, [&](const codecs::VerseGripState& is) { return is.id == grip_; });
  if (grip == end || !grip->has_orientation) {
    newest_.buttons = 0;  // a button that holds force on is not held
    return now_ns - grip_ns_ <= kGripSilence_ns;
  }
  grip_ns_ = now_ns;
  newest_.X_BD.R = grip->orientation;
  newest_.buttons = grip->buttons;
  return true;
}

std::string Inverse3Driver::advice() const {
  switch (stage_) {
    case Stage::kReady:
      return {};
    case Stage::kAbsent:
      return channel_->trouble().empty() ? "the service does not tell of this arm any more"
                                         : "Haply's service at " + identity_.path + ": " + channel_->trouble();
    case Stage::kOpening:
      return "waiting for Haply's service at " + identity_.path;
    default:
      return why_ != nullptr ? why_ : "";
  }
}

std::string Inverse3Driver::model_toml() const {
  return has_grip_ ? "title = \"Haply Inverse3 with VerseGrip\"\nrotation_dof = 3\n" : std::string();
}

std::optional<ZeroForce> Inverse3Driver::zero_force() const {
  ZeroForce zero{.fd = channel_->descriptor(), .how = ZeroForce::How::kWrite, .endpoint = 0, .size = 0, .bytes = {}};
  std::array<char, codecs::kInverse3CommandMax> text{};
  const std::size_t size = codecs::encode_inverse3_force(text, identity_.serial, glm::dvec3(0));
  zero.size = codecs::encode_text_frame(zero.bytes, {text.data(), size});
  if (zero.fd < 0 || zero.size == 0) return std::nullopt;
  return zero;
}

}  // namespace farfeel::devices
