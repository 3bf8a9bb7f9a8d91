#include "codecs/device/hid_report_descriptor.h"

#include <gtest/gtest.h>

#include <initializer_list>

using namespace farfeel::codecs;

namespace {

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> b;
  for (const int v : values) b.push_back(static_cast<std::byte>(v));
  return b;
}

// The mouse of appendix E.10 of USB HID 1.11: three buttons, five bits of padding, x and y of 8 bits.
const std::vector<std::byte> kMouse =
    bytes({0x05, 0x01, 0x09, 0x02, 0xA1, 0x01, 0x09, 0x01, 0xA1, 0x00, 0x05, 0x09, 0x19, 0x01, 0x29, 0x03, 0x15,
           0x00, 0x25, 0x01, 0x95, 0x03, 0x75, 0x01, 0x81, 0x02, 0x95, 0x01, 0x75, 0x05, 0x81, 0x01, 0x05, 0x01,
           0x09, 0x30, 0x09, 0x31, 0x15, 0x81, 0x25, 0x7F, 0x75, 0x08, 0x95, 0x02, 0x81, 0x06, 0xC0, 0xC0});

TEST(HidReportDescriptor, FindsTheFieldsOfTheSpecificationsMouse) {
  const auto mouse = read_report_descriptor(kMouse);
  ASSERT_TRUE(mouse) << mouse.error();
  EXPECT_FALSE(mouse->is_numbered);
  EXPECT_EQ(mouse->applications, std::vector<std::uint32_t>{hid_usage(1, 2)});
  ASSERT_EQ(mouse->fields.size(), 5U);
  ASSERT_NE(mouse->report(ReportKind::kInput, 0), nullptr);
  EXPECT_EQ(mouse->report(ReportKind::kInput, 0)->bytes(), 3U);
  EXPECT_EQ(mouse->report(ReportKind::kOutput, 0), nullptr);

  const auto report = bytes({0, 0b101, 0xFF, 0x7F});
  const auto value = [&](std::uint16_t page, std::uint16_t id) {
    return value_in(report, *mouse->field(ReportKind::kInput, hid_usage(page, id)));
  };
  EXPECT_EQ(value(9, 1), 1);
  EXPECT_EQ(value(9, 2), 0);
  EXPECT_EQ(value(9, 3), 1);
  EXPECT_EQ(value(1, 0x30), -1);
  EXPECT_EQ(value(1, 0x31), 127);
  EXPECT_EQ(mouse->field(ReportKind::kInput, hid_usage(1, 0x32)), nullptr);
}

TEST(HidReportDescriptor, EveryCutIsToldOrHoldsNoMoreThanTheWhole) {
  for (std::size_t size = 0; size < kMouse.size(); ++size) {
    const auto cut = read_report_descriptor(std::span(kMouse).first(size));
    if (size == 0) {
      ASSERT_TRUE(cut);
      EXPECT_TRUE(cut->fields.empty());
    } else {
      EXPECT_FALSE(cut && !cut->fields.empty()) << size;
    }
  }
}

TEST(HidReportDescriptor, ReadsFieldsAcrossBytesAndPushedStates) {
  // 12 bits at bit 4 of report 7, signed; Push, another range, Pop; then 12 bits of the first range again.
  const auto d = bytes({0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x85, 0x07, 0x75, 0x04, 0x95, 0x01, 0x81, 0x03,
                        0x16, 0x00, 0xF8, 0x26, 0xFF, 0x07, 0x75, 0x0C, 0x09, 0x30, 0x81, 0x02, 0xA4, 0x15,
                        0x00, 0x26, 0xFF, 0x0F, 0x09, 0x31, 0x81, 0x02, 0xB4, 0x09, 0x32, 0x81, 0x02, 0xC0});
  const auto read = read_report_descriptor(d);
  ASSERT_TRUE(read) << read.error();
  ASSERT_EQ(read->fields.size(), 3U);
  EXPECT_TRUE(read->is_numbered);
  // little-endian bits: x = 0xFFF at bits 4..15, y = 0xFFF at 16..27, z = 0x800 at 28..39
  const auto report = bytes({7, 0xF0, 0xFF, 0xFF, 0x0F, 0x80});
  EXPECT_EQ(value_in(report, read->fields[0]), -1);
  EXPECT_EQ(value_in(report, read->fields[1]), 0xFFF);
  EXPECT_EQ(value_in(report, read->fields[2]), -2048);
  EXPECT_DOUBLE_EQ(share_of_range(-1024, read->fields[0]), -0.5);
  EXPECT_DOUBLE_EQ(share_of_range(-1, read->fields[1]), 0);
  EXPECT_DOUBLE_EQ(share_of_range(9999, read->fields[1]), 1);

  EXPECT_FALSE(value_in(bytes({8, 0xF0, 0xFF, 0xFF, 0x0F, 0x80}), read->fields[0])) << "another report";
  EXPECT_FALSE(value_in(bytes({7, 0xF0, 0xFF, 0xFF, 0x0F}), read->fields[2])) << "cut";
  EXPECT_FALSE(value_in({}, read->fields[0]));
}

TEST(HidReportDescriptor, RefusesWhatContradictsItself) {
  EXPECT_FALSE(read_report_descriptor(bytes({0xC0})));                    // ends what did not begin
  EXPECT_FALSE(read_report_descriptor(bytes({0xA1, 0x01})));              // never ends
  EXPECT_FALSE(read_report_descriptor(bytes({0xB4})));                    // pops nothing
  EXPECT_FALSE(read_report_descriptor(bytes({0x85, 0x00})));              // report id 0
  EXPECT_FALSE(read_report_descriptor(bytes({0x19, 0x05, 0x29, 0x01})));  // maximum below minimum
  EXPECT_FALSE(read_report_descriptor(bytes({0x97, 0xFF, 0xFF, 0xFF, 0xFF})));
  EXPECT_FALSE(read_report_descriptor(bytes({0x75, 0x20, 0x96, 0xFF, 0xFF, 0x81, 0x02})));  // 262 kB a report
  EXPECT_FALSE(read_report_descriptor(bytes({0xFE, 0x05, 0x00})));                          // a long item, cut
  EXPECT_FALSE(read_report_descriptor(std::vector<std::byte>(kMaxReportDescriptorBytes + 1)));
}

TEST(HidReportDescriptor, UnsignedMaximaOfOneByteAreThose) {
  const auto read = read_report_descriptor(
      bytes({0x05, 0x01, 0x15, 0x00, 0x25, 0xFF, 0x75, 0x08, 0x95, 0x01, 0x09, 0x30, 0x81, 0x02}));
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->fields.at(0).logical_max, 255);
}

}  // namespace
