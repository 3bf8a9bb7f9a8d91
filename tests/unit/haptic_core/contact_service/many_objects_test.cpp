// Contacts of many objects at once: each is felt as if its object were alone, and has a slot of its own.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include "haptic_core/contact/tracking/track_names.h"
#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/height_plate.h"

namespace farfeel::contact_service {
namespace {

constexpr std::uint32_t kAcross = 8, kObjects = kAcross * kAcross;

/// 64 pads in a square, each 10 um lower than the one before, beneath one plate. Half of them are the most that fit.
struct Pads {
  geometry::HapticSurface pad = slave_sim::ridged_plate(1e-3, 0.1e-3, {.size_m = {0.003, 0.003, 0.002}}),
                          tool = slave_sim::ridged_plate(2e-3, 0.2e-3, {.size_m = {0.04, 0.04, 0.004}});
  std::vector<TouchableObject> objects;

  Pads() {
    for (std::uint32_t k = 0; k < kObjects; ++k) {
      const glm::dvec3 p_WO{4.5e-3 * (k % kAcross - 3.5), 4.5e-3 * (static_cast<double>(k / kAcross) - 3.5),
                            -10e-6 * k};
      objects.push_back({.felt = &pad, .material = {}, .X_WO = {{1, 0, 0, 0}, p_WO}});
    }
  }
  [[nodiscard]] std::unique_ptr<ContactService> service(std::span<const TouchableObject> of) const {
    return std::make_unique<ContactService>(of, TouchableObject{.felt = &tool, .material = {}, .X_WO = {}},
                                            ContactOptions{.most_stiffness_N_per_m = kHeldStiffness_N_per_m});
  }
  [[nodiscard]] static ToolPose pose(std::uint32_t tick) {
    return {.sequence = tick,
            .time_ns = tick * 1'000'000LL,
            .X_WT = {{0, 1, 0, 0}, {0.1e-3 * std::sin(0.1 * tick), 0, -0.3e-3 + 0.05e-3 * std::cos(0.1 * tick)}},
            .V_WT_W = {}};
  }
};

TEST(ManyObjects, TheDeepestContactsAreFeltEachAsIfItsObjectWereAlone) {
  const Pads pads;
  const auto together = pads.service(pads.objects);
  std::vector<std::unique_ptr<ContactService>> alone;
  for (std::uint32_t k = 0; k < contact::kMaxContacts; ++k) alone.push_back(pads.service({&pads.objects[k], 1}));
  std::array<contact::ContactId, contact::kMaxContacts> ids{};
  for (std::uint32_t tick = 0; tick < 20; ++tick) {
    const Answer& set = together->answer(Pads::pose(tick));
    ASSERT_EQ(set.count, contact::kMaxContacts);
    EXPECT_EQ(set.times.left_out, kObjects - contact::kMaxContacts);
    std::set<std::uint32_t> slots;
    for (std::uint32_t k = 0; k < set.count; ++k) {
      const contact::Contact& contact = set.contacts[k];
      const contact::ContactSet& own = alone[k]->answer(Pads::pose(tick));
      ASSERT_EQ(own.count, 1u);
      EXPECT_EQ(contact.object, k);
      EXPECT_EQ(contact.depth_m, own.contacts[0].depth_m) << "object " << k << " at " << tick;
      EXPECT_EQ(contact.gradient, own.contacts[0].gradient) << "object " << k << " at " << tick;
      EXPECT_TRUE(tick == 0 || contact.id == ids[k]);
      ids[k] = contact.id;
      slots.insert(contact.id.number % contact::TrackNames::kSlots);
    }
    EXPECT_EQ(slots.size(), set.count) << "what is kept of them lies apart";
  }
}

/// Whichever contacts come and go, those of an answer lie apart, and a name is never given again.
TEST(TrackNames, NewContactsTakeTheSlotThatWasFreeForLongest) {
  contact::TrackNames names;
  std::set<std::uint32_t> given;
  for (std::uint32_t update = 0; update < 100; ++update) {
    names.begin();
    std::set<std::uint32_t> slots;
    for (std::uint32_t k = 0; k < contact::kMaxContacts; ++k) {
      const std::uint32_t name = names.name(k, update + 1);  // all clusters are new
      EXPECT_TRUE(given.insert(name).second);
      EXPECT_EQ(names.name(k, update + 1), name);
      slots.insert(name % contact::TrackNames::kSlots);
    }
    EXPECT_EQ(slots.size(), contact::kMaxContacts);
  }
}

}  // namespace
}  // namespace farfeel::contact_service
