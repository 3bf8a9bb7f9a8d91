#include "master_station/devices/host/found_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace farfeel::devices {
namespace {

std::vector<FoundDevice> find_three(const DriverOptions& options) {
  return {{"pusher", "A\x1b[31m1", "/dev/hidraw3", {}},
          {"pusher", "B2", "/dev/hidraw4", "no permission:\tsee\nthe rules"},
          {"stranger", options.plug_in, "ws://localhost", {}}};
}

std::vector<FoundDevice> find_none(const DriverOptions&) {
  return {};
}

const DeviceModel* pusher(std::string_view name) {
  static const DeviceModel model = [] {
    DeviceModel made;
    made.name = "pusher";
    made.title = "The Pusher";
    made.position_dof = made.rotation_dof = made.force_dof = 3;
    return made;
  }();
  return name == model.name ? &model : nullptr;
}

constexpr std::array kFamilies{DriverFamily{"pushers", find_three, nullptr},
                               DriverFamily{"nobody", find_none, nullptr}};

TEST(FoundList, TellsTheStationOneLineADeviceWhateverADeviceSaysOfItself) {
  const auto all = listed_devices(kFamilies, {{}, "lib.so"}, pusher);
  EXPECT_EQ(list_for_station(all),
            "pusher\tA [31m1\t/dev/hidraw3\t3\tpose\t\n"
            "pusher\tB2\t/dev/hidraw4\t3\tpose\tno permission: see the rules\n"
            "stranger\tlib.so\tws://localhost\t0\tpose\t\n");
}

TEST(FoundList, TellsAPersonWhatADeviceCanAndHowThatIsKnown) {
  const std::string text = list_for_person(listed_devices(kFamilies, {}, pusher), kFamilies);
  EXPECT_EQ(std::ranges::count(text, '\x1b'), 0) << "a device's own words must not reach the terminal as commands";
  for (const char* part :
       {"The Pusher, serial number B2", "--device  pusher:B2", "position of 3, rotation of 3; force of 3",
        "trouble   no permission", "no data of this model", kProof})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nis not in\n" << text;
  EXPECT_EQ(text.find("tested on hardware"), std::string::npos);
}

TEST(FoundList, SaysWhatItLookedForWhenThereIsNothing) {
  const std::span families = std::span(kFamilies).last(1);
  const auto none = listed_devices(families, {}, pusher);
  EXPECT_TRUE(none.empty());
  EXPECT_NE(list_for_person(none, families).find("Looked for: nobody"), std::string::npos);
  EXPECT_EQ(list_for_station(none), "");
  const auto json = nlohmann::json::parse(list_as_json(none, families));
  EXPECT_TRUE(json["devices"].empty());
  EXPECT_EQ(json["looked_for"][0], "nobody");
}

TEST(FoundList, IsJsonEvenWhereASerialNumberIsNoUtf8) {
  auto all = listed_devices(kFamilies, {}, pusher);
  all[0].found.serial = "\xff\xfe\"";
  const auto json = nlohmann::json::parse(list_as_json(all, kFamilies));
  ASSERT_EQ(json["devices"].size(), 3U);
  EXPECT_EQ(json["devices"][0]["title"], "The Pusher");
  EXPECT_EQ(json["devices"][1]["force_dof"], 3);
  EXPECT_EQ(json["devices"][1]["tells"], "pose");
  EXPECT_FALSE(json["devices"][2]["has_data"]);
  EXPECT_EQ(json["devices"][2]["proven"], kProof);
}

}  // namespace
}  // namespace farfeel::devices
