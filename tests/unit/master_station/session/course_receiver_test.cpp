#include "master_station/session/course_receiver.h"

#include <gtest/gtest.h>

#include <array>

#include "codecs/wire/course_message.h"

namespace farfeel::master_station {
namespace {

/// A scene of three objects, of which the first and the last may change; and a haptic lane that nobody drives.
struct Station {
  Station() {
    scene.objects.resize(3);
    scene.objects[0].may_change = scene.objects[2].may_change = true;
  }
  void hear(std::uint32_t object, std::uint32_t version, double x_m) {
    motion::Course course = motion::at_rest({{1, 0, 0, 0}, {x_m, 0, 0}}, true);
    course.version = version;
    std::array<std::byte, codecs::kCourseBytes> payload;
    receiver.on_course(std::span(payload).first(codecs::write({object, course}, payload)));
  }
  /// What the haptic thread gets.
  std::vector<motion::ObjectCourse> taken() {
    receiver.give(lane);
    std::vector<motion::ObjectCourse> all;
    for (motion::ObjectCourse told; lane.take_course(told);) all.push_back(told);
    return all;
  }

  codecs::SceneDescription scene;
  transport::WakeEvent wake = transport::WakeEvent::open().value();
  HapticLane lane{transport::UdpSocket::open(transport::loopback()).value(), wake};
  CourseReceiver receiver;
};

TEST(CourseReceiver, KeepsTheNewestUntilTheSceneIsThere) {
  Station station;
  station.hear(2, 1, 1);
  station.hear(2, 2, 2);
  EXPECT_TRUE(station.taken().empty());
  station.receiver.begin_scene(station.scene, station.lane);
  const auto all = station.taken();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].object, 2u);
  EXPECT_EQ(all[0].course.X_to_WO.p.x, 2);
  EXPECT_TRUE(station.taken().empty()) << "once";
}

TEST(CourseReceiver, TakesNoOlderOneAndNoneOfWhatMayNotChange) {
  Station station;
  station.receiver.begin_scene(station.scene, station.lane);
  station.hear(0, 5, 5);
  station.hear(0, 4, 4);
  station.hear(1, 1, 1);
  station.hear(77, 1, 1);
  const auto all = station.taken();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].course.X_to_WO.p.x, 5);
  station.receiver.on_course({});
  station.hear(256, 1, 1);
  EXPECT_EQ(station.receiver.malformed(), 2u);
}

/// A slave that was started anew counts from 1, and the loop must take what it says for newer all the same.
TEST(CourseReceiver, AnotherSessionsFirstIsNewerThanTheLastOnesLast) {
  Station station;
  station.receiver.begin_scene(station.scene, station.lane);
  station.hear(0, 9, 9);
  const auto before = station.taken();
  station.receiver.follow(2);
  station.hear(0, 1, 1);
  const auto after = station.taken();
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after[0].course.X_to_WO.p.x, 1);
  EXPECT_GT(after[0].course.version, before.at(0).course.version);
}

/// A slave was started anew with another scene: what an object of that number did in the last one is nothing to it.
TEST(CourseReceiver, WhatTheLastSessionToldDoesNotCountForAnotherScene) {
  Station station;
  station.receiver.follow(1);
  station.receiver.begin_scene(station.scene, station.lane);
  station.hear(0, 9, 9);
  ASSERT_EQ(station.taken().size(), 1u);
  station.receiver.follow(2);
  station.receiver.begin_scene(station.scene, station.lane);
  EXPECT_TRUE(station.receiver.newest().empty());
  EXPECT_TRUE(station.taken().empty());
}

TEST(CourseReceiver, ALaneThatIsFullLosesNothing) {
  Station station;
  station.scene.objects.assign(200, {});
  for (codecs::SceneObject& object : station.scene.objects) object.may_change = true;
  station.receiver.begin_scene(station.scene, station.lane);
  for (std::uint32_t i = 0; i < 200; ++i) station.hear(i, 1, i);
  std::size_t all = 0;
  for (int i = 0; i < 10; ++i) all += station.taken().size();
  EXPECT_EQ(all, 200u);
}

}  // namespace
}  // namespace farfeel::master_station
