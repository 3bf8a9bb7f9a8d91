// Objects over a bad link: exact, once, by priority, superseded, resumed, refused, within bounds.

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "tests/unit/transport/bulk/bulk_lab.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

LabOptions bad_link(std::uint64_t seed) {
  LabOptions options;
  LinkSpec& path = options.link.path;
  path.rate_bit_per_s = 50e6;
  path.round_trip_ns = 20'000'000;
  path.queue_ns = 50'000'000;
  path.loss = 0.03, path.burst = 4;
  path.reorder = path.duplicate = 0.03;
  options.has_haptic = false;
  options.seed = seed;
  return options;
}

struct Delivered {
  explicit Delivered(BulkLab& lab) {
    lab.on_object = [this](ReceivedObject object) {
      EXPECT_EQ(hash_of(object.object->bytes()), object.hash);
      order.push_back(object.slot);
      newest[object.slot] = object.hash;
    };
  }
  std::vector<std::uint32_t> order;
  std::map<std::uint32_t, ObjectHash> newest;
};

ObjectOutbox& outbox(BulkLab& lab) {
  return lab.lane(BulkLab::kSlave).outbox();
}

TEST(BulkObjects, SeveralArriveExactlyAndOnce) {
  BulkLab lab(bad_link(1));
  Delivered delivered(lab);
  std::vector<std::shared_ptr<const Object>> objects;
  for (std::uint32_t i = 0; i < 12; ++i) {
    // Sizes around the borders of granules, pieces and words of the map.
    const std::size_t sizes[] = {1, 15, 16, 17, 1167, 1168, 1169, 64 * 16, 64 * 16 + 1, 300'000, 1'000'003, 2'000'000};
    objects.push_back(random_object(sizes[i], i));
    outbox(lab).offer(i, objects[i], 100, lab.now_ns());
  }
  lab.run_until(lab.now_ns() + 8 * kSecond);
  ASSERT_EQ(delivered.order.size(), objects.size());
  for (std::uint32_t i = 0; i < objects.size(); ++i) {
    EXPECT_EQ(delivered.newest[i], objects[i]->hash);
    EXPECT_EQ(outbox(lab).status(i), ObjectOutbox::Status::kComplete);
  }
  EXPECT_EQ(lab.scene->free_bytes(), 4 * kMaxObjectBytes);  // nobody holds them
}

TEST(BulkObjects, TheMoreUrgentOneOvertakes) {
  BulkLab lab(bad_link(2));
  Delivered delivered(lab);
  outbox(lab).offer(1, random_object(3'000'000, 1), 100, lab.now_ns());
  lab.run_until(lab.now_ns() + kSecond / 3);
  outbox(lab).offer(2, random_object(200'000, 2), 10, lab.now_ns());
  lab.run_until(lab.now_ns() + 5 * kSecond);
  EXPECT_EQ(delivered.order, (std::vector<std::uint32_t>{2, 1}));
}

TEST(BulkObjects, WhatIsSupersededIsNotDeliveredAndItsRoomIsFree) {
  LabOptions options = bad_link(3);
  options.master.inbox.peer_bytes = 3'000'000;
  BulkLab lab(options);
  Delivered delivered(lab);
  for (std::uint64_t version = 0; version < 5; ++version) {
    outbox(lab).offer(7, random_object(2'500'000, version), 100, lab.now_ns());
    lab.run_until(lab.now_ns() + kSecond / 5);
  }
  lab.run_until(lab.now_ns() + 5 * kSecond);
  EXPECT_EQ(delivered.order.size(), 1u);
  EXPECT_EQ(delivered.newest[7], random_object(2'500'000, 4)->hash);
  EXPECT_GE(lab.lane(BulkLab::kMaster).inbox().counters().superseded, 2u);
}

TEST(BulkObjects, WhatIsWithdrawnIsForgottenAtBothEnds) {
  BulkLab lab(bad_link(4));
  Delivered delivered(lab);
  outbox(lab).offer(1, random_object(3'000'000, 1), 100, lab.now_ns());
  lab.run_until(lab.now_ns() + kSecond / 4);
  EXPECT_GT(lab.lane(BulkLab::kMaster).inbox().progress().here, 0u);
  outbox(lab).withdraw(1, lab.now_ns());
  lab.run_until(lab.now_ns() + kSecond);
  EXPECT_EQ(lab.lane(BulkLab::kMaster).inbox().progress().all, 0u);
  EXPECT_EQ(lab.scene->free_bytes(), 4 * kMaxObjectBytes);
  EXPECT_EQ(outbox(lab).next_statement_ns(), kNever_ns);  // nothing more is said
  EXPECT_TRUE(delivered.order.empty());
}

TEST(BulkObjects, AreResumedInALaterSession) {
  BulkLab lab(bad_link(5));
  Delivered delivered(lab);
  const auto object = random_object(4'000'000, 1);
  outbox(lab).offer(1, object, 100, lab.now_ns());
  lab.run_until(lab.now_ns() + kSecond * 6 / 10);
  const std::uint64_t before = lab.lane(BulkLab::kMaster).inbox().progress().here;
  ASSERT_GT(before, 500'000u);
  ASSERT_LT(before, 4'000'000u);
  lab.new_session(true, false);  // another life of the slave
  outbox(lab).offer(3, object, 100, lab.now_ns());
  lab.run_until(lab.now_ns() + 4 * kSecond);
  EXPECT_EQ(delivered.order, (std::vector<std::uint32_t>{3}));
  EXPECT_EQ(lab.lane(BulkLab::kMaster).inbox().counters().resumed, 1u);
  EXPECT_LT(outbox(lab).counters().sent_bytes, 4'000'000 - before + 600'000);
}

TEST(BulkObjects, WhatWasDeliveredIsNotDeliveredAgainInALaterSession) {
  BulkLab lab(bad_link(6));
  Delivered delivered(lab);
  outbox(lab).offer(1, random_object(200'000, 1), 100, lab.now_ns());
  lab.run_until(lab.now_ns() + 2 * kSecond);
  lab.new_session(false, false);
  lab.run_until(lab.now_ns() + 2 * kSecond);
  EXPECT_EQ(delivered.order.size(), 1u);
  EXPECT_EQ(outbox(lab).status(1), ObjectOutbox::Status::kComplete);
  lab.new_session(false, true);  // a new master has nothing
  lab.run_until(lab.now_ns() + 2 * kSecond);
  EXPECT_EQ(delivered.order.size(), 2u);
}

TEST(BulkObjects, ACorruptOneStartsOverAndIsRefusedInTheEnd) {
  LabOptions options = bad_link(7);
  BulkLab lab(options);
  Delivered delivered(lab);
  int corrupted = 0, most = 1;
  // Beyond what a seal lets through: a bit of the first piece.
  lab.on_wire = [&](BulkLab::End, std::vector<std::byte>& m) {
    if (m[0] == static_cast<std::byte>(BulkType::kObjectPiece) && m[14] == std::byte{0} && corrupted < most)
      m[100] ^= std::byte{1}, ++corrupted;
    return true;
  };
  outbox(lab).offer(1, random_object(100'000, 1), 100, lab.now_ns());
  lab.run_until(lab.now_ns() + 3 * kSecond);
  EXPECT_EQ(delivered.order.size(), 1u);
  EXPECT_EQ(lab.lane(BulkLab::kMaster).inbox().counters().corrupt, 1u);
  corrupted = 0, most = 1'000'000;
  outbox(lab).offer(1, random_object(100'000, 2), 100, lab.now_ns());
  lab.run_until(lab.now_ns() + 3 * kSecond);
  EXPECT_EQ(delivered.order.size(), 1u);
  EXPECT_EQ(outbox(lab).reason(1), RefusedBecause::kCorrupt);
}

TEST(BulkObjects, WhatDoesNotFitIsRefusedWithTheReasonAndComesWhenThereIsRoom) {
  LabOptions options = bad_link(8);
  options.master.inbox.object_bytes = 1'000'000;
  options.scene_bytes = 1'500'000;
  BulkLab lab(options);
  std::vector<ReceivedObject> kept;
  lab.on_object = [&](ReceivedObject object) { kept.push_back(std::move(object)); };
  outbox(lab).offer(1, random_object(1'000'001, 1), 100, lab.now_ns());
  outbox(lab).offer(2, random_object(900'000, 2), 100, lab.now_ns());
  outbox(lab).offer(3, random_object(800'000, 3), 100, lab.now_ns());
  lab.run_until(lab.now_ns() + 2 * kSecond);
  EXPECT_EQ(outbox(lab).reason(1), RefusedBecause::kTooLarge);
  EXPECT_EQ(outbox(lab).status(2), ObjectOutbox::Status::kComplete);
  EXPECT_EQ(outbox(lab).reason(3), RefusedBecause::kNoRoom);  // the second is still held
  kept.clear();
  lab.run_until(lab.now_ns() + 3 * kSecond);
  EXPECT_EQ(outbox(lab).status(3), ObjectOutbox::Status::kComplete);
}

TEST(BulkObjects, ALateOlderOfferChangesNothing) {
  ObjectInbox inbox({}, std::make_shared<ByteBudget>(kMaxObjectBytes));
  const auto older = random_object(1000, 1), newer = random_object(64, 2);
  inbox.on_offer({2, 1, 1, 64, newer->hash});
  inbox.on_piece({2, 0, std::span(newer->bytes).first(32)});
  inbox.on_offer({1, 1, 1, 1000, older->hash});
  inbox.on_piece({1, 0, std::span(older->bytes).first(16)});
  inbox.on_piece({2, 2, std::span(newer->bytes).subspan(32)});
  const auto object = inbox.take_object();
  ASSERT_TRUE(object);
  EXPECT_EQ(object->hash, newer->hash);
  bool said_gone = false;
  while (const auto answer = inbox.take_answer()) said_gone |= answer->id == 1 && answer->state == ObjectState::kGone;
  EXPECT_TRUE(said_gone);
}

/// 37 kB/s of offers once pinned a thread that zeroed 64 MiB for each: memory is reserved, and never written to.
TEST(BulkObjects, AFloodOfOffersCostsNoMoreThanItsBudget) {
  auto scene = std::make_shared<ByteBudget>(2 * kMaxObjectBytes);
  ObjectInbox inbox({}, scene);
  for (std::uint32_t id = 1; id <= 5000; ++id) {
    ObjectHash hash{};
    std::memcpy(hash.data(), &id, sizeof id);
    inbox.on_offer({id, id % 300, 1, kMaxObjectBytes, hash});
  }
  EXPECT_LE(inbox.progress().all, 2 * kMaxObjectBytes);
  int answers = 0;
  while (inbox.take_answer()) ++answers;
  EXPECT_LE(answers, 64);
}

TEST(BulkObjects, PiecesThatDoNotFitChangeNothing) {
  ObjectInbox inbox({}, std::make_shared<ByteBudget>(kMaxObjectBytes));
  const auto object = random_object(100, 1);
  inbox.on_offer({1, 1, 1, 100, object->hash});
  const std::span<const std::byte> bytes(object->bytes);
  inbox.on_piece({2, 0, bytes.first(16)});
  inbox.on_piece({1, 0, bytes.first(17)});
  inbox.on_piece({1, 6, bytes.first(5)});
  inbox.on_piece({1, 7, bytes.first(16)});
  inbox.on_piece({1, 0xFFFF'FFFF, bytes.first(16)});
  EXPECT_EQ(inbox.progress().here, 0u);
  inbox.on_piece({1, 6, bytes.subspan(96)});
  inbox.on_piece({1, 1, bytes.subspan(16, 80)});
  inbox.on_piece({1, 0, bytes.first(48)});
  EXPECT_TRUE(inbox.take_object());
}

/// Seeded lives of both ends: offers, newer ones, withdrawals, cuts, restarts. In the end the master has, of every
/// slot, the newest that was offered, exactly, and nothing was delivered twice in a row.
TEST(BulkDrills, EndInTheNewestOfEverySlot) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    LabOptions options = bad_link(seed);
    options.link.path.round_trip_ns = static_cast<std::int64_t>(random() % 60) * 1'000'000;
    BulkLab lab(options);
    std::map<std::uint32_t, std::shared_ptr<const Object>> wanted;
    std::map<std::uint32_t, ObjectHash> has;
    lab.on_object = [&](const ReceivedObject& object) {
      EXPECT_EQ(hash_of(object.object->bytes()), object.hash);
      const auto [at, is_new] = has.emplace(object.slot, object.hash);
      EXPECT_TRUE(is_new || at->second != object.hash) << "delivered twice";
      at->second = object.hash;
    };
    std::uint64_t version = 0;
    for (int step = 0; step < 60; ++step) {
      const auto slot = static_cast<std::uint32_t>(random() % 5);
      switch (random() % 12) {
        case 0:
          outbox(lab).withdraw(slot, lab.now_ns());
          wanted.erase(slot);
          break;
        case 1:
          lab.set_cut(true);
          break;
        case 2:
          lab.new_session(true, false);  // the slave's next life offers what it has
          for (const auto& [s, object] : wanted) outbox(lab).offer(s, object, 100, lab.now_ns());
          break;
        case 3:
          lab.new_session(false, true);
          has.clear();
          break;
        case 4:
          lab.new_session(false, false);
          break;
        default: {
          lab.set_cut(false);
          const auto object = random_object(1 + random() % 200'000, seed * 1000 + ++version);
          wanted[slot] = object;
          outbox(lab).offer(slot, object, static_cast<std::uint8_t>(random() % 3), lab.now_ns());
        }
      }
      lab.run_until(lab.now_ns() + static_cast<std::int64_t>(random() % 100) * 1'000'000);
    }
    lab.set_cut(false);
    lab.run_until(lab.now_ns() + 6 * kSecond);
    for (const auto& [slot, object] : wanted) {
      EXPECT_EQ(has[slot], object->hash) << "slot " << slot;
      EXPECT_EQ(outbox(lab).status(slot), ObjectOutbox::Status::kComplete);
    }
    EXPECT_FALSE(lab.lane(BulkLab::kSlave).peer_lies());
  }
}

/// What another source sends goes first where it is more urgent, and last where it is less.
TEST(BulkSources, ShareThePacerByUrgency) {
  struct Tiles final : BulkSource {
    std::optional<std::uint8_t> urgency(std::int64_t) override {
      return left > 0 ? std::optional(how_urgent) : std::nullopt;
    }
    std::optional<Item> next(std::span<std::byte> to, std::int64_t) override {
      to[0] = std::byte{0x55};
      --left;
      return Item{BulkType::kTile, 1100, ++tag};
    }
    void on_arrived(std::uint64_t, std::int64_t) override { ++arrived; }
    void on_lost(std::uint64_t, std::int64_t) override { ++left, ++lost; }
    std::uint8_t how_urgent = 0;
    int left = 0, arrived = 0, lost = 0;
    std::uint64_t tag = 0;
  };
  for (const bool is_urgent : {true, false}) {
    Tiles tiles;
    BulkLab lab(bad_link(9));
    lab.lane(BulkLab::kSlave).add_source(tiles);
    int bodies = 0;
    lab.on_body = [&](const BulkLane::Body& body) {
      EXPECT_EQ(body.bytes.size(), 1100u);
      EXPECT_EQ(body.bytes[0], std::byte{0x55});
      ++bodies;
    };
    int bodies_before_object = -1;
    lab.on_object = [&](const ReceivedObject&) { bodies_before_object = bodies; };
    outbox(lab).offer(1, random_object(1'500'000, 1), 100, lab.now_ns());
    lab.run_until(lab.now_ns() + kSecond / 4);
    tiles.left = 200, tiles.how_urgent = is_urgent ? 0 : 200;
    lab.run_until(lab.now_ns() + 4 * kSecond);
    EXPECT_GE(bodies, 200);
    EXPECT_EQ(tiles.arrived + tiles.lost, bodies + tiles.lost);
    if (is_urgent) {
      EXPECT_GE(bodies_before_object, 200);
    } else {
      EXPECT_LT(bodies_before_object, 150);  // only while its last pieces were under way
    }
  }
}

}  // namespace
}  // namespace farfeel::transport
