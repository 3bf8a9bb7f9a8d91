// What the service of Haply's Inverse3 says and is told, on its simulation channel (a WebSocket, ws://localhost:10001).
//
// From the maker's documentation (docs.haply.co, Inverse SDK 3.5, "WebSocket Protocol", "Simulation Channel", "Basis")
// and from public programs that use it:
//   - After the connection the service sends an inventory of all devices: config, state and status. Then it sends one
//     update (state and status) for each message that it gets, and nothing else.
//   - Arrays "inverse3", "wireless_verse_grip" and "verse_grip" of devices, each with a "device_id".
//   - inverse3: state.cursor_position [m], state.cursor_velocity [m/s], status.calibrated, status.ready,
//     status.power_supply, config.basis.permutation. Grips: state.orientation (w, x, y, z), state.buttons.a, b, c, or
//     state.button of the one with a cable.
//   - inverse3[].commands.set_cursor_force.values [N]: x, y, z.
//   - Axes, unless the basis was changed: right-handed, x right, y forward, z up, which is our frame B.
// Which of them older services lack is not known here: what is absent is told as such.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <span>
#include <string_view>

namespace farfeel::codecs {

inline constexpr std::size_t kInverse3IdMax = 24;  ///< of device_id; "049D" is usual
inline constexpr std::size_t kInverse3DevicesMax = 4;

struct Inverse3Id {
  std::array<char, kInverse3IdMax> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::string_view text() const noexcept { return {bytes.data(), size}; }
  friend bool operator==(const Inverse3Id& a, const Inverse3Id& b) noexcept { return a.text() == b.text(); }
};

struct Inverse3State {
  Inverse3Id id;
  bool has_position = false, has_velocity = false;  ///< all three numbers were there, finite, and what an arm can do
  glm::dvec3 position_m{0}, velocity_m_s{0};        ///< of the handle's tip, in the service's basis
  bool is_calibrated = true, is_ready = true, has_power = true;  ///< what the status does not say is well
  bool has_other_basis = false;                                  ///< config told one that is not XYZ
};

struct VerseGripState {
  Inverse3Id id;
  bool has_orientation = false;
  glm::dquat orientation{1, 0, 0, 0};  ///< of unit length
  std::uint32_t buttons = 0;           ///< a, b, c are bits 0, 1, 2
};

struct Inverse3Update {
  std::array<Inverse3State, kInverse3DevicesMax> arms;
  std::size_t arm_count = 0;  ///< further ones are left out, as are those without an id that fits
  std::array<VerseGripState, kInverse3DevicesMax> grips;
  std::size_t grip_count = 0;  ///< those without a cable first

  [[nodiscard]] const Inverse3State* arm(std::string_view id) const noexcept;
};

/// Nothing where the text is not JSON or its known members have other types. Any bytes; allocates nothing.
[[nodiscard]] std::optional<Inverse3Update> decode_inverse3(std::string_view json) noexcept;

inline constexpr std::size_t kInverse3CommandMax = 224;
/// As text; its size. The force is finite and at most 100 N in each axis. Allocates nothing.
[[nodiscard]] std::size_t encode_inverse3_force(std::span<char, kInverse3CommandMax> text, std::string_view id,
                                                const glm::dvec3& force_N) noexcept;

/// One whole WebSocket frame (RFC 6455) of a client, of text, masked with zeros, at most 65535 bytes; its size, 0:
/// there is no room. For whoever holds nothing but the socket.
[[nodiscard]] std::size_t encode_text_frame(std::span<std::byte> frame, std::string_view text) noexcept;

}  // namespace farfeel::codecs
