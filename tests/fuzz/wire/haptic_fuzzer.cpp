// A history of poses and answers from a peer that may send anything, through the haptic lane's readers and tables.
//
// The input is a list of: u8 what, u8 length, bytes. 0: a message for the pose reader; what it accepts acknowledges.
// 1: a message for the answer reader. 2: the master sends a pose, 3: the slave answers it, honestly, 4: both begin
// anew. What a reader accepts is finite and within range, and an honest answer is read as long as nothing came from
// elsewhere.

#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/haptic_limits.h"
#include "codecs/wire/pose_message.h"

using namespace farfeel;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

struct Ends {
  codecs::PoseGrid grid{{0.1, 0, -0.2}, -22};
  codecs::PoseWriter sent;
  codecs::AnswerWriter writer;
  codecs::AnswerReader reader;
  codecs::PoseMessage asked;
  bool is_honest = true;  // nothing foreign was accepted by the answer reader

  Ends() { begin(); }
  void begin() {
    sent.reset(grid);
    writer.reset(grid);
    reader.reset();
    asked = {};
    is_honest = true;
    send_pose(1);
  }

  void take_pose(std::span<const std::byte> message) {
    codecs::PoseMessage pose;
    if (codecs::read(message, grid, pose) != codecs::Fault::kNone) return;
    demand(spatial::is_valid(pose.X_WT) && spatial::is_finite(pose.V_WT_W) && pose.number != 0);
    demand(pose.time_us >= 0 && pose.ahead_us <= codecs::kMostAhead_us && pose.line.value.allFinite());
    demand(!pose.felt_To_W || spatial::is_finite(*pose.felt_To_W));
    is_honest = is_honest && !pose.heard;  // a lie about what was heard
    writer.acknowledge(pose.heard);
  }

  void take_answer(std::span<const std::byte> message) {
    codecs::AnswerMessage answer;
    if (reader.read(message, sent, answer) != codecs::Fault::kNone) return;
    is_honest = false;
    check(answer);
  }

  static void check(const codecs::AnswerMessage& answer) {
    const contact::ContactSet& set = answer.set;
    demand(set.count <= contact::kMaxContacts && spatial::is_valid(set.X_WT) && spatial::is_finite(set.F_To_W));
    demand(set.pose_time_ns >= 0);
    for (std::uint32_t i = 0; i < set.count; ++i) {
      const contact::Contact& c = set.contacts[i];
      demand(spatial::is_finite(c.p_WC_W) && std::abs(glm::length(c.nhat_ST_W) - 1) < 1e-9);
      demand(std::isfinite(c.depth_m) && c.gradient.allFinite() && c.lateral_range_m >= 0);
      demand(c.gradient.cwiseAbs().maxCoeff() <= codecs::kMaxGradient && (c.doubts & ~codecs::kWireDoubts) == 0);
      demand(c.material.stiffness_N_per_m >= 0 && c.material.stiffness_N_per_m <= codecs::kMaxStiffness_N_per_m);
      demand(c.material.damping_Ns_per_m >= 0 && c.material.damping_Ns_per_m <= codecs::kMaxDamping_Ns_per_m);
      demand(!c.curvature.is_known || c.curvature.matrix().allFinite());
    }
    if (answer.line) demand(answer.line->value.allFinite());
  }

  void send_pose(unsigned seed) {
    codecs::PoseMessage pose;
    pose.sequence = seed;
    pose.X_WT.p = {1e-3 * seed, 0, 0};
    pose.heard = reader.heard(sent);
    std::array<std::byte, 256> bytes;
    const std::size_t size = sent.write(pose, bytes);
    demand(size > 0 && codecs::read(std::span(bytes).first(size), grid, asked) == codecs::Fault::kNone);
    demand(asked.X_WT == sent.find(asked.number)->X_WT);
    writer.acknowledge(asked.heard);
  }

  /// Two bits of each byte say what becomes of a contact.
  void answer(std::span<const std::byte> contacts) {
    codecs::AnswerMessage answer, back;
    answer.set.X_WT = asked.X_WT;
    answer.set.pose_sequence = asked.number;
    for (const std::byte byte : contacts.first(std::min(contacts.size(), contact::kMaxContacts))) {
      const auto bits = std::to_integer<unsigned>(byte);
      contact::Contact& c = answer.set.contacts[answer.set.count++];
      c.id = bits >> 2;
      c.p_WC_W = asked.X_WT.p + glm::dvec3(1e-3 * bits, 0, 0);
      c.nhat_ST_W = {0, 0, 1};
      c.gradient[5] = -1;
      c.material.stiffness_N_per_m = (bits & 1) != 0 ? 2000 : 700;
      c.material.static_friction = (bits & 2) != 0 ? 0.3 : 0.4;
    }
    std::array<std::byte, 1199> bytes;
    const std::size_t size = writer.write(answer, asked.X_WT, bytes);
    demand(size > 0);
    const codecs::Fault fault = reader.read(std::span(bytes).first(size), sent, back);
    demand(!is_honest || fault == codecs::Fault::kNone);
    if (fault == codecs::Fault::kNone) check(back);
    if (!is_honest) return;
    demand(back.set.count + back.left_out == answer.set.count);
    for (std::uint32_t i = 0; i < back.set.count && back.left_out == 0; ++i)
      demand(back.set.contacts[i].id == answer.set.contacts[i].id);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto ends = std::make_unique<Ends>();
  auto rest = std::as_bytes(std::span(bytes, size));
  while (rest.size() >= 2) {
    const auto what = std::to_integer<unsigned>(rest[0]);
    const std::size_t length = std::min<std::size_t>(std::to_integer<std::size_t>(rest[1]), rest.size() - 2);
    const auto message = rest.subspan(2, length);
    rest = rest.subspan(2 + length);
    switch (what % 5) {
      case 0:
        ends->take_pose(message);
        break;
      case 1:
        ends->take_answer(message);
        break;
      case 2:
        ends->send_pose(static_cast<unsigned>(length));
        break;
      case 3:
        ends->answer(message);
        break;
      default:
        ends->begin();
        break;
    }
  }
  return 0;
}
