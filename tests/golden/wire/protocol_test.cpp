// transport/PROTOCOL.md, as code: every message is put together here from the written tables alone, with nothing but
// "append so many bytes", and compared with what the codecs write and read. Bytes that change here change the protocol.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "codecs/felt/felt_outline.h"
#include "codecs/felt/session_object.h"
#include "codecs/scene/saved_scene.h"
#include "codecs/tile/tile_codec.h"
#include "codecs/wire/course_message.h"
#include "codecs/wire/edit_messages.h"
#include "codecs/wire/slave_status.h"
#include "codecs/wire/tile_messages.h"
#include "tests/golden/wire/table.h"
#include "transport/bulk/bulk_messages.h"
#include "transport/control_messages.h"

namespace farfeel {
namespace {

using transport::MessageType;

TEST(Protocol, TypesHaveTheirNumbers) {
  const std::vector<std::pair<int, std::string>> table{
      {1, "bye"},          {2, "keep-alive"},    {3, "challenge"},     {4, "challenge answer"},
      {9, "slave status"}, {10, "tile request"}, {11, "edit request"}, {12, "edit answer"},
      {13, "scene news"},  {14, "save request"}, {15, "save answer"},  {16, "pose sample"},
      {17, "contact set"}, {18, "tiles held"},   {0x2A, "tile"},       {0x2B, "course"}};
  std::size_t known = 0;
  for (int type = 0; type < 256; ++type) known += !transport::name_of(static_cast<MessageType>(type)).empty();
  EXPECT_EQ(known, table.size());
  for (const auto& [type, name] : table) EXPECT_EQ(transport::name_of(static_cast<MessageType>(type)), name);
}

TEST(Protocol, Bye) {
  transport::PayloadBuffer buffer;
  EXPECT_BYTES(write(transport::Bye{transport::ByeReason::kRevoked}, buffer), Table().u(8, 2));
  EXPECT_FALSE(transport::read_bye(Table().u(8, 0).bytes()));
  EXPECT_FALSE(transport::read_bye(Table().u(8, 4).bytes()));
}

TEST(Protocol, ObjectOfferAndWithdrawal) {
  transport::MessageBuffer buffer;
  transport::ObjectOffer offer{7, 3, 2, 67108864, {}};
  Table table = Table().u(8, 0x21).u(32, 7).u(32, 3).u(16, 2).u(64, 67108864);
  for (unsigned i = 0; i < 32; ++i) {
    offer.hash[i] = static_cast<std::byte>(i);
    table.u(8, i);
  }
  EXPECT_BYTES(write(offer, buffer), table);
  EXPECT_EQ(table.bytes().size(), 51u);
  EXPECT_EQ(transport::read_object_offer(table.bytes()).value().hash, offer.hash);
  EXPECT_FALSE(transport::read_object_offer(Table().u(8, 0x21).u(32, 7).u(32, 3).u(16, 2).u(64, 0).zeros(32).bytes()));
  const Table withdrawal = Table().u(8, 0x23).u(32, 7);
  EXPECT_BYTES(write(transport::ObjectWithdrawal{7}, buffer), withdrawal);
  EXPECT_EQ(transport::read_object_withdrawal(withdrawal.bytes()).value().id, 7u);
}

TEST(Protocol, ObjectAnswer) {
  transport::MessageBuffer buffer;
  transport::ObjectAnswer answer;
  answer.id = 7, answer.revision = 9, answer.ask = 2, answer.state = transport::ObjectState::kReceiving;
  answer.round = 1, answer.ranges = 2;
  answer.range[0] = {0, 10}, answer.range[1] = {20, 4194304};
  const auto head = [](unsigned state, unsigned reason, unsigned ranges) {
    return Table().u(8, 0x22).u(32, 7).u(32, 9).u(16, 2).u(8, state).u(8, reason).u(8, 1).u(8, ranges);
  };
  const Table table = head(0, 0, 2).u(32, 0).u(32, 10).u(32, 20).u(32, 4194304);
  EXPECT_BYTES(write(answer, buffer), table);
  EXPECT_EQ(transport::read_object_answer(table.bytes()).value().range[1].begin, 20u);
  EXPECT_TRUE(transport::read_object_answer(head(2, 4, 0).bytes()));
  EXPECT_FALSE(transport::read_object_answer(head(2, 5, 0).bytes()));
  EXPECT_FALSE(transport::read_object_answer(head(4, 0, 0).bytes()));
  EXPECT_FALSE(transport::read_object_answer(head(1, 1, 0).bytes())) << "a reason without a refusal";
  EXPECT_FALSE(transport::read_object_answer(head(1, 0, 1).u(32, 0).u(32, 10).bytes())) << "ranges of what is complete";
  EXPECT_FALSE(transport::read_object_answer(head(0, 0, 2).u(32, 0).u(32, 10).u(32, 10).u(32, 11).bytes()));
  EXPECT_FALSE(transport::read_object_answer(head(0, 0, 1).u(32, 10).u(32, 10).bytes()));
}

TEST(Protocol, ObjectPiece) {
  transport::MessageBuffer buffer;
  const transport::BulkHead head{0x29, 100, 55, 4};
  const Table head_table = Table().u(8, 0x29).u(32, 100).u(32, 55).u(8, 4);
  EXPECT_BYTES(write(head, buffer), head_table);
  const std::array<std::byte, 3> bytes{std::byte{1}, std::byte{2}, std::byte{3}};
  const Table body = Table().u(32, 7).u(32, 77).u(8, 1).u(8, 2).u(8, 3);
  EXPECT_BYTES(write(transport::ObjectPiece{7, 77, bytes}, buffer), body);
  Table whole = head_table;
  whole.u(32, 7).u(32, 77).u(8, 1);
  EXPECT_EQ(transport::read_bulk_head(whole.bytes()).value().number, 100u);
  EXPECT_EQ(transport::read_object_piece(body.bytes()).value().granule, 77u);
}

TEST(Protocol, Receipt) {
  transport::MessageBuffer buffer;
  transport::Receipt receipt;
  receipt.newest = 1000, receipt.echo_us = 55, receipt.arrival_us = 66, receipt.hold_us = 77;
  receipt.ranges = 2, receipt.stamps = 1;
  receipt.range[0] = {0, 3}, receipt.range[1] = {2, 500};
  receipt.stamp[0] = {1, -40};
  const auto head = [](unsigned ranges, unsigned stamps) {
    return Table().u(8, 0x20).u(32, 1000).u(32, 55).u(32, 66).u(32, 77).u(8, ranges).u(8, stamps);
  };
  const Table table = head(2, 1).u(16, 0).u(16, 3).u(16, 2).u(16, 500).u(8, 1).u(16, 0x10000 - 40);
  EXPECT_BYTES(write(receipt, buffer), table);
  EXPECT_EQ(transport::read_receipt(table.bytes()).value().range[1].length, 500u);
  EXPECT_FALSE(transport::read_receipt(head(0, 0).bytes()));
  EXPECT_FALSE(transport::read_receipt(head(1, 0).u(16, 1).u(16, 3).bytes())) << "newest itself has arrived";
  EXPECT_FALSE(transport::read_receipt(head(1, 0).u(16, 0).u(16, 0).bytes()));
  EXPECT_FALSE(transport::read_receipt(head(1, 1).u(16, 0).u(16, 3).u(8, 0).u(16, 1).bytes()));
}

TEST(Protocol, TheHashIsBlake2b256) {
  // The published value for "abc" with a 32-byte digest.
  const std::string abc = "abc";
  EXPECT_EQ(hex(transport::hash_of(std::as_bytes(std::span(abc)))),
            "bddd813c634239723171ef3fee98579b94964e3bb1cb3e427262c8c068d52319");
}

TEST(Protocol, SlaveStatus) {
  std::array<std::byte, codecs::kSlaveStatusBytes> buffer;
  const codecs::SlaveStatus status{500, 1000, 2000, 3000, 10, 20, 30, 1, 2, 3, 4, 5, 6, 7};
  const std::size_t size = codecs::write(status, buffer);
  const Table table = Table()
                          .f32(500)
                          .f32(1000)
                          .f32(2000)
                          .f32(3000)
                          .f32(10)
                          .f32(20)
                          .f32(30)
                          .u(64, 1)
                          .u(64, 2)
                          .u(64, 3)
                          .u(64, 4)
                          .u(64, 5)
                          .u(64, 6)
                          .u(64, 7);
  EXPECT_BYTES(std::span(buffer).first(size), table);
}

TEST(Protocol, TilesAndTheRequestForThem) {
  geometry::HeightTile tile;
  tile.version = 0x0A0B0C0D;
  std::uint32_t noise = 1;
  for (std::uint16_t& c : tile.coefficients)
    c = static_cast<std::uint16_t>((noise = noise * 1664525 + 1013904223) >> 16);
  const auto parts = codecs::encoded_tile(77, tile, codecs::kExactly);
  ASSERT_EQ(parts.size(), 2u);  // noise cannot be packed: raw halves
  std::array<std::byte, transport::kMaxMessageBytes> payload;
  const std::size_t size = codecs::write(codecs::TileMessage{5, parts[1]}, payload);
  Table table;
  table.u(32, 5).u(8, 2).u(8, 2).u(32, 77).u(32, 0x0A0B0C0D);
  for (std::size_t i = 512; i < 1024; ++i) table.u(16, tile.coefficients[i]);
  EXPECT_BYTES(std::span(payload).first(size), table);
  const auto read = codecs::read_tile_message(std::span(payload).first(size));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->surface, 5u);
  EXPECT_EQ(hex(read->part), hex(parts[1]));

  const Table request = Table().u(32, 3);
  EXPECT_BYTES(std::span(payload).first(codecs::write(codecs::TileRequest{3}, payload)), request);
  EXPECT_EQ(codecs::read_tile_request(request.bytes())->round, 3u);
  EXPECT_FALSE(codecs::read_tile_request(Table().u(32, 0).bytes()));
  EXPECT_FALSE(codecs::read_tile_request(Table().u(32, 3).u(8, 0).bytes()));

  codecs::TilesHeld held{.surface = 2, .first = 7, .count = 3, .hashes = {0x01020304, 0, 9}};
  std::array<std::byte, codecs::kMostTilesHeldBytes> long_payload;
  const Table held_table = Table().u(32, 2).u(32, 7).u(32, 0x01020304).u(32, 0).u(32, 9);
  EXPECT_BYTES(std::span(long_payload).first(codecs::write(held, long_payload)), held_table);
  EXPECT_EQ(codecs::read_tiles_held(held_table.bytes())->count, 3u);
  EXPECT_FALSE(codecs::read_tiles_held(Table().u(32, 2).u(32, 7).bytes()));
  EXPECT_FALSE(codecs::read_tiles_held(Table().u(32, 2).u(32, 7).u(8, 0).bytes()));
  held.count = codecs::TilesHeld::kMost;
  EXPECT_EQ(codecs::write(held, long_payload), codecs::kMostTilesHeldBytes);
  EXPECT_TRUE(codecs::read_tiles_held(long_payload));

  const Table same = Table().u(8, 5).u(8, 0).u(32, 4).u(32, 6);
  EXPECT_BYTES(codecs::encoded_same(4, 6), same);
  EXPECT_TRUE(codecs::decoded_tile_part(same.bytes())->is_same);
  EXPECT_FALSE(codecs::decoded_tile_part(Table().u(8, 5).u(8, 1).u(32, 4).u(32, 6).bytes()));
  EXPECT_FALSE(codecs::decoded_tile_part(Table().u(8, 5).u(8, 0).u(32, 4).u(32, 6).u(8, 0).bytes()));
  geometry::HeightTile zeros;  // FNV-1a of so many, folded
  zeros.coefficients.fill(0);
  std::uint64_t fnv = 14695981039346656037U;
  for (std::size_t i = 0; i < 2 * zeros.coefficients.size(); ++i) fnv *= 1099511628211U;
  EXPECT_EQ(codecs::hash_of(zeros), static_cast<std::uint32_t>(fnv ^ fnv >> 32));
}

TEST(Protocol, Course) {
  std::array<std::byte, 256> payload;
  motion::ObjectCourse told{3, {.version = 7, .from_s = 12.5, .takes_s = 0.25}};
  told.course.X_from_WO.p = {1, 2, 3};
  told.course.X_to_WO = {{0, 1, 0, 0}, {4, 5, 6}};
  told.course.is_there = false;
  const auto table = [](unsigned version, double from_s, double takes_s, unsigned is_there, double w) {
    Table t = Table().u(32, 3).u(32, version).f64(from_s).f64(takes_s).u(8, is_there);
    for (const double v : {1.0, 2.0, 3.0, w, 0.0, 0.0, 0.0, 4.0, 5.0, 6.0, 0.0, 1.0, 0.0, 0.0}) t.f64(v);
    return t;
  };
  EXPECT_BYTES(std::span(payload).first(codecs::write(told, payload)), table(7, 12.5, 0.25, 0, 1));
  EXPECT_EQ(table(7, 12.5, 0.25, 0, 1).bytes().size(), 137u);
  const auto read = codecs::read_course(table(7, 12.5, 0.25, 1, 1).bytes());
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->course.is_there);
  EXPECT_EQ(read->course.X_to_WO.p, glm::dvec3(4, 5, 6));
  EXPECT_FALSE(codecs::read_course(table(0, 12.5, 0.25, 1, 1).bytes())) << "no version";
  EXPECT_FALSE(codecs::read_course(table(7, -1, 0.25, 1, 1).bytes()));
  EXPECT_FALSE(codecs::read_course(table(7, 12.5, -0.25, 1, 1).bytes()));
  EXPECT_FALSE(codecs::read_course(table(7, 12.5, 3601, 1, 1).bytes()));
  EXPECT_FALSE(codecs::read_course(table(7, 12.5, 1e-4, 1, 1).bytes()));
  EXPECT_TRUE(codecs::read_course(table(7, 12.5, 0, 1, 1).bytes()));
  EXPECT_FALSE(codecs::read_course(table(7, 12.5, 0.25, 2, 1).bytes()));
  EXPECT_FALSE(codecs::read_course(table(7, 12.5, 0.25, 1, 0.9).bytes())) << "no rotation";
  EXPECT_FALSE(codecs::read_course(table(7, 12.5, 0.25, 1, 1).u(8, 0).bytes())) << "too long";
}

TEST(Protocol, EditRequest) {
  const auto text = [](Table& t, const std::string& words) {
    for (const char c : words) t.u(8, static_cast<unsigned char>(c));
  };
  const auto table = [&](unsigned kind, unsigned flags, const std::string& name, double radius_m, double depth_m) {
    Table t = Table().u(64, 77).u(8, kind).u(8, flags).u(8, static_cast<unsigned>(name.size()));
    text(t, name);
    for (const double v : {1.0, 2.0, 3.0, radius_m, depth_m, 0.5}) t.f64(v);
    if (flags == 1)
      for (const double v : {4.0, 5.0, 6.0, 0.0, 1.0, 0.0, 0.0}) t.f64(v);
    return t;
  };
  std::array<std::byte, codecs::kMostEditBytes> payload;
  codecs::EditRequest request{77, codecs::EditKind::kStamp, "cog", {1, 2, 3}, 0.01, 0.002, {}, 0.5};
  EXPECT_BYTES(std::span(payload).first(codecs::write(request, payload)), table(1, 0, "cog", 0.01, 0.002));
  request.kind = codecs::EditKind::kMove;
  request.X_WM = spatial::Pose{{0, 1, 0, 0}, {4, 5, 6}};
  EXPECT_BYTES(std::span(payload).first(codecs::write(request, payload)), table(3, 1, "cog", 0.01, 0.002));
  EXPECT_EQ(codecs::read_edit_request(table(3, 1, "cog", 0.01, 0.002).bytes()).value().X_WM->p, glm::dvec3(4, 5, 6));
  EXPECT_TRUE(codecs::read_edit_request(table(1, 0, std::string(64, 'x'), 0.01, 0.002).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, std::string(65, 'x'), 0.01, 0.002).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, "", 0.01, 0.002).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, "a\x1b[2J", 0.01, 0.002).bytes())) << "steers a terminal";
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, "a\xc2\x9b", 0.01, 0.002).bytes())) << "steers a terminal";
  EXPECT_FALSE(codecs::read_edit_request(table(0, 0, "cog", 0.01, 0.002).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(6, 0, "cog", 0.01, 0.002).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(1, 2, "cog", 0.01, 0.002).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, "cog", 0.01, 0.02).bytes())) << "deeper than its ball";
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, "cog", 0.2, 0.02).bytes()));
  EXPECT_FALSE(codecs::read_edit_request(table(1, 0, "cog", 0.01, 0.002).u(8, 0).bytes())) << "too long";
}

TEST(Protocol, EditAnswerAndSceneNews) {
  std::array<std::byte, codecs::kMostEditBytes> payload;
  const auto answer = Table().u(64, 77).u(8, 1).u(32, 9).u(16, 2).u(8, 'o').u(8, 'k');
  EXPECT_BYTES(
      std::span(payload).first(codecs::write(codecs::EditAnswer{77, codecs::EditOutcome::kDone, 9, "ok"}, payload)),
      answer);
  EXPECT_TRUE(codecs::read_edit_answer(answer.bytes()).value().is_done());
  const auto news = Table().u(32, 9).u(32, 4).u(16, 2).u(8, 'o').u(8, 'k');
  EXPECT_BYTES(std::span(payload).first(codecs::write(codecs::SceneNews{9, 4, "ok"}, payload)), news);
  EXPECT_EQ(codecs::read_scene_news(news.bytes()).value().words, "ok");
  EXPECT_FALSE(codecs::read_scene_news(Table().u(32, 9).u(32, 4).u(16, 3).u(8, 'o').u(8, 'k').bytes()));
  EXPECT_FALSE(codecs::read_scene_news(Table().u(32, 9).u(32, 4).u(16, 1).u(8, '\n').bytes()));
  EXPECT_FALSE(codecs::read_edit_answer(Table().u(64, 77).u(8, 4).u(32, 9).u(16, 0).bytes()));
  EXPECT_FALSE(codecs::read_scene_news(Table().u(32, 9).u(32, 10).u(16, 0).bytes())) << "durable before it is made";
  // Words that are too long are cut between two characters.
  std::string words(codecs::kMostEditWords - 1, 'x');
  const std::size_t bytes = codecs::write(codecs::SceneNews{9, 0, words + "\xc3\xa9"}, payload);
  EXPECT_EQ(codecs::read_scene_news(std::span(payload).first(bytes)).value().words, words);
}

TEST(Protocol, SaveRequestAndAnswer) {
  std::array<std::byte, codecs::kMostEditBytes> payload;
  const auto request = Table().u(64, 77);
  EXPECT_BYTES(std::span(payload).first(codecs::write(codecs::SaveRequest{77}, payload)), request);
  EXPECT_EQ(codecs::read_save_request(request.bytes()).value().number, 77u);
  EXPECT_EQ(codecs::write(codecs::SaveRequest{0}, payload), 0u);
  EXPECT_FALSE(codecs::read_save_request(Table().u(64, 0).bytes()));
  EXPECT_FALSE(codecs::read_save_request(Table().u(64, 77).u(8, 0).bytes())) << "too long";
  const auto table = [](unsigned outcome, unsigned first_of_hash) {
    Table t = Table().u(64, 77).u(8, outcome).u(32, 9).u(8, first_of_hash);
    for (int i = 1; i < 32; ++i) t.u(8, 0);
    return t.u(16, 2).u(8, 'o').u(8, 'k');
  };
  codecs::SaveAnswer answer{77, codecs::SaveOutcome::kOffered, 9, {std::byte{5}}, "ok"};
  EXPECT_BYTES(std::span(payload).first(codecs::write(answer, payload)), table(1, 5));
  EXPECT_EQ(codecs::read_save_answer(table(1, 5).bytes()).value().hash, answer.hash);
  EXPECT_EQ(codecs::read_save_answer(table(2, 0).bytes()).value().words, "ok");
  EXPECT_FALSE(codecs::read_save_answer(table(3, 0).bytes()));
  EXPECT_FALSE(codecs::read_save_answer(table(0, 5).bytes())) << "an object that is not offered";
  EXPECT_FALSE(codecs::read_save_answer(table(1, 5).u(8, 'k').bytes())) << "too long";
}

TEST(Protocol, ASceneAsFiles) {
  const auto text = [](Table& t, const std::string& words) {
    for (const char c : words) t.u(8, static_cast<unsigned char>(c));
  };
  const auto table = [&](unsigned count, const std::string& asset, unsigned bytes_of_asset = 2) {
    Table t = Table().u(32, 0x56534646).u(16, 1).u(16, count).u(8, 10);
    text(t, "scene.toml");
    t.u(32, 3);
    text(t, "x=1");
    t.u(8, static_cast<unsigned>(asset.size()));
    text(t, asset);
    t.u(32, bytes_of_asset).u(8, 6).u(8, 7);
    return t;
  };
  const std::array asset{std::byte{6}, std::byte{7}};
  const std::string toml = "x=1";
  const std::vector<codecs::SavedFile> files{{"scene.toml", std::as_bytes(std::span(toml))}, {"a.glb", asset}};
  const std::vector<std::byte> written = codecs::write_saved_scene(files);
  EXPECT_BYTES(std::span(written), table(2, "a.glb"));
  const Table kept = table(2, "a.glb");
  const auto read = codecs::read_saved_scene(kept.bytes());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->at(1).name, "a.glb");
  EXPECT_EQ(read->at(1).bytes[1], std::byte{7});
  for (const std::string name :
       {"../a.glb", "/a.glb", ".a.glb", "a.toml", "scene.toml", ".glb", "a b.glb", "a\n.glb", "a/b.glb"})
    EXPECT_FALSE(codecs::read_saved_scene(table(2, name).bytes())) << name;
  EXPECT_TRUE(codecs::read_saved_scene(table(2, std::string(60, 'x') + ".glb").bytes()));
  EXPECT_FALSE(codecs::read_saved_scene(table(2, std::string(61, 'x') + ".glb").bytes()));
  EXPECT_FALSE(codecs::read_saved_scene(table(1, "a.glb").bytes()));
  EXPECT_FALSE(codecs::read_saved_scene(table(259, "a.glb").bytes()));
  EXPECT_FALSE(codecs::read_saved_scene(table(2, "a.glb", 3).bytes())) << "longer than what is there";
  EXPECT_FALSE(codecs::read_saved_scene(table(2, "a.glb", 0).bytes()));
  EXPECT_FALSE(codecs::read_saved_scene(table(2, "a.glb").u(8, 0).bytes())) << "too long";
}

TEST(Protocol, TheOutlineOfWhatIsFelt) {
  geometry::HapticSurface surface;
  surface.coarse.positions_O = {{0, 0, 0}, {0.5, 0, 0}, {0, 0.25, 0}};
  surface.coarse.triangles = {{0, 1, 2}};
  surface.triangle_piece = {0};
  surface.triangle_chart = {0};
  surface.piece_count = 1;
  surface.piece_thickness_m = {0.125};
  surface.charts = {{.X_OH = {{1, 0, 0, 0}, {-0.5, 0, 0}}, .texel_m = 0.25, .columns = 31, .rows = 2, .first_tile = 0}};
  surface.tiles.resize(2);
  for (geometry::HeightTile& tile : surface.tiles) tile.coefficients.fill(2000);  // 0 m
  surface.scale = {-1, 0.5e-3};
  const penetration::FeltSurface felt(surface, {{{-0.5, 0.25}}, {8}});
  const contact::Material material{2000, 0.5, 0.25, 0.125};
  const contact_service::TouchableObject body{&surface, material, {{1, 0, 0, 0}, {1, 2, 3}}, &felt};
  contact_service::ContactOptions options;
  options.tolerance_m = 0.5;
  options.grid_samples = 50;
  options.soft_width_m = 0.25;
  const std::array bodies{body, body};
  const auto written = codecs::write_felt_outline(bodies, options);
  ASSERT_TRUE(written) << written.error();
  Table table;
  table.u(32, 0x4F464646).u(16, 3).u(16, 2).f64(0.5).f64(0.25).u(32, 50).u(32, 0);
  for (int i = 0; i < 2; ++i) {
    table.f64(1).f64(2).f64(3).f64(1).f64(0).f64(0).f64(0);
    table.f64(2000).f64(0.5).f64(0.25).f64(0.125).f64(-1).f64(0.5e-3);
    table.u(32, 3).u(32, 1).u(32, 1).u(32, 1);
    for (const float c : {0.0f, 0.0f, 0.0f, 0.5f, 0.0f, 0.0f, 0.0f, 0.25f, 0.0f}) table.f32(c);
    table.u(32, 0).u(32, 1).u(32, 2).u(32, 0).u(32, 0).f64(-0.5).f64(0.25);
    table.f32(0.125f);
    table.f64(-0.5).f64(0).f64(0).f64(1).f64(0).f64(0).f64(0).f64(0.25).u(32, 31).u(32, 2).f64(8);
    // Blocks 2000 (told as a difference from 0), 0, 0, 0 (from the one before), then the tiles' bounds 0, 0: by a range
    // coder that was written from the protocol's words alone.
    table.u(32, 7);
    for (const unsigned byte : {0x00, 0x10, 0xBF, 0x71, 0x1B, 0x23, 0xAE}) table.u(8, byte);
  }
  EXPECT_BYTES(*written, table);
  const auto read = codecs::read_felt_outline(*written);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->bodies[1].surface.piece_thickness_m, std::vector{0.125});
  EXPECT_EQ(read->bodies[1].surface.tiles.size(), 2u);
  EXPECT_EQ(read->bodies[1].limits.reliefs[0].high_m, 0.25);
  EXPECT_EQ(read->bodies[1].surface.tiles[1].at(3, 5), 2000);
  EXPECT_EQ(read->bodies[1].off_m, std::vector<double>(2, 0.0));
  for (std::size_t cut = 0; cut < written->size(); ++cut)
    EXPECT_FALSE(codecs::read_felt_outline(std::span(*written).first(cut)));

  const std::vector<std::byte> scene(3, std::byte{7});
  const auto object = codecs::session_object({scene, *written});
  EXPECT_BYTES(std::span(object).first(7), Table().u(32, 3).u(24, 0x070707));
  EXPECT_EQ(codecs::session_object_in(object)->felt.size(), written->size());
}

}  // namespace
}  // namespace farfeel
