// Poses and answers across a lane that loses, delays, doubles and reorders, with contacts that come, go, fade and come
// back: an answer is read as it was meant, or is refused. What was meant is what a lane without any history makes of
// the same set: everything told, nothing acknowledged.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "codecs/wire/answer_message.h"
#include "tests/unit/codecs/wire/random_touch.h"

namespace farfeel::codecs {
namespace {

using Bytes = std::vector<std::byte>;

struct LaneSpec {
  double loss = 0, duplicate = 0;
  int delay_ticks = 0, jitter_ticks = 0;
  double churn = 0.05;  ///< share of contacts that change in an answer
};

/// Datagrams of one direction.
class Impaired {
 public:
  Impaired(const LaneSpec& spec, Random& random) : spec_(spec), random_(random) {}
  void send(const Bytes& bytes, int now) {
    if (is_cut || random_.chance(spec_.loss)) return;
    for (int copies = random_.chance(spec_.duplicate) ? 2 : 1; copies > 0; --copies) {
      const int extra = spec_.jitter_ticks > 0 ? static_cast<int>(random_.number() % spec_.jitter_ticks) : 0;
      under_way_.emplace(now + spec_.delay_ticks + extra, bytes);
    }
  }
  std::vector<Bytes> arriving(int now) {
    std::vector<Bytes> all;
    while (!under_way_.empty() && under_way_.begin()->first <= now) {
      all.push_back(under_way_.begin()->second);
      under_way_.erase(under_way_.begin());
    }
    return all;
  }
  bool is_cut = false;

 private:
  LaneSpec spec_;
  Random& random_;
  std::multimap<int, Bytes> under_way_;
};

/// Contacts of which some come, go and come back, and some fade.
class Touch {
 public:
  explicit Touch(Random& random, double churn) : random_(random), churn_(churn) {
    for (std::size_t i = 0; i < kPool; ++i) {
      pool_[i] = random_contact(random, {});
      pool_[i].id = static_cast<std::uint32_t>(i % 90);  // some ids are of two objects
      if (i % 3 != 0) {                                  // most are of a few objects, each of one material
        pool_[i].object = static_cast<std::uint32_t>(i % 5);
        pool_[i].material = {2000 + 100 * static_cast<double>(i % 5), 0.5, 0.3, 0.25};
      }
      is_there_[i] = i < 7;
    }
  }
  contact::ContactSet at(const spatial::Pose& X_WT) {
    contact::ContactSet set = random_set(random_, X_WT, 0);
    for (std::size_t i = 0; i < kPool; ++i) {
      if (random_.chance(is_there_[i] ? churn_ : churn_ * 7 / (kPool - 7))) is_there_[i] = !is_there_[i];
      if (random_.chance(0.2 * churn_)) pool_[i].material.static_friction = random_.real(0, 1);
      if (random_.chance(churn_)) share_[i] = random_.chance(0.5) ? 1 : random_.real(0, 1);
      if (!is_there_[i] || set.count == contact::kMaxContacts) continue;
      contact::Contact& c = set.contacts[set.count++];
      c = random_contact(random_, X_WT);
      c.id = pool_[i].id;
      c.object = pool_[i].object;
      c.material = pool_[i].material;
      c.material.stiffness_N_per_m *= share_[i];
      c.material.damping_Ns_per_m *= share_[i];
    }
    return set;
  }

 private:
  static constexpr std::size_t kPool = 120;
  Random& random_;
  double churn_;
  std::array<contact::Contact, kPool> pool_;
  std::array<bool, kPool> is_there_{};
  std::array<double, kPool> share_ = [] {
    std::array<double, kPool> ones{};
    ones.fill(1);
    return ones;
  }();
};

void expect_as_meant(const contact::ContactSet& meant, const contact::ContactSet& read) {
  ASSERT_EQ(meant.count, read.count);
  ASSERT_EQ(meant.X_WT, read.X_WT);
  for (std::uint32_t i = 0; i < meant.count; ++i) {
    const contact::Contact &a = meant.contacts[i], &b = read.contacts[i];
    ASSERT_EQ(a.id, b.id);
    ASSERT_EQ(a.object, b.object);
    ASSERT_EQ(a.p_WC_W, b.p_WC_W);
    ASSERT_EQ(a.nhat_ST_W, b.nhat_ST_W);
    ASSERT_EQ(a.depth_m, b.depth_m);
    ASSERT_EQ(a.gradient, b.gradient);
    ASSERT_EQ(a.doubts, b.doubts);
    ASSERT_EQ(a.lateral_range_m, b.lateral_range_m);
    ASSERT_EQ(a.material.static_friction, b.material.static_friction);
    ASSERT_EQ(a.material.dynamic_friction, b.material.dynamic_friction);
    // A share of what was told before is a half.
    ASSERT_NEAR(a.material.stiffness_N_per_m, b.material.stiffness_N_per_m, 5e-4 * a.material.stiffness_N_per_m);
    ASSERT_NEAR(a.material.damping_Ns_per_m, b.material.damping_Ns_per_m, 1.5e-3 * a.material.damping_Ns_per_m);
  }
}

/// What a set is on the wire's grid.
contact::ContactSet as_told(const AnswerMessage& answer, const PoseMessage& asked, const PoseGrid& grid) {
  PoseWriter sent;
  sent.reset(grid);
  std::array<std::byte, 256> pose;
  PoseMessage same = asked;
  EXPECT_GT(sent.write(same, pose), 0u);
  AnswerWriter writer;
  writer.reset(grid);
  AnswerReader reader;
  AnswerMessage m = answer, back;
  m.set.pose_sequence = 1;
  std::array<std::byte, 4096> bytes;
  const std::size_t size = writer.write(m, asked.X_WT, bytes);
  EXPECT_EQ(reader.read(std::span(bytes).first(size), sent, back), Fault::kNone);
  return back.set;
}

struct Outcome {
  int written = 0, read = 0, old = 0, without_base = 0, other = 0;
  double bytes = 0, contacts = 0;
};

Outcome storm(const LaneSpec& spec, unsigned seed, int ticks,
              const std::function<void(int, Impaired&, Impaired&)>& at = {},
              const std::function<bool(int)>& resets_reader = {}) {
  Random random(seed);
  const PoseGrid grid;
  Impaired up(spec, random), down(spec, random);
  Touch touch(random, spec.churn);
  PoseWriter sent;
  sent.reset(grid);
  AnswerWriter writer;
  writer.reset(grid);
  AnswerReader reader;
  std::map<std::uint32_t, contact::ContactSet> meant;
  std::uint32_t newest_pose = 0;
  Outcome outcome;
  for (int now = 0; now < ticks; ++now) {
    if (at) at(now, up, down);
    if (resets_reader && resets_reader(now)) reader.reset();
    PoseMessage pose = random_pose(random);
    pose.heard = reader.heard(sent);
    std::array<std::byte, 256> pose_bytes;
    const std::size_t pose_size = sent.write(pose, pose_bytes);
    up.send({pose_bytes.begin(), pose_bytes.begin() + static_cast<std::ptrdiff_t>(pose_size)}, now);
    for (const Bytes& bytes : up.arriving(now)) {
      PoseMessage asked;
      EXPECT_EQ(read(bytes, grid, asked), Fault::kNone);
      if (!resets_reader || asked.number > newest_pose) writer.acknowledge(asked.heard);
      if (asked.number <= newest_pose) continue;
      newest_pose = asked.number;
      AnswerMessage answer;
      answer.set = touch.at(asked.X_WT);
      answer.set.pose_sequence = asked.number;
      std::array<std::byte, 1199> answer_bytes;
      const std::size_t size = writer.write(answer, asked.X_WT, answer_bytes);
      EXPECT_GT(size, 0u);
      down.send({answer_bytes.begin(), answer_bytes.begin() + static_cast<std::ptrdiff_t>(size)}, now);
      if (!down.is_cut) meant[writer.number()] = as_told(answer, asked, grid);
      ++outcome.written;
      outcome.bytes += static_cast<double>(size);
      outcome.contacts += answer.set.count;
    }
    for (const Bytes& bytes : down.arriving(now)) {
      AnswerMessage answer;
      const Fault fault = reader.read(bytes, sent, answer);
      outcome.read += fault == Fault::kNone;
      outcome.old += fault == Fault::kOld;
      outcome.without_base += fault == Fault::kNoBase;
      outcome.other += fault == Fault::kLength || fault == Fault::kRange || fault == Fault::kNotFinite;
      if (fault != Fault::kNone) continue;
      contact::ContactSet wanted = meant.at(answer.number);
      if (answer.left_out > 0) continue;  // as_told() has room for all
      expect_as_meant(wanted, answer.set);
      if (::testing::Test::HasFatalFailure()) return outcome;
    }
  }
  return outcome;
}

TEST(LostAnswers, AreReadAsTheyWereMeantOrAreOld) {
  unsigned seed = 1;
  for (const double loss : {0.0, 0.05, 0.5, 0.95}) {
    for (const auto& [delay, jitter] : {std::pair(0, 0), {1, 0}, {20, 5}, {100, 60}, {3, 300}}) {
      for (const double churn : {0.0, 0.02, 0.3}) {
        const LaneSpec spec{loss, 0.1, delay, jitter, churn};
        const Outcome outcome = storm(spec, seed++, 1500);
        if (HasFatalFailure()) return;
        EXPECT_EQ(outcome.without_base + outcome.other, 0) << loss << ' ' << delay << ' ' << churn;
        EXPECT_GT(outcome.read, 0);
        if (loss < 0.1 && jitter < 100 && churn == 0) {
          EXPECT_LT(outcome.bytes, 1.35 * (35 * outcome.written + 36 * outcome.contacts)) << "known soon";
        }
      }
    }
  }
}

TEST(LostAnswers, SilencesOfOneDirectionDoNoHarm) {
  // Longer than what is remembered at either end.
  for (const int silence : {3000, 40000}) {
    for (const bool is_down : {false, true}) {
      const LaneSpec spec{0.02, 0.02, 10, 5, 0.02};
      const Outcome outcome = storm(spec, 7, silence + 3000, [&](int now, Impaired& up, Impaired& down) {
        (is_down ? down : up).is_cut = now > 1000 && now <= 1000 + silence;
      });
      if (HasFatalFailure()) return;
      EXPECT_EQ(outcome.without_base + outcome.other, 0) << silence;
      EXPECT_GT(outcome.read, 1300) << "of 4000, many of which others have overtaken";
    }
  }
}

TEST(LostAnswers, AnAnswerIsNotTakenForOneThatIs65536Older) {
  // None is lost on the way up, so the slave has as many answers more, some of them just now, of which none came.
  const LaneSpec spec{0, 0, 10, 0, 0.0005};
  const Outcome outcome = storm(
      spec, 5, 70000, [&](int now, Impaired&, Impaired& down) { down.is_cut = now > 1000 && now <= 1000 + 66000; });
  EXPECT_EQ(outcome.without_base + outcome.other, 0);
  EXPECT_GT(outcome.read, 3000);
}

TEST(LostAnswers, AReaderThatForgetsIsToldAnew) {
  // No session does that; should one, nothing wrong is read, and soon all is read again.
  const LaneSpec spec{0.05, 0.05, 10, 5, 0.02};
  const Outcome outcome = storm(spec, 3, 6000, {}, [](int now) { return now % 1000 == 999; });
  EXPECT_EQ(outcome.other, 0);
  EXPECT_GT(outcome.without_base, 0);
  EXPECT_LT(outcome.without_base, 6 * 80);
}

TEST(LostAnswers, SessionsAfterEachOtherHaveNothingInCommon) {
  Random random(11);
  PoseWriter sent;
  AnswerWriter writer;
  AnswerReader reader;
  Touch touch(random, 0.02);
  std::optional<std::uint16_t> of_last_session;
  for (int session = 0; session < 5; ++session) {
    const PoseGrid grid{random.vector(1), -22};
    sent.reset(grid);
    writer.reset(grid);
    reader.reset();
    EXPECT_FALSE(reader.heard(sent));
    if (of_last_session) writer.acknowledge(of_last_session);
    for (int i = 0; i < 50; ++i) {
      PoseMessage pose = random_pose(random), asked;
      pose.heard = reader.heard(sent);
      std::array<std::byte, 1199> bytes;
      ASSERT_EQ(read(std::span(bytes).first(sent.write(pose, bytes)), grid, asked), Fault::kNone);
      writer.acknowledge(asked.heard);
      AnswerMessage answer, back;
      answer.set = touch.at(asked.X_WT);
      answer.set.pose_sequence = asked.number;
      const std::size_t size = writer.write(answer, asked.X_WT, bytes);
      ASSERT_EQ(reader.read(std::span(bytes).first(size), sent, back), Fault::kNone);
      expect_as_meant(as_told(answer, asked, grid), back.set);
    }
    of_last_session = reader.heard(sent);
  }
}

}  // namespace
}  // namespace farfeel::codecs
