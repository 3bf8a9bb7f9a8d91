#include "slave_sim/session/object_courses.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "codecs/wire/course_message.h"

namespace farfeel::slave_sim {
namespace {

using motion::at_rest;
using spatial::Pose;

const Pose kHome{{1, 0, 0, 0}, {0.1, 0, 0}}, kAway{{1, 0, 0, 0}, {0.3, 0, 0}};

ObjectCourses two() {
  return ObjectCourses({{.object = 1, .before = at_rest(kHome, true)}, {.object = 4, .before = at_rest(kAway, false)}});
}

/// All that it sends now, with the tag of each.
std::vector<std::pair<motion::ObjectCourse, std::uint64_t>> sent(CourseFeed& courses) {
  std::vector<std::pair<motion::ObjectCourse, std::uint64_t>> all;
  std::array<std::byte, 1200> to;
  while (courses.urgency(0)) {
    const auto item = courses.next(to, 0);
    if (!item) break;
    all.emplace_back(codecs::read_course(std::span(to).first(item->bytes)).value(), item->tag);
  }
  return all;
}

TEST(ObjectCourses, TellEveryObjectOnceASession) {
  ObjectCourses courses = two();
  CourseFeed feed(courses);
  EXPECT_TRUE(sent(feed).empty()) << "nobody is there yet";
  EXPECT_EQ(courses.begin_session().size(), 2u);
  const auto told = sent(feed);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].first.course.X_to_WO, kHome);
  EXPECT_FALSE(told[1].first.course.is_there);
  EXPECT_TRUE(sent(feed).empty());
  feed.restart();
  EXPECT_EQ(sent(feed).size(), 2u);
}

/// Who watches gets what differs from the scene's beginning, whatever the others were told.
TEST(ObjectCourses, EachPeerIsToldForItself) {
  ObjectCourses courses = two();
  CourseFeed early(courses), late(courses);
  (void)courses.change({.object = 4, .is_there = true}, 1);
  EXPECT_EQ(sent(early).size(), 1u);
  (void)courses.change({.object = 4, .is_there = false}, 2);
  EXPECT_EQ(sent(early).size(), 1u);
  const auto told = sent(late);
  ASSERT_EQ(told.size(), 1u) << "the newest alone";
  EXPECT_FALSE(told[0].first.course.is_there);
}

TEST(ObjectCourses, WhatWasLostIsSentAgainUnlessItIsOld) {
  ObjectCourses courses = two();
  CourseFeed feed(courses);
  (void)courses.begin_session();
  const auto first = sent(feed);
  feed.on_lost(first[0].second, 0);
  EXPECT_EQ(sent(feed).size(), 1u);
  EXPECT_TRUE(courses.change({.object = 1, .X_WO = kAway, .takes_s = 1}, 5));
  const auto second = sent(feed);
  ASSERT_EQ(second.size(), 1u);
  feed.on_lost(first[0].second, 0);  // late news of what nobody wants any more
  EXPECT_TRUE(sent(feed).empty());
  feed.on_lost(second[0].second, 0);
  ASSERT_EQ(sent(feed).size(), 1u);
}

TEST(ObjectCourses, AMoveBeginsWhereTheObjectIsThen) {
  ObjectCourses courses = two();
  (void)courses.begin_session();
  const auto away = courses.change({.object = 1, .X_WO = kAway, .takes_s = 2}, 5);
  ASSERT_TRUE(away);
  EXPECT_EQ(away->course.X_from_WO, kHome);
  const auto back = courses.change({.object = 1, .X_WO = kHome, .takes_s = 2}, 6);  // half way
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->course.X_from_WO.p.x, 0.2, 1e-12);
  EXPECT_GT(back->course.version, away->course.version);
}

TEST(ObjectCourses, WhatComesOrGoesTakesNoWay) {
  ObjectCourses courses = two();
  const auto comes = courses.change({.object = 4, .X_WO = kHome, .takes_s = 3}, 1);
  ASSERT_TRUE(comes);
  EXPECT_EQ(comes->course.takes_s, 0);
  EXPECT_EQ(comes->course.X_from_WO, kHome);
  const auto goes = courses.change({.object = 4, .is_there = false}, 2);
  ASSERT_TRUE(goes);
  EXPECT_EQ(goes->course.X_to_WO, kHome);
  EXPECT_FALSE(goes->course.is_there);
  EXPECT_FALSE(courses.change({.object = 2}, 2)) << "may not change";
}

TEST(ObjectCourses, AnotherSessionFindsAllWhereTheyWereGoing) {
  ObjectCourses courses = two();
  (void)courses.change({.object = 1, .X_WO = kAway, .takes_s = 100}, 500);
  (void)courses.change({.object = 4, .is_there = true}, 500);
  for (const motion::ObjectCourse& told : courses.begin_session()) {
    EXPECT_EQ(told.course.from_s, 0);
    EXPECT_EQ(told.course.takes_s, 0);
    EXPECT_EQ(told.course.X_to_WO, kAway);
    EXPECT_TRUE(told.course.is_there);
  }
}

}  // namespace
}  // namespace farfeel::slave_sim
