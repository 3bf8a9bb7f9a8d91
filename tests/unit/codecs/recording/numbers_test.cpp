#include "codecs/recording/numbers.h"

#include <gtest/gtest.h>

namespace farfeel::codecs {
namespace {

enum class Choice : std::uint8_t { kOne, kOther };

struct Fields {
  double length_m = 1;
  std::int64_t time_ns = 2;
  std::uint8_t small = 3;
  bool is_on = false;
  Choice choice = Choice::kOne;
  spatial::Pose X_WT;
};

template <typename F, typename Visit>
void each_field(F& fields, Visit&& visit) {
  visit("length_m", fields.length_m), visit("time_ns", fields.time_ns), visit("small", fields.small);
  visit("is_on", fields.is_on), visit("choice", fields.choice), visit("X_WT", fields.X_WT);
}

TEST(Numbers, AreReadAsTheyWereWritten) {
  const Fields fields{0.1, 9'007'199'254'740'991, 200, true, Choice::kOther, {{0, 1, 0, 0}, {1, 2, 3}}};
  NumberWriter writer;
  each_field(fields, writer);
  Fields again;
  NumberReader reader(writer.numbers().names, writer.numbers().values);
  each_field(again, reader);
  EXPECT_EQ(again.length_m, fields.length_m);
  EXPECT_EQ(again.time_ns, fields.time_ns);
  EXPECT_EQ(again.small, fields.small);
  EXPECT_TRUE(again.is_on);
  EXPECT_EQ(again.choice, Choice::kOther);
  EXPECT_EQ(again.X_WT, fields.X_WT);
  EXPECT_EQ(reader.unasked(), "");
}

TEST(Numbers, AFieldThatIsNotNamedKeepsItsDefaultAndANameThatNobodyAsksForIsTold) {
  const std::vector<std::string> names{"new", "length_m"};
  const std::vector<double> values{7, 8};
  Fields fields;
  NumberReader reader(names, values);
  each_field(fields, reader);
  EXPECT_EQ(fields.length_m, 8);
  EXPECT_EQ(fields.time_ns, 2);
  EXPECT_EQ(reader.unasked(), "new");
}

TEST(Numbers, WhatAFieldCannotHoldIsZero) {
  const std::vector<std::string> names{"time_ns", "small", "choice"};
  for (const double value : {std::nan(""), 1e300, -1e300, 1e18}) {
    const std::vector<double> values{value, value, value};
    Fields fields;
    NumberReader reader(names, values);
    each_field(fields, reader);
    EXPECT_EQ(fields.time_ns, 0);
    EXPECT_EQ(fields.small, 0);
    EXPECT_EQ(fields.choice, Choice::kOne);
  }
}

}  // namespace
}  // namespace farfeel::codecs
