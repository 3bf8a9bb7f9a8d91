#include "codecs/mesh/draco_mesh.h"

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <cmath>
#include <exception>
#include <new>
#include <optional>
#include <utility>

#include "codecs/mesh/draco_bounds.h"

namespace farfeel::codecs {
namespace {

constexpr double kMaxCoordinate_m = 1e4;
constexpr int kSpeed = 5;  // live speed; the best ratio (0) costs several times the time for a few per cent

/// One value a point, in their order.
template <typename Value>
void add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, draco::DataType component,
                   std::span<const Value> values) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, 3, component, false, sizeof(Value), 0);
  const int id = mesh.AddAttribute(attribute, true, mesh.num_points());
  for (std::uint32_t i = 0; i < values.size(); ++i)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i][0]);
}

/// One value a point, or nothing where the attribute is not of that kind or has too few.
template <typename Value>
std::optional<std::vector<Value>> values_of(const draco::Mesh& mesh, const draco::PointAttribute* attribute,
                                            draco::DataType component) {
  if (attribute == nullptr || attribute->data_type() != component || attribute->num_components() != 3)
    return std::nullopt;
  std::vector<Value> values(mesh.num_points());
  for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
    const draco::AttributeValueIndex at = attribute->mapped_index(draco::PointIndex(i));
    if (at.value() >= attribute->size()) return std::nullopt;
    attribute->GetValue(at, &values[i][0]);
  }
  return values;
}

}  // namespace

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

tl::expected<std::vector<std::byte>, std::string> write_draco(const geometry::TriangleMesh& mesh, int position_bits,
                                                              std::span<const Colour> colours) {
  if (auto fault = fault_of(mesh)) return tl::unexpected(std::move(*fault));
  try {
    draco::Mesh out;
    out.set_num_points(static_cast<std::uint32_t>(mesh.positions_O.size()));
    const std::vector<glm::vec3> positions(mesh.positions_O.begin(), mesh.positions_O.end());
    add_attribute(out, draco::GeometryAttribute::POSITION, draco::DT_FLOAT32, std::span(positions));
    if (!colours.empty()) add_attribute(out, draco::GeometryAttribute::COLOR, draco::DT_UINT8, colours);
    out.SetNumFaces(mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& [a, b, c] = mesh.triangles[i];
      out.SetFace(draco::FaceIndex(i), {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, position_bits);
    // Colours go along the positions' own connectivity, so that the bitstream has no other.
    if (!colours.empty()) encoder.options().SetGlobalBool("split_mesh_on_seams", true);
    draco::EncoderBuffer buffer;
    if (const auto status = encoder.EncodeMeshToBuffer(out, &buffer); !status.ok())
      return tl::unexpected("Draco could not encode the mesh: " + status.error_msg_string());
    const auto bytes = std::as_bytes(std::span(buffer.data(), buffer.size()));
    return std::vector(bytes.begin(), bytes.end());
  } catch (const std::exception& e) {
    return tl::unexpected(std::string("Draco could not encode the mesh: ") + e.what());
  }
}

tl::expected<ColouredMesh, std::string> read_draco(std::span<const std::byte> bitstream, std::uint32_t max_triangles) {
  const auto bounds = draco_bounds(bitstream);
  if (!bounds) return tl::unexpected(std::string("not a Draco 2.2 edgebreaker mesh of positions and at most colours"));
  if (bounds->triangles > max_triangles)
    return tl::unexpected("the Draco mesh claims " + std::to_string(bounds->triangles) + " triangles, too many");
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bitstream.data()), bitstream.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return tl::unexpected("Draco: " + decoded.status().error_msg_string());
    const std::unique_ptr<draco::Mesh> in = std::move(decoded).value();
    const auto positions =
        values_of<glm::vec3>(*in, in->GetNamedAttribute(draco::GeometryAttribute::POSITION), draco::DT_FLOAT32);
    if (!positions) return tl::unexpected(std::string("the Draco mesh has no f32 position for each point"));
    ColouredMesh mesh;
    mesh.positions_O.assign(positions->begin(), positions->end());
    if (bounds->has_colours) {
      auto colours = values_of<Colour>(*in, in->GetNamedAttribute(draco::GeometryAttribute::COLOR), draco::DT_UINT8);
      if (!colours) return tl::unexpected(std::string("the Draco mesh has no colour of three bytes for each point"));
      mesh.colours = *std::move(colours);
    }
    mesh.triangles.resize(in->num_faces());
    for (std::uint32_t i = 0; i < in->num_faces(); ++i) {
      const draco::Mesh::Face& face = in->face(draco::FaceIndex(i));
      mesh.triangles[i] = {face[0].value(), face[1].value(), face[2].value()};
    }
    if (auto fault = fault_of(mesh)) return tl::unexpected(std::move(*fault));
    return mesh;
  } catch (const std::bad_alloc&) {
    return tl::unexpected(std::string("a mesh takes more memory than there is for it"));
  } catch (const std::exception& e) {
    return tl::unexpected(std::string("Draco: ") + e.what());
  }
}

std::optional<std::string> fault_of(std::span<const CodedMesh> meshes) {
  std::uint64_t triangles = 0;
  for (const CodedMesh& mesh : meshes) {
    if (mesh.triangles == 0 || mesh.triangles > kMaxMeshTriangles || mesh.bitstream.size() > kMaxMeshBytes)
      return "a mesh exceeds the format's bounds";
    triangles += mesh.triangles;
  }
  if (triangles > kMaxSceneTriangles) return "its meshes claim more than 4 million triangles";
  return std::nullopt;
}

DecodedMeshes decode_meshes(std::span<const CodedMesh> coded) {
  std::vector<ColouredMesh> meshes;
  for (const CodedMesh& one : coded) {
    auto mesh = read_draco(one.bitstream, one.triangles);
    if (!mesh) return tl::unexpected(mesh.error());
    meshes.push_back(*std::move(mesh));
  }
  return meshes;
}

}  // namespace farfeel::codecs
