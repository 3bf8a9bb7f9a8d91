// What is typed, what it means, what is said when it means nothing; and the mapping in words.
#include "master_station/devices/hand/hand_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <random>

#include "master_station/devices/hand/hand_words.h"
#include "tests/unit/master_station/devices/hand/sources.h"

namespace farfeel::devices {
namespace {

constexpr std::array<std::string_view, 5> kNames{"falcon", "spacemouse-compact", "spacemouse-pro", "inverse3", "pid"};

/// What is wrong with it; empty: nothing.
std::string complaint(const ChoiceWords& words) {
  const auto choice = parse_choice(words, kNames);
  return choice ? "" : choice.error().message;
}

bool says(const std::string& text, std::string_view what) {
  return text.find(what) != std::string::npos;
}

TEST(HandChoiceTest, NothingTypedIsAuto) {
  const auto choice = parse_choice({}, kNames);
  ASSERT_TRUE(choice);
  EXPECT_TRUE(choice->is_auto);
  EXPECT_FALSE(choice->is_simulated);
  EXPECT_TRUE(choice->devices.empty());
  EXPECT_FALSE(choice->orientation);
  EXPECT_EQ(choice->axes, Axes::kAll);
  EXPECT_EQ(choice->rate_speed_m_s, 0);
}

TEST(HandChoiceTest, EverythingTypedIsTaken) {
  const auto choice = parse_choice({.device = {"falcon:A:7", "spacemouse"},
                                    .orientation = "spacemouse-pro:9",
                                    .view = "spacemouse-compact",
                                    .axes = "dominant",
                                    .rate_speed = "0.25"},
                                   kNames);
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_FALSE(choice->is_auto);
  ASSERT_EQ(choice->devices.size(), 2u);
  EXPECT_EQ(choice->devices[0].name, "falcon");
  EXPECT_EQ(choice->devices[0].serial, "A:7") << "a serial number may have colons";
  EXPECT_EQ(choice->orientation, OrientationFrom::kSecond);
  EXPECT_EQ(choice->orientation_device->text(), "spacemouse-pro:9");
  EXPECT_EQ(choice->view_device->name, "spacemouse-compact");
  EXPECT_EQ(choice->axes, Axes::kDominant);
  EXPECT_EQ(choice->rate_speed_m_s, 0.25);
  EXPECT_TRUE(parse_choice({.device = {"simulated"}}, kNames)->is_simulated);
  EXPECT_EQ(parse_choice({.orientation = "fixed"}, kNames)->orientation, OrientationFrom::kFixed);
  EXPECT_EQ(parse_choice({.orientation = "twist:3"}, kNames)->twist_button, 2);
  EXPECT_FALSE(parse_choice({.orientation = "twist"}, kNames)->twist_button);
}

TEST(HandChoiceTest, WhatIsNotKnownIsToldWithTheNearestWord) {
  EXPECT_TRUE(says(complaint({.device = {"falkon"}}), "did you mean falcon?"));
  EXPECT_TRUE(says(complaint({.device = {"atuo"}}), "did you mean auto?"));
  EXPECT_TRUE(says(complaint({.device = {"qqqqqqq"}}), "possible are auto, simulated, falcon"));
  EXPECT_TRUE(says(complaint({.device = {"falcon:"}}), "serial number is missing"));
  EXPECT_TRUE(says(complaint({.device = {"auto", "falcon"}}), "nothing else"));
  EXPECT_TRUE(says(complaint({.device = {""}}), "no device"));
  EXPECT_TRUE(says(complaint({.orientation = "twits"}), "did you mean twist?"));
  EXPECT_TRUE(says(complaint({.orientation = "fixed:2"}), "--orientation fixed:2"));
  EXPECT_TRUE(says(complaint({.view = "inverse4"}), "did you mean inverse3?"));
  for (const char* bad : {"twist:", "twist:0", "twist:33", "twist:2x", "twist:-1"})
    EXPECT_TRUE(says(complaint({.orientation = bad}), "from 1 to 32")) << bad;
  EXPECT_TRUE(says(complaint({.axes = "translaton"}), "did you mean translation?"));
  for (const char* bad : {"fast", "-1", "0", "nan", "inf", "2", "0.1m", "1e999"})
    EXPECT_TRUE(says(complaint({.rate_speed = bad}), "from 0.001 to 1 m/s")) << bad;
}

TEST(HandChoiceTest, AnyBytesAreAnsweredAndNeverTrusted) {
  std::mt19937 random(6);
  constexpr std::string_view kBytes = "falcontwis:fed-1290.\0\xff e+";
  for (int i = 0; i < 20'000; ++i) {
    const auto any = [&] {
      std::string text;
      for (auto n = random() % 12; n > 0; --n) text += kBytes[random() % kBytes.size()];
      return text;
    };
    const ChoiceWords words{{any()}, any(), any(), any(), any()};
    const auto choice = parse_choice(words, kNames);
    if (!choice) {
      ASSERT_FALSE(choice.error().message.empty());
      continue;
    }
    ASSERT_TRUE(choice->rate_speed_m_s == 0 || (choice->rate_speed_m_s >= 1e-3 && choice->rate_speed_m_s <= 1));
  }
}

class RolesTest : public ::testing::Test {
 protected:
  RolesTest() {
    falcon.name = "falcon";
    falcon.title = "Novint Falcon";
    compact.name = "spacemouse-compact";
    compact.title = "SpaceMouse Compact";
    pro.name = "spacemouse-pro";
    pro.title = "SpaceMouse Pro";
    stylus.name = "inverse3";
    stylus.title = "Inverse3";
    stylus.rotation_dof = 3;
  }
  std::string refused(const ChoiceWords& words, std::vector<Candidate> candidates) {
    const auto roles = assign_roles(parse_choice(words, kNames).value(), candidates);
    return roles ? "" : roles.error().message;
  }
  HandRoles roles(const ChoiceWords& words, std::vector<Candidate> candidates) {
    const auto made = assign_roles(parse_choice(words, kNames).value(), candidates);
    EXPECT_TRUE(made) << made.error().message;
    return made ? *made : HandRoles{};
  }
  DeviceModel falcon = model_of_three(), compact = model_of_rate(), pro = model_of_rate(), stylus = model_of_three();
};

using Place = std::optional<std::size_t>;

TEST_F(RolesTest, AutoTakesForceFirstAndARateInputToTurnWhatCannotTurn) {
  HandRoles taken = roles({}, {{&compact, ""}, {&falcon, "F1"}});
  EXPECT_EQ(taken.primary, Place(1));
  EXPECT_EQ(taken.second, Place(0));
  EXPECT_EQ(taken.orientation, OrientationFrom::kSecond);
  EXPECT_EQ(taken.told, "The hand is at the Novint Falcon F1, which has force; the SpaceMouse Compact turns the tool.");
  taken = roles({}, {{&compact, ""}, {&stylus, ""}});
  EXPECT_EQ(taken.primary, Place(1));
  EXPECT_FALSE(taken.second) << "its handle tells how it is turned";
  EXPECT_EQ(taken.orientation, OrientationFrom::kOwn);
  taken = roles({}, {{&compact, ""}});
  EXPECT_EQ(taken.primary, Place(0));
  EXPECT_EQ(taken.orientation, OrientationFrom::kOwn);
  EXPECT_TRUE(says(taken.told, "nothing is felt"));
  taken = roles({}, {{&falcon, ""}});
  EXPECT_EQ(taken.orientation, OrientationFrom::kFixed);
  taken = roles({.orientation = "fixed"}, {{&compact, ""}, {&falcon, ""}});
  EXPECT_FALSE(taken.second);
  taken = roles({}, {});
  EXPECT_FALSE(taken.primary);
  EXPECT_TRUE(says(taken.told, "simulated device")) << taken.told;
  EXPECT_TRUE(says(taken.told, "no device is plugged in"));
  EXPECT_TRUE(says(roles({.device = {"simulated"}}, {{&falcon, ""}}).told, "as asked for"));
}

TEST_F(RolesTest, WhatIsNamedHasThatRoleAndNoOther) {
  HandRoles taken =
      roles({.orientation = "spacemouse-pro", .view = "spacemouse"}, {{&compact, "1"}, {&pro, "2"}, {&falcon, ""}});
  EXPECT_EQ(taken.primary, Place(2));
  EXPECT_EQ(taken.second, Place(1));
  EXPECT_EQ(taken.view, Place(0));
  taken = roles({.device = {"spacemouse", "falcon"}}, {{&compact, ""}, {&falcon, ""}});
  EXPECT_EQ(taken.primary, Place(1)) << "the one that tells a pose is for the hand";
  EXPECT_EQ(taken.second, Place(0));
  taken = roles({.device = {"falcon:B"}}, {{&falcon, "A"}, {&falcon, "B"}});
  EXPECT_EQ(taken.primary, Place(1));
  taken = roles({.orientation = "twist"}, {{&falcon, ""}});
  EXPECT_EQ(taken.orientation, OrientationFrom::kTwist);
  EXPECT_EQ(taken.twist_button, 2) << "0 enables, 1 is the clutch";
}

TEST_F(RolesTest, WhatCannotBeIsToldWithWhatCan) {
  EXPECT_TRUE(says(refused({.device = {"falcon"}}, {{&compact, "7"}}), "plugged in: spacemouse-compact:7"));
  EXPECT_TRUE(says(refused({.device = {"falcon"}}, {}), "no device is plugged in"));
  EXPECT_TRUE(says(refused({.device = {"falcon"}, .orientation = "falcon"}, {{&falcon, ""}}), "tells no orientation"));
  EXPECT_TRUE(says(refused({.device = {"spacemouse"}, .orientation = "spacemouse"}, {{&pro, ""}}), "another role"));
  EXPECT_TRUE(says(refused({.view = "falcon"}, {{&falcon, ""}}), "only a rate input"));
  EXPECT_TRUE(says(refused({.device = {"falcon", "falcon"}}, {{&falcon, "1"}, {&falcon, "2"}}), "--orientation"));
  EXPECT_TRUE(says(refused({.device = {"spacemouse"}, .orientation = "twist"}, {{&pro, ""}}), "by itself"));
  EXPECT_TRUE(says(refused({.orientation = "twist:2"}, {{&falcon, ""}}), "another use"));
  EXPECT_TRUE(says(refused({.view = "spacemouse"}, {{&pro, ""}}), "need a device for the hand"));
}

class WordsTest : public RolesTest {
 protected:
  static std::string text(const std::vector<std::string>& lines) {
    std::string all;
    for (const std::string& line : lines) {
      EXPECT_EQ(line.back(), '.') << line;
      all += line + "\n";
    }
    return all;
  }
};

TEST_F(WordsTest, ADeviceOfThreeWithASpaceMouse) {
  HandSettings settings;
  settings.orientation = OrientationFrom::kSecond;
  EXPECT_EQ(text(mapping_in_words(falcon, &compact, nullptr, settings, {2, 0.5, true})),
            "Right on the Novint Falcon is right in the view, away is away, up is up.\n"
            "1 mm of the handle is 2 mm of the tool, and 1 N at the tool is 0.5 N in the hand.\n"
            "The tool starts where the scene has it, wherever the handle is held.\n"
            "Turning: the SpaceMouse Compact, turned all the way at 57 degrees/s; not while its button 2 is held.\n"
            "Clutch: while button 2 is held the handle moves and the tool stays.\n"
            "The Novint Falcon has no torque: what the tool is turned with is not felt, and told as masked.\n");
}

TEST_F(WordsTest, ARateInputAloneAndOtherCases) {
  HandSettings settings;
  settings.orientation = OrientationFrom::kOwn;
  settings.rate_speed_m_s = 0.2;
  const std::string alone = text(mapping_in_words(pro, nullptr, nullptr, settings, {}));
  EXPECT_TRUE(says(alone, "moves the tool at 200 mm/s, turned at 115 degrees/s; half the way is 22 % of it")) << alone;
  EXPECT_TRUE(says(alone, "Nothing is felt: the SpaceMouse Pro has no force. The tool presses with 3 N at most."));
  settings.orientation = OrientationFrom::kTwist;
  settings.twist_button = 2;
  settings.R_BP = spatial::rotation_from_vector({0, 0, std::numbers::pi / 2});
  falcon.clutch_button = -1;
  const std::string twist = text(mapping_in_words(falcon, nullptr, &pro, settings, {}));
  EXPECT_TRUE(says(twist, "Right on the Novint Falcon is away in the view, away is left, up is up.")) << twist;
  EXPECT_TRUE(says(twist, "while button 3 is held, moving the handle turns the tool"));
  EXPECT_TRUE(says(twist, "90 degrees for 100 mm"));
  EXPECT_TRUE(says(twist, "no button for it"));
  EXPECT_TRUE(says(twist, "Turning the SpaceMouse Pro") || says(twist, "turning the SpaceMouse Pro"));
  settings.R_BP = spatial::rotation_from_vector({0, 0, 0.5});
  EXPECT_TRUE(says(text(mapping_in_words(falcon, nullptr, nullptr, settings, {})),
                   "turned against the view by 29 degrees about (0, 0, 1)"));
}

}  // namespace
}  // namespace farfeel::devices
