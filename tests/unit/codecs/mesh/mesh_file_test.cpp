#include "codecs/mesh/mesh_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "codecs/asset/asset.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/private_folder.h"

namespace farfeel::codecs {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

// A unit tetrahedron in every format.
constexpr std::string_view kObj =
    "# a comment\nv 0 0 0\nv 1 0 0\r\nv 0 1 0 1.0\nvn 0 0 1\nv 0 0 1\nf 1/1/1 3 2\nf 1//1 2 4\nf -3 -2 -1\nf 1 4 3\n";
constexpr std::string_view kPly =
    "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar red\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 9\n1 0 0 9\n0 1 0 9\n0 0 1 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
constexpr std::string_view kGltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
  "nodes":[{"translation":[1,2,3],"scale":[2,2,2],"children":[1]},{"mesh":0}],
  "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
  "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
               {"bufferView":0,"byteOffset":48,"componentType":5121,"count":12,"type":"SCALAR"}],
  "bufferViews":[{"buffer":0,"byteLength":60}],
  "buffers":[{"byteLength":60,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAIBAAEDAQIDAAMC"}]})";

void expect_tetrahedron(const MeshResult& mesh, double volume = 1.0 / 6) {
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 4U);
  EXPECT_NEAR(geometry::signed_volume_m3(*mesh), volume, 1e-12);
}

TEST(MeshFileTest, ReadsTextFormats) {
  expect_tetrahedron(read_obj(bytes_of(kObj)));
  expect_tetrahedron(read_ply(bytes_of(kPly)));
  expect_tetrahedron(read_gltf(bytes_of(kGltf)), 8.0 / 6);
}

template <typename T>
void put(std::string& out, T value, bool big = false) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big) std::reverse(raw.begin(), raw.end());
  out.append(raw.data(), raw.size());
}

TEST(MeshFileTest, ReadsBinaryPlyOfBothByteOrders) {
  const geometry::TriangleMesh mesh = read_obj(bytes_of(kObj)).value();
  for (const bool big : {false, true}) {
    std::string file =
        std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nelement face 4\n"
        "property list uint8 uint32 vertex_index\nend_header\n";
    for (const glm::dvec3& p : mesh.positions_O) put(file, p.x, big), put(file, p.y, big), put(file, p.z, big);
    for (const geometry::Triangle& t : mesh.triangles) {
      put(file, std::uint8_t{3});
      for (const std::uint32_t v : t) put(file, v, big);
    }
    expect_tetrahedron(read_ply(bytes_of(file)));
    for (std::size_t n = 0; n < file.size(); ++n)
      EXPECT_FALSE(read_ply(bytes_of(std::string_view(file).substr(0, n)))) << n;
  }
}

TEST(MeshFileTest, ReadsStlAsTextAndBinary) {
  const geometry::TriangleMesh mesh = read_obj(bytes_of(kObj)).value();
  std::string binary(80, 's'), text = "solid t\n";
  put(binary, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const geometry::Triangle& t : mesh.triangles) {
    binary.append(12, '\0');
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : t) {
      const glm::vec3 p(mesh.positions_O[v]);
      put(binary, p.x), put(binary, p.y), put(binary, p.z);
      text += "  vertex " + std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
    }
    binary.append(2, '\0');
    text += "endloop\nendfacet\n";
  }
  expect_tetrahedron(read_stl(bytes_of(binary)));
  expect_tetrahedron(read_stl(bytes_of(text + "endsolid t\n")));
  EXPECT_FALSE(read_stl(bytes_of(binary.substr(0, binary.size() - 1))));
  EXPECT_FALSE(read_stl(bytes_of("")));
}

TEST(MeshFileTest, ReadsOffWithAndWithoutItsWordColoursAndNormals) {
  const std::string body =
      "4 4 6 # counts\n0 0 0\n1 0 0 9 9 9\n\n0 1 0\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  for (const char* head :
       {"OFF\n", "# made by hand\nOFF\n", "OFF ", "OFF", "", "COFF\n", "STCNOFF\r\n", "\xef\xbb\xbfOFF\n"})
    expect_tetrahedron(read_off(bytes_of(head + body)));
  for (const char* head : {"OFF BINARY\n", "4OFF\n", "nOFF\n3\n", "OFX\n"})
    EXPECT_FALSE(read_off(bytes_of(head + body))) << head;
  EXPECT_FALSE(read_off(bytes_of("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 4\n")));
  EXPECT_FALSE(read_off(bytes_of("OFF\n99999999999 1 0\n0 0 0\n")));
}

geometry::TriangleMesh corpus(const std::string& name) {
  const auto mesh = read_mesh_file(std::filesystem::path(FARFEEL_MESH_CORPUS) / name);
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh.value_or(MeshInFile());
}

TEST(MeshFileTest, AConcavePolygonIsTheSameShapeInEveryFormat) {
  for (const char* name : {"channel.obj", "channel.off", "channel.ply"}) {
    const geometry::TriangleMesh channel = corpus(name);
    EXPECT_NEAR(geometry::signed_volume_m3(channel), 0.2 * (0.6 * 0.4 - 0.3 * 0.3), 1e-7) << name;
    EXPECT_TRUE(geometry::is_closed_and_oriented(channel)) << name;
    for (const geometry::Triangle& t : channel.triangles) {  // none over the gap
      const glm::dvec3 middle =
          (channel.positions_O[t[0]] + channel.positions_O[t[1]] + channel.positions_O[t[2]]) / 3.0;
      EXPECT_FALSE(middle.x > 0.151 && middle.x < 0.449 && middle.y > 0.101) << name;
    }
  }
  const auto tie = read_mesh_file(std::filesystem::path(FARFEEL_MESH_CORPUS) / "bow_tie.obj");
  ASSERT_FALSE(tie);
  EXPECT_NE(tie.error().message.find("line 5: a polygon whose outline crosses itself"), std::string::npos);
}

TEST(MeshFileTest, LinesEndAsTheyLike) {
  for (const char* name : {"wrapped.obj", "returns.obj", "returns_strips.ply"})
    EXPECT_NEAR(geometry::signed_volume_m3(corpus(name)), 1.0 / 6, 1e-9) << name;
  EXPECT_EQ(corpus("returns_strips.ply").triangles.size(), 4U);
  EXPECT_FALSE(read_obj(bytes_of("v 0 0 \\"))) << "goes on, and ends";
  EXPECT_FALSE(read_ply(bytes_of("ply\rformat ascii 1.0\r\nelement vertex 1\n"))) << "mixed ends, and no end";
  EXPECT_FALSE(read_ply(bytes_of("ply")));
  EXPECT_FALSE(read_ply(bytes_of("ply\r\n\n")));
  std::string body(
      "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty uchar x\rproperty uchar y\r"
      "property uchar z\relement face 1\rproperty list uchar uchar vertex_index\rend_header\r");
  body += std::string("\n\0\0\0\n\0\0\0\n\3\0\1\2", 13);  // the first number is that of a newline
  const auto numbers = read_ply(bytes_of(body));
  ASSERT_TRUE(numbers) << numbers.error().message;
  EXPECT_EQ(numbers->positions_O[0].x, 10);
}

TEST(MeshFileTest, AMarkBeforeTheTextIsPassedOverAndOtherTextNamed) {
  const std::string mark = "\xef\xbb\xbf";
  expect_tetrahedron(
      read_obj(bytes_of(mark + "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")));
  expect_tetrahedron(read_ply(bytes_of(mark + std::string(kPly))));
  expect_tetrahedron(read_gltf(bytes_of(mark + std::string(kGltf))), 8.0 / 6);
  for (const bool is_marked : {true, false}) {
    for (const bool is_big : {true, false}) {
      for (const std::string_view text : {std::string_view("v 0 0 0\n"), kPly, kGltf, std::string_view("solid a\n")}) {
        std::string wide = is_marked ? (is_big ? "\xfe\xff" : "\xff\xfe") : "";
        for (const char c : text) wide += is_big ? std::string{0, c} : std::string{c, 0};
        for (const auto& read : {read_obj(bytes_of(wide)), read_off(bytes_of(wide)), read_ply(bytes_of(wide)),
                                 read_stl(bytes_of(wide)), read_gltf(bytes_of(wide))}) {
          ASSERT_FALSE(read);
          EXPECT_NE(read.error().message.find("UTF-16"), std::string::npos) << read.error().message;
        }
      }
    }
  }
}

TEST(MeshFileTest, BinaryStlIsReadByItsLengthWhereItsCountIsWrong) {
  for (const auto& [name, words] : {std::pair{"count_zero.stl", "its header counts 0 facets, its length holds 4"},
                                    {"count_max.stl", "counts 4294967295 facets"},
                                    {"trailing.stl", "2 bytes after the last of its 4 facets"},
                                    {"payload.stl", "bytes of the maker's"}}) {
    SCOPED_TRACE(name);
    const auto mesh = read_mesh_file(std::filesystem::path(FARFEEL_MESH_CORPUS) / name);
    expect_tetrahedron(mesh);
    ASSERT_EQ(mesh->notes.size(), 1U);
    EXPECT_NE(mesh->notes[0].find(words), std::string::npos) << mesh->notes[0];
  }
  std::string file(80, ' ');
  put(file, std::uint32_t{1});
  for (int i = 0; i < 12; ++i) put(file, static_cast<float>(i));
  file.append(2, '\0');
  EXPECT_TRUE(read_stl(bytes_of(file)).value().notes.empty());
  const std::string padded = file + std::string(100, '\0');  // padding of two facets' length is none
  EXPECT_EQ(read_stl(bytes_of(padded)).value().triangles.size(), 1U);
  EXPECT_EQ(read_stl(bytes_of(file + file.substr(84))).value().triangles.size(), 2U);
  const auto cut = read_stl(bytes_of(file.substr(0, 120)));
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().message.find("its header counts 1"), std::string::npos) << cut.error().message;
}

TEST(MeshFileTest, TextStlMayShoutAndHaveFacetsOfFourCorners) {
  const std::string quad =
      "SOLID A VERTEX\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 1 1 0\nVERTEX 0 1 0\n"
      "ENDLOOP\nENDFACET\n";
  EXPECT_EQ(read_stl(bytes_of(quad + "ENDSOLID A\n")).value().triangles.size(), 2U);
  EXPECT_FALSE(read_stl(bytes_of(quad + "FACET\nVERTEX 0 0 0\nVERTEX 1 0 0\n")));
  EXPECT_FALSE(read_stl(bytes_of("solid a\nfacet\nvertex 0 0 0\nvertex 1 0 0\nendloop\n")));
}

TEST(MeshFileTest, PointsWithoutFacesAreCalledThat) {
  const std::string splat =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property float f_dc_0\nend_header\n0 0 0 1\n";
  std::string points(kGltf);
  points.replace(points.find(R"("indices":1)"), 11, R"("mode":0)");
  for (const auto& [mesh, words] :
       {std::pair{read_obj(bytes_of("v 0 0 0\nv 1 0 0\n")), "cloud of 2 points"},
        {read_off(bytes_of("OFF\n1 0 0\n0 0 0\n")), "cloud of 1 point"},
        {read_mesh_file(std::filesystem::path(FARFEEL_MESH_CORPUS) / "cloud.ply"), "cloud of 2 points"},
        {read_ply(bytes_of(splat)), "Gaussian splat"},
        {read_gltf(bytes_of(points)), "no triangles"},
        {read_stl(bytes_of("solid empty\nendsolid empty\n")), "no triangles"},
        {read_obj(bytes_of("")), "no triangles"}}) {
    ASSERT_FALSE(mesh);
    EXPECT_NE(mesh.error().message.find(words), std::string::npos) << mesh.error().message;
  }
}

TEST(MeshFileTest, ReadsTheDracoMeshOfAnAsset) {
  Asset asset;
  asset.name = "plate";
  asset.felt = slave_sim::ridged_plate(0.003, 0.0005);
  asset.visible = asset.felt.coarse;
  asset.mass_kg = 1;
  asset.inertia_O_kg_m2 = glm::dmat3(1e-3);
  const auto mesh = read_gltf(write_asset(asset).value());
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 12U);
  EXPECT_NEAR(geometry::signed_volume_m3(*mesh), 0.040 * 0.030 * 0.004, 1e-8);
}

TEST(MeshFileTest, GltfIndicesOffsetsAndTreesAreChecked) {
  const auto reads_with = [](std::string_view from, std::string_view to) {
    std::string text(kGltf);
    const std::size_t found = text.find(from);
    EXPECT_NE(found, std::string::npos) << from;
    text.replace(found, from.size(), to);
    return read_gltf(bytes_of(text)).has_value();
  };
  EXPECT_TRUE(reads_with("2.0", "2.0"));
  EXPECT_FALSE(reads_with(R"("count":4)", R"("count":5000)"));
  EXPECT_FALSE(reads_with(R"("count":4)", R"("count":-4)"));
  EXPECT_FALSE(reads_with(R"("count":4)", R"("count":2)"));  // an index beyond
  EXPECT_FALSE(reads_with(R"("byteOffset":48)", R"("byteOffset":52)"));
  EXPECT_FALSE(reads_with(R"("byteLength":60}])", R"("byteLength":61}])"));
  EXPECT_FALSE(reads_with(R"("children":[1])", R"("children":[0])"));
  EXPECT_FALSE(reads_with(R"("children":[1])", R"("children":[7])"));
  EXPECT_FALSE(reads_with(R"({"mesh":0})", R"({"mesh":3})"));
  EXPECT_FALSE(reads_with("data:application/octet-stream;base64,", "../../etc/passwd?"));
  EXPECT_FALSE(reads_with(R"("type":"VEC3")", R"("type":"SCALAR")"));
  EXPECT_FALSE(reads_with("[1,2,3]", "[1,2]"));
}

TEST(MeshFileTest, GltfBuffersStandBesideTheDocumentAndNowhereElse) {
  const test_support::PrivateFolder around;
  const auto folder = std::filesystem::path(around / "beside");
  std::filesystem::create_directories(folder / "inner");
  const std::string_view data = "data:application/octet-stream;base64,";
  std::string text(kGltf);
  const std::size_t from = text.find(data), to = text.find('"', from);
  // The same bytes as a file: four corners, then twelve indices.
  std::string bytes;
  for (const float f : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F}) put(bytes, f);
  for (const int i : {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}) put(bytes, static_cast<std::uint8_t>(i));
  ASSERT_EQ(bytes.size(), 60U);
  const std::filesystem::path outside = folder.parent_path() / "farfeel_outside.bin";
  for (const auto& path : {folder / "parts.bin", folder / "my parts.bin", folder / "inner/Gerät 100%.bin", outside})
    std::ofstream(path, std::ios::binary) << bytes;
  std::filesystem::create_symlink(outside, folder / "way_out.bin");
  std::filesystem::create_symlink("parts.bin", folder / "way_in.bin");
  const auto read = [&](const std::string& name, const std::filesystem::path& where) {
    return read_gltf(bytes_of(std::string(text).replace(from, to - from, name)), where);
  };
  expect_tetrahedron(read("parts.bin", folder), 8.0 / 6);
  for (const char* name : {"my%20parts.bin", "my parts.bin", "./parts.bin", "inner/Ger%C3%A4t%20100%25.bin",
                           "inner/Gerät 100%25.bin", "inner/../parts.bin", "way_in.bin"})
    expect_tetrahedron(read(name, folder), 8.0 / 6);
  for (const char* name : {"../farfeel_outside.bin", "..%2Ffarfeel_outside.bin", "%2e%2e/farfeel_outside.bin", "inner",
                           "nothing.bin", "", "..", "/etc/passwd", "file:parts.bin", "http://a/parts.bin",
                           "inner/../../farfeel_outside.bin", "way_out.bin", "inner%5Cparts.bin", "parts.bin%00",
                           "my%2parts.bin", "inner/Gerät 100%.bin", "%2Fetc%2Fpasswd", "inner/", "C:/parts.bin"})
    EXPECT_FALSE(read(name, folder)) << name;
  EXPECT_FALSE(read("parts.bin", {})) << "nothing may stand beside it";
  std::ofstream(folder / "parts.bin", std::ios::binary) << bytes.substr(1);
  EXPECT_FALSE(read("parts.bin", folder)) << "a byte short";
  std::ofstream(folder / "parts.bin", std::ios::binary) << bytes + "padding";
  expect_tetrahedron(read("parts.bin", folder), 8.0 / 6);
}

TEST(MeshFileTest, GltfPartsThatAreNotFeltAreNotEvenLookedAt) {
  const auto with = [](const std::string& more) {
    std::string text(kGltf);
    text.insert(1, more);
    return read_gltf(bytes_of(text));
  };
  expect_tetrahedron(with(R"("images":[{"uri":"../no/such.png"},{"bufferView":99}],)"), 8.0 / 6);
  expect_tetrahedron(with(R"("materials":[{"pbrMetallicRoughness":7}],"skins":[{"joints":[99]}],"textures":3,)"),
                     8.0 / 6);
  expect_tetrahedron(with(R"("animations":[{"channels":[{"sampler":-1}]}],"cameras":[{}],)"), 8.0 / 6);
}

TEST(MeshFileTest, AnObjsObjectsOrElseItsGroupsAreItsParts) {
  const std::string faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  const auto parts_of = [&](const std::string& text) { return read_obj_parts(bytes_of(corners + text)); };
  const auto names_of = [&](const std::string& text) {
    std::string names;
    const auto parts = parts_of(text);
    for (const MeshPart& part : parts.value().parts) names += "[" + part.name + "]";
    return names;
  };
  EXPECT_EQ(names_of(faces), "[]");
  EXPECT_EQ(names_of("o a nut \r\n" + faces + "o\n" + faces), "[a nut][]");
  EXPECT_EQ(names_of("g one\n" + faces + "g two\n" + faces + "g one\n" + faces + "g none\n"), "[one][two]");
  EXPECT_EQ(names_of("g one\no whole\n" + faces + "g two\n" + faces), "[whole]");
  const auto two = parts_of("g one\nf 1 3 2\nf 1 2 4\ng two\nf 2 3 4\nf 1 4 3\ng one\nf 1 2 3\n");
  ASSERT_TRUE(two);
  EXPECT_EQ(two->shapes[0].triangles.size(), 3U);
  EXPECT_EQ(two->shapes[1].triangles.size(), 2U);
  EXPECT_EQ(two->shapes[0].positions_O.size(), 4U);
  expect_tetrahedron(read_obj(bytes_of(corners + "g one\no whole\n" + faces)), 1.0 / 6);
  EXPECT_FALSE(parts_of("o nothing\n"));
  const test_support::PrivateFolder folder;
  std::ofstream(std::filesystem::path(folder / "part.stl")) << "solid";
  const auto stl = read_mesh_parts(std::filesystem::path(folder / "part.stl"));
  ASSERT_FALSE(stl);
  EXPECT_NE(stl.error().message.find("has no parts"), std::string::npos);
}

TEST(MeshFileTest, ColoursOfVerticesAreKept) {
  const std::string faces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n", head = "ply\nformat ascii 1.0\nelement vertex 4\n";
  const std::string end = "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
  const auto ply = [&](const std::string& type, const std::string& first, const std::string& prefix = "") {
    std::string text = head + "property float x\nproperty float y\nproperty float z\n";
    for (const char* name : {"red", "green", "blue"}) text += "property " + type + " " + prefix + name + "\n";
    return read_ply(bytes_of(text + end + "0 0 0 " + first + "\n1 0 0 0 0 0\n0 1 0 0 0 0\n0 0 1 0 0 0\n" + faces));
  };
  const std::vector<Colour> expected{{255, 128, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(ply("uchar", "255 128 0").value().colours, expected);
  EXPECT_EQ(ply("float", "1 0.502 -3").value().colours, expected);
  EXPECT_EQ(ply("ushort", "65535 32896 0", "diffuse_").value().colours, expected);
  const auto obj = [&](const std::string& rest) {
    return read_obj(bytes_of("v 0 0 0 1 0.502 nan\n" + rest + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"));
  };
  EXPECT_EQ(obj("v 1 0 0 0 0 0\nv 0 1 0 0 0 0\nv 0 0 1 0 0 0\n").value().colours, expected);
  EXPECT_TRUE(obj("v 1 0 0 0 0 0\nv 0 1 0\nv 0 0 1 0 0 0\n").value().colours.empty()) << "not all have one";
  EXPECT_TRUE(read_obj(bytes_of(kObj)).value().colours.empty());
}

TEST(MeshFileTest, MessagesSayWhere) {
  const auto message = [](const MeshResult& mesh) { return mesh ? std::string() : mesh.error().message; };
  EXPECT_NE(message(read_obj(bytes_of("v 0 0 0\nf 1 2 3\n"))).find("line 2"), std::string::npos);
  EXPECT_NE(message(read_obj(bytes_of("v 0 zero 0\n"))).find("line 1"), std::string::npos);
  EXPECT_NE(message(read_ply(bytes_of("plx\n"))), "");
  EXPECT_NE(message(read_ply(bytes_of("ply\nformat ascii 1.0\nelement face 1\nend_header\n"))), "");
  EXPECT_NE(message(read_mesh_file("no/such/file.obj")).find("no/such/file.obj"), std::string::npos);
  EXPECT_NE(message(read_mesh_file("picture.png")).find(".stl"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::codecs
