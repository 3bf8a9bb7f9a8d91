#include "codecs/scene/draco_mesh.h"

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <cmath>
#include <cstring>
#include <exception>
#include <optional>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

constexpr double kMaxCoordinate_m = 1e4;
constexpr int kSpeed = 5;  // live speed; the best ratio (0) costs several times the time for a few per cent
// The smallest share of a byte that a triangle can take in a bitstream that somebody means: keeps a short hostile one
// from making Draco allocate for millions.
constexpr std::uint64_t kMaxTrianglesPerByte = 256;

std::optional<std::string> fault_of(const geometry::TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return "the mesh has no triangles";
  for (const glm::dvec3& p : mesh.positions_O) {
    for (int i = 0; i < 3; ++i) {
      if (!(std::abs(p[i]) <= kMaxCoordinate_m)) return "the mesh has a coordinate that is not finite or beyond 10 km";
    }
  }
  for (const geometry::Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) {
      if (index >= mesh.positions_O.size()) return "the mesh has a vertex index out of range";
    }
  }
  return std::nullopt;
}

std::uint32_t read_varint(transport::ByteReader& r) {
  std::uint32_t value = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    const std::uint8_t byte = r.u8();
    value |= static_cast<std::uint32_t>(byte & 0x7F) << shift;
    if ((byte & 0x80) == 0) break;
  }
  return value;
}

/// The number of triangles that the bitstream claims, if its beginning is that of our own writer.
std::optional<std::uint32_t> claimed_triangles(std::span<const std::byte> bitstream) {
  transport::ByteReader r(bitstream);
  const auto magic = r.bytes(5);
  if (!r.ok() || std::memcmp(magic.data(), "DRACO", 5) != 0) return std::nullopt;
  const bool is_2_2 = r.u8() == 2 && r.u8() == 2;
  const bool is_mesh = r.u8() == 1, is_edgebreaker = r.u8() == 1;
  const bool has_no_flags = r.u16() == 0;
  if (!is_2_2 || !is_mesh || !is_edgebreaker || !has_no_flags) return std::nullopt;
  (void)r.u8();  // kind of traversal
  const std::uint32_t vertices = read_varint(r), triangles = read_varint(r);
  if (!r.ok() || triangles == 0 || vertices > std::uint64_t{3} * triangles) return std::nullopt;
  return triangles;
}

}  // namespace

tl::expected<std::vector<std::byte>, std::string> write_draco(const geometry::TriangleMesh& mesh) {
  if (auto fault = fault_of(mesh)) return tl::unexpected(std::move(*fault));
  try {
    draco::Mesh out;
    out.set_num_points(static_cast<std::uint32_t>(mesh.positions_O.size()));
    draco::GeometryAttribute position;
    position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
    const int id = out.AddAttribute(position, true, out.num_points());
    for (std::uint32_t i = 0; i < out.num_points(); ++i) {
      const glm::vec3 p(mesh.positions_O[i]);
      out.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &p[0]);
    }
    out.SetNumFaces(mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& [a, b, c] = mesh.triangles[i];
      out.SetFace(draco::FaceIndex(i), {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, kPositionBits);
    draco::EncoderBuffer buffer;
    if (const auto status = encoder.EncodeMeshToBuffer(out, &buffer); !status.ok())
      return tl::unexpected("Draco could not encode the mesh: " + status.error_msg_string());
    const auto bytes = std::as_bytes(std::span(buffer.data(), buffer.size()));
    return std::vector(bytes.begin(), bytes.end());
  } catch (const std::exception& e) {
    return tl::unexpected(std::string("Draco could not encode the mesh: ") + e.what());
  }
}

tl::expected<geometry::TriangleMesh, std::string> read_draco(std::span<const std::byte> bitstream,
                                                             std::uint32_t max_triangles) {
  const auto claimed = claimed_triangles(bitstream);
  if (!claimed) return tl::unexpected(std::string("not a Draco 2.2 edgebreaker mesh"));
  if (*claimed > max_triangles || *claimed > kMaxTrianglesPerByte * bitstream.size())
    return tl::unexpected("the Draco mesh claims " + std::to_string(*claimed) + " triangles, too many");
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bitstream.data()), bitstream.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return tl::unexpected("Draco: " + decoded.status().error_msg_string());
    const std::unique_ptr<draco::Mesh> in = std::move(decoded).value();
    const draco::PointAttribute* position = in->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    if (position == nullptr || position->data_type() != draco::DT_FLOAT32 || position->num_components() != 3)
      return tl::unexpected(std::string("the Draco mesh has no f32 positions"));
    geometry::TriangleMesh mesh;
    mesh.positions_O.resize(in->num_points());
    for (std::uint32_t i = 0; i < in->num_points(); ++i) {
      const draco::AttributeValueIndex value = position->mapped_index(draco::PointIndex(i));
      glm::vec3 p(0);
      if (value.value() >= position->size())
        return tl::unexpected(std::string("the Draco mesh maps a point to no position"));
      position->GetValue(value, &p[0]);
      mesh.positions_O[i] = glm::dvec3(p);
    }
    mesh.triangles.resize(in->num_faces());
    for (std::uint32_t i = 0; i < in->num_faces(); ++i) {
      const draco::Mesh::Face& face = in->face(draco::FaceIndex(i));
      mesh.triangles[i] = {face[0].value(), face[1].value(), face[2].value()};
    }
    if (auto fault = fault_of(mesh)) return tl::unexpected(std::move(*fault));
    return mesh;
  } catch (const std::exception& e) {
    return tl::unexpected(std::string("Draco: ") + e.what());
  }
}

}  // namespace farfeel::codecs
