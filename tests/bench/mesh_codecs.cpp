#include "tests/bench/mesh_codecs.h"

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <meshoptimizer.h>
#ifdef FARFEEL_BENCH_ZSTD
#include <zstd.h>
#endif

#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "codecs/mesh/draco_mesh.h"

namespace farfeel::bench {
namespace {

using geometry::TriangleMesh;
using Bytes = std::vector<std::byte>;

constexpr int kMeshLevel = 3;  // zstd's own default
constexpr std::uint32_t kMostTriangles = 1u << 23;

template <typename Number>
void append(Bytes& bytes, const std::vector<Number>& numbers) {
  const auto more = std::as_bytes(std::span(numbers));
  bytes.insert(bytes.end(), more.begin(), more.end());
}

template <typename Number>
std::vector<Number> taken(std::span<const std::byte>& bytes, std::size_t count) {
  std::vector<Number> numbers(count);
  std::memcpy(numbers.data(), bytes.data(), count * sizeof(Number));
  bytes = bytes.subspan(count * sizeof(Number));
  return numbers;
}

std::vector<std::uint32_t> indices_of(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> indices;
  for (const geometry::Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  return indices;
}

TriangleMesh mesh_of(std::vector<glm::dvec3> positions, const std::vector<std::uint32_t>& indices) {
  TriangleMesh mesh;
  mesh.positions_O = std::move(positions);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  return mesh;
}

Bytes draco_smallest(const TriangleMesh& mesh) {
  draco::Mesh out;
  out.set_num_points(static_cast<std::uint32_t>(mesh.positions_O.size()));
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
  const int id = out.AddAttribute(position, true, out.num_points());
  for (std::uint32_t i = 0; i < out.num_points(); ++i) {
    const glm::vec3 p(mesh.positions_O[i]);
    out.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &p[0]);
  }
  for (const auto& [a, b, c] : mesh.triangles)
    out.AddFace({draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetSpeedOptions(0, 0);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, codecs::kPositionBits);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(out, &buffer).ok()) return {};
  const auto bytes = std::as_bytes(std::span(buffer.data(), buffer.size()));
  return {bytes.begin(), bytes.end()};
}

/// Without our own decoder's checks, which know what ours writes alone.
TriangleMesh draco_decoded(std::span<const std::byte> bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) throw std::runtime_error("Draco does not read its own bytes");
  const auto in = std::move(decoded).value();
  const draco::PointAttribute* position = in->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < in->num_points(); ++i) {
    glm::vec3 p(0);
    position->GetValue(position->mapped_index(draco::PointIndex(i)), &p[0]);
    mesh.positions_O.emplace_back(p);
  }
  for (std::uint32_t i = 0; i < in->num_faces(); ++i) {
    const draco::Mesh::Face& face = in->face(draco::FaceIndex(i));
    mesh.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
  }
  return mesh;
}

struct Head {
  std::uint32_t vertices = 0, triangles = 0, coded_vertices = 0, coded_indices = 0;
  float low[3] = {}, step = 0;
};
struct GridPoint {
  std::uint16_t at[4] = {};  // the last is padding: strides are multiples of four bytes
};

Bytes meshopt_encoded(const TriangleMesh& mesh) {
  const geometry::Box box = geometry::bounding_box(mesh);
  const glm::dvec3 size = box.size();
  Head head{.vertices = static_cast<std::uint32_t>(mesh.positions_O.size()),
            .triangles = static_cast<std::uint32_t>(mesh.triangles.size())};
  head.step = static_cast<float>(std::max({size.x, size.y, size.z}) / ((1 << codecs::kPositionBits) - 1));
  for (int i = 0; i < 3; ++i) head.low[i] = static_cast<float>(box.low[i]);
  std::vector<GridPoint> points(mesh.positions_O.size());
  for (std::size_t v = 0; v < points.size(); ++v)
    for (int i = 0; i < 3; ++i)
      points[v].at[i] = static_cast<std::uint16_t>(std::lround((mesh.positions_O[v][i] - head.low[i]) / head.step));
  std::vector<std::uint32_t> indices = indices_of(mesh);
  meshopt_optimizeVertexCacheStrip(indices.data(), indices.data(), indices.size(), points.size());
  head.vertices = static_cast<std::uint32_t>(meshopt_optimizeVertexFetch(
      points.data(), indices.data(), indices.size(), points.data(), points.size(), sizeof(GridPoint)));
  std::vector<unsigned char> coded_points(meshopt_encodeVertexBufferBound(head.vertices, sizeof(GridPoint))),
      coded_indices(meshopt_encodeIndexBufferBound(indices.size(), head.vertices));
  coded_points.resize(meshopt_encodeVertexBuffer(coded_points.data(), coded_points.size(), points.data(), head.vertices,
                                                 sizeof(GridPoint)));
  coded_indices.resize(
      meshopt_encodeIndexBuffer(coded_indices.data(), coded_indices.size(), indices.data(), indices.size()));
  head.coded_vertices = static_cast<std::uint32_t>(coded_points.size());
  head.coded_indices = static_cast<std::uint32_t>(coded_indices.size());
  Bytes bytes;
  append(bytes, std::vector{head});
  append(bytes, coded_points);
  append(bytes, coded_indices);
  return zstd_packed(bytes, kMeshLevel);
}

TriangleMesh meshopt_decoded(std::span<const std::byte> packed) {
  const Bytes unpacked = zstd_unpacked(packed);
  std::span<const std::byte> bytes(unpacked);
  const Head head = taken<Head>(bytes, 1)[0];
  const auto coded_points = taken<unsigned char>(bytes, head.coded_vertices),
             coded_indices = taken<unsigned char>(bytes, head.coded_indices);
  std::vector<GridPoint> points(head.vertices);
  std::vector<std::uint32_t> indices(std::size_t{head.triangles} * 3);
  if (meshopt_decodeVertexBuffer(points.data(), points.size(), sizeof(GridPoint), coded_points.data(),
                                 coded_points.size()) != 0 ||
      meshopt_decodeIndexBuffer(indices.data(), indices.size(), sizeof(std::uint32_t), coded_indices.data(),
                                coded_indices.size()) != 0)
    throw std::runtime_error("meshoptimizer does not read its own bytes");
  std::vector<glm::dvec3> positions;
  for (const GridPoint& point : points)
    positions.emplace_back(head.low[0] + head.step * point.at[0], head.low[1] + head.step * point.at[1],
                           head.low[2] + head.step * point.at[2]);
  return mesh_of(std::move(positions), indices);
}

Bytes raw_encoded(const TriangleMesh& mesh) {
  std::vector<glm::vec3> positions(mesh.positions_O.begin(), mesh.positions_O.end());
  Bytes bytes;
  append(bytes, std::vector<std::uint64_t>{positions.size(), 3 * mesh.triangles.size()});
  append(bytes, positions);
  append(bytes, indices_of(mesh));
  return zstd_packed(bytes, kMeshLevel);
}

TriangleMesh raw_decoded(std::span<const std::byte> packed) {
  const Bytes unpacked = zstd_unpacked(packed);
  std::span<const std::byte> bytes(unpacked);
  const auto counts = taken<std::uint64_t>(bytes, 2);
  const auto positions = taken<glm::vec3>(bytes, counts[0]);
  const auto indices = taken<std::uint32_t>(bytes, counts[1]);
  return mesh_of({positions.begin(), positions.end()}, indices);
}

}  // namespace

#ifdef FARFEEL_BENCH_ZSTD
bool has_zstd() {
  return true;
}

Bytes zstd_packed(std::span<const std::byte> bytes, int level) {
  Bytes packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0) throw std::runtime_error("zstd does not pack");
  packed.resize(size);
  return packed;
}

Bytes zstd_unpacked(std::span<const std::byte> packed) {
  Bytes bytes(ZSTD_getFrameContentSize(packed.data(), packed.size()));
  if (ZSTD_isError(ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size())) != 0)
    throw std::runtime_error("zstd does not read its own bytes");
  return bytes;
}
#else
bool has_zstd() {
  return false;
}
Bytes zstd_packed(std::span<const std::byte> bytes, int) {
  return {bytes.begin(), bytes.end()};
}
Bytes zstd_unpacked(std::span<const std::byte> packed) {
  return {packed.begin(), packed.end()};
}
#endif

std::vector<MeshCodec> mesh_codecs() {
  std::vector<MeshCodec> all{
      {"draco", [](const TriangleMesh& mesh) { return codecs::write_draco(mesh).value_or(Bytes{}); },
       [](std::span<const std::byte> bytes) { return codecs::read_draco(bytes, kMostTriangles).value(); }},
      {"draco_smallest", draco_smallest, draco_decoded}};
  if (has_zstd()) {
    all.push_back({"meshopt_zstd", meshopt_encoded, meshopt_decoded});
    all.push_back({"raw_zstd", raw_encoded, raw_decoded});
  }
  return all;
}

}  // namespace farfeel::bench
