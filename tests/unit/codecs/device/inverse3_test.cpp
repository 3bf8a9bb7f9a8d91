#include "codecs/device/inverse3.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "codecs/device/json_reader.h"

namespace farfeel::codecs {
namespace {

using nlohmann::json;

json arm(const std::string& id) {
  return {{"device_id", id},
          {"config", {{"handedness", "right"}, {"basis", {{"permutation", "XYZ"}}}}},
          {"state",
           {{"cursor_position", {{"x", 0.01}, {"y", -0.12}, {"z", 0.15}}},
            {"cursor_velocity", {{"x", 0.1}, {"y", 0.2}, {"z", -0.3}}},
            {"body_orientation", {{"w", 1}, {"x", 0}, {"y", 0}, {"z", 0}}}}},
          {"status", {{"calibrated", true}, {"power_supply", true}, {"ready", true}}}};
}

json grip(const std::string& id) {
  return {{"device_id", id},
          {"state",
           {{"orientation", {{"w", 0.5}, {"x", 0.5}, {"y", -0.5}, {"z", 0.5}}},
            {"buttons", {{"a", true}, {"b", false}, {"c", true}}},
            {"hall", 1}}}};
}

std::string list(const char* name, const json& device) {
  return json{{name, json::array({device})}}.dump();
}

TEST(Inverse3, reads_what_the_documents_show) {
  const json text = {{"session_id", 7},
                     {"inverse3", json::array({arm("049D")})},
                     {"wireless_verse_grip", json::array({grip("61576")})}};
  const auto update = decode_inverse3(text.dump(2));
  ASSERT_TRUE(update);
  ASSERT_EQ(update->arm_count, 1U);
  const Inverse3State& is = update->arms[0];
  EXPECT_EQ(is.id.text(), "049D");
  EXPECT_EQ(update->arm("049D"), &is);
  EXPECT_EQ(update->arm("049E"), nullptr);
  EXPECT_TRUE(is.has_position && is.has_velocity && is.is_calibrated && is.is_ready && is.has_power);
  EXPECT_FALSE(is.has_other_basis);
  EXPECT_EQ(is.position_m, glm::dvec3(0.01, -0.12, 0.15));
  EXPECT_EQ(is.velocity_m_s, glm::dvec3(0.1, 0.2, -0.3));
  ASSERT_EQ(update->grip_count, 1U);
  EXPECT_TRUE(update->grips[0].has_orientation);
  EXPECT_EQ(update->grips[0].orientation, glm::dquat(0.5, 0.5, -0.5, 0.5));
  EXPECT_EQ(update->grips[0].buttons, 5U);
}

TEST(Inverse3, tells_what_is_not_well) {
  json is = arm("1");
  is["status"] = {{"calibrated", false}, {"power_supply", false}, {"ready", false}};
  is["config"]["basis"]["permutation"] = "XZY";
  const auto update = decode_inverse3(list("inverse3", is));
  ASSERT_TRUE(update);
  EXPECT_FALSE(update->arms[0].is_calibrated || update->arms[0].is_ready || update->arms[0].has_power);
  EXPECT_TRUE(update->arms[0].has_other_basis);
}

TEST(Inverse3, what_is_absent_or_impossible_is_not_there) {
  const auto position = [](const json& value) {
    json is = arm("1");
    is["state"]["cursor_position"] = value;
    const auto update = decode_inverse3(list("inverse3", is));
    return update && update->arm_count == 1 && update->arms[0].has_position;
  };
  EXPECT_TRUE(position({{"x", 0}, {"y", 0}, {"z", 0}}));
  EXPECT_FALSE(position({{"x", 0}, {"y", 0}}));
  EXPECT_FALSE(position(nullptr));
  EXPECT_FALSE(position("near"));
  EXPECT_FALSE(position({{"x", 0}, {"y", 2.1}, {"z", 0}}));
  EXPECT_FALSE(position({{"x", nullptr}, {"y", 0}, {"z", 0}}));  // what many writers make of NaN
  const auto orientation = [](const json& value) {
    json is = grip("1");
    is["state"]["orientation"] = value;
    const auto update = decode_inverse3(list("verse_grip", is));
    return update && update->grip_count == 1 && update->grips[0].has_orientation;
  };
  EXPECT_TRUE(orientation({{"w", 1}, {"x", 0}, {"y", 0}, {"z", 0}}));
  EXPECT_FALSE(orientation({{"w", 0}, {"x", 0}, {"y", 0}, {"z", 0}}));
  EXPECT_FALSE(orientation({{"w", 2}, {"x", 0}, {"y", 0}, {"z", 0}}));
}

TEST(Inverse3, leaves_out_what_does_not_fit) {
  json arms = json::array();
  arms.push_back(arm(std::string(kInverse3IdMax + 1, 'x')));
  arms.push_back(arm("a\"b"));
  arms.push_back(arm(""));
  arms.push_back(nullptr);
  for (int i = 0; i < 10; ++i) arms.push_back(arm(std::to_string(i)));
  const auto update = decode_inverse3(json{{"inverse3", arms}}.dump());
  ASSERT_TRUE(update);
  EXPECT_EQ(update->arm_count, kInverse3DevicesMax);
  EXPECT_EQ(update->arms[0].id.text(), "0");
  EXPECT_EQ(update->arms[3].id.text(), "3");
}

TEST(Inverse3, refuses_every_part_of_a_message) {
  const std::string whole =
      json{{"inverse3", json::array({arm("1")})}, {"verse_grip", json::array({grip("2")})}}.dump();
  ASSERT_TRUE(decode_inverse3(whole));
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(decode_inverse3(whole.substr(0, size))) << size;
  EXPECT_FALSE(decode_inverse3(whole + "x"));
  EXPECT_FALSE(decode_inverse3(whole + whole));
  EXPECT_TRUE(decode_inverse3(" \r\n" + whole + "\t"));
  EXPECT_FALSE(decode_inverse3("[]"));
}

TEST(JsonReader, takes_and_refuses_what_another_reader_does) {
  const auto accepts = [](std::string_view text) {
    JsonReader reader(text);
    reader.skip();
    reader.end();
    return reader.is_good();
  };
  for (const char* text : {"0",
                           "-0",
                           "01",
                           "1.",
                           ".5",
                           "-",
                           "1e5",
                           "1e",
                           "1E+5",
                           "1e400",
                           "1e-400",
                           "0.1e1",
                           "+1",
                           "NaN",
                           "Infinity",
                           "true",
                           "tru",
                           "truex",
                           "null",
                           "nul",
                           "\"\"",
                           "\"a",
                           "[]",
                           "\"\\u12G4\"",
                           "\"\\x\"",
                           "\"\t\"",
                           "\"\\u1234\"",
                           "[1,]",
                           "[,1]",
                           "[1 2]",
                           "{}",
                           "{\"a\":1}",
                           "{a:1}",
                           "{\"a\"}",
                           "{\"a\":1,}",
                           "{\"a\" 1}",
                           "[[[]]]",
                           "[[]",
                           "",
                           " ",
                           "1 2",
                           "[1,2]]",
                           "--1",
                           "1e+-1",
                           "\"\\\"\"",
                           "\"\\\\\"",
                           "{\"a\":{\"b\":[1,2,{}]}}"})
    EXPECT_EQ(accepts(text), json::accept(text)) << text;
  std::mt19937 random(3);
  const std::string characters = "{}[]\",:0123456789.eE+-truefalsn \\";
  int accepted = 0;
  for (int i = 0; i < 300'000; ++i) {
    std::string text;
    for (std::size_t length = random() % 9; length > 0; --length) text += characters[random() % characters.size()];
    ASSERT_EQ(accepts(text), json::accept(text)) << text;
    accepted += accepts(text);
  }
  EXPECT_GT(accepted, 1000);
  EXPECT_FALSE(accepts(std::string(100, '[') + std::string(100, ']')));  // deeper than is allowed here
  EXPECT_TRUE(accepts(std::string(20, '[') + std::string(20, ']')));
}

TEST(JsonReader, reads_numbers_as_another_reader_does) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100'000; ++i) {
    const double value = std::ldexp(double(random() % 2'000'001) - 1e6, static_cast<int>(random() % 60) - 40);
    const std::string text = json(value).dump();
    JsonReader reader(text);
    EXPECT_EQ(reader.number(), value) << text;
    EXPECT_TRUE(reader.is_good());
  }
}

TEST(Inverse3, force_commands_are_what_the_documents_show) {
  std::array<char, kInverse3CommandMax> text;
  const auto command = [&](std::string_view id, const glm::dvec3& force_N) {
    return json::parse(std::string_view(text.data(), encode_inverse3_force(text, id, force_N)));
  };
  EXPECT_EQ(command("049D", {0.5, -1.25, 0}),
            json::parse(R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"values":
                {"x":0.5,"y":-1.25,"z":0}}}}]})"));
  for (const double extreme :
       {1e300, -1e300, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const json most = command(std::string(kInverse3IdMax, 'W'), glm::dvec3(extreme));
    const double x = most["inverse3"][0]["commands"]["set_cursor_force"]["values"]["x"];
    EXPECT_LE(std::abs(x), 100);
  }
}

TEST(Inverse3, zero_force_fits_a_keeper_for_any_id) {
  std::array<char, kInverse3CommandMax> text;
  const std::size_t size = encode_inverse3_force(text, std::string(kInverse3IdMax, 'W'), glm::dvec3(0));
  std::array<std::byte, 128> frame;
  EXPECT_GT(encode_text_frame(frame, {text.data(), size}), 0U);
}

TEST(Inverse3, frames_are_those_of_rfc_6455) {
  std::array<std::byte, 300> frame;
  ASSERT_EQ(encode_text_frame(frame, "Hello"), 11U);
  const unsigned char expected[] = {0x81, 0x85, 0, 0, 0, 0, 'H', 'e', 'l', 'l', 'o'};
  for (std::size_t i = 0; i < sizeof expected; ++i) EXPECT_EQ(std::to_integer<unsigned>(frame[i]), expected[i]) << i;
  const std::string longer(200, 'x');
  ASSERT_EQ(encode_text_frame(frame, longer), 208U);
  EXPECT_EQ(std::to_integer<unsigned>(frame[1]), 0x80U | 126U);
  EXPECT_EQ(std::to_integer<unsigned>(frame[2]), 0U);
  EXPECT_EQ(std::to_integer<unsigned>(frame[3]), 200U);
  EXPECT_EQ(encode_text_frame(std::span(frame).first(10), "Hello"), 0U);
}

}  // namespace
}  // namespace farfeel::codecs
