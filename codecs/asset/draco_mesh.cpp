#include "codecs/asset/draco_mesh.h"

#include <fmt/format.h>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wextra"
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <exception>
#include <limits>

namespace farfeel::codecs {
namespace {

using geometry::TriangleMesh;

tl::expected<TriangleMesh, std::string> decoded(std::span<const std::byte> bytes, int position_id) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto result = decoder.DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) return tl::unexpected(fmt::format("Draco: {}", result.status().error_msg_string()));
  const std::unique_ptr<draco::Mesh> mesh = std::move(result).value();
  const draco::PointAttribute* positions = position_id < 0
                                               ? mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION)
                                               : mesh->GetAttributeByUniqueId(static_cast<std::uint32_t>(position_id));
  if (positions == nullptr || positions->num_components() != 3)
    return tl::unexpected("Draco: no positions of three components");

  TriangleMesh out;
  out.positions_O.reserve(mesh->num_points());
  for (draco::PointIndex i(0); i < mesh->num_points(); ++i) {
    const draco::AttributeValueIndex value = positions->mapped_index(i);
    std::array<float, 3> p{};
    if (value.value() >= positions->size() || !positions->ConvertValue(value, p.data())) {
      return tl::unexpected("Draco: a vertex without a position");
    }
    out.positions_O.emplace_back(p[0], p[1], p[2]);
    if (!std::all_of(p.begin(), p.end(), [](float x) { return std::isfinite(x); })) {
      return tl::unexpected("Draco: a position is not a finite number");
    }
  }
  out.triangles.reserve(mesh->num_faces());
  for (draco::FaceIndex f(0); f < mesh->num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh->face(f);
    const geometry::Triangle t{face[0].value(), face[1].value(), face[2].value()};
    if (std::max({t[0], t[1], t[2]}) >= out.positions_O.size())
      return tl::unexpected("Draco: a triangle names no vertex");
    out.triangles.push_back(t);
  }
  return out;
}

}  // namespace

tl::expected<TriangleMesh, std::string> draco_decoded(std::span<const std::byte> bytes, int position_id) {
  try {
    return decoded(bytes, position_id);
  } catch (const std::exception& e) {
    return tl::unexpected(fmt::format("Draco: {}", e.what()));
  }
}

tl::expected<DracoMesh, std::string> draco_encoded(const TriangleMesh& mesh, int position_bits) {
  if (mesh.triangles.empty()) return tl::unexpected("Draco: the mesh has no triangles");
  draco::Mesh source;
  source.set_num_points(static_cast<std::uint32_t>(mesh.positions_O.size()));
  draco::GeometryAttribute kind;
  kind.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
  const int id = source.AddAttribute(kind, true, source.num_points());
  for (std::uint32_t i = 0; i < source.num_points(); ++i) {
    const glm::vec3 p(mesh.positions_O[i]);
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      return tl::unexpected(fmt::format("Draco: vertex {} is not a finite float", i));
    }
    source.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &p.x);
  }
  for (const geometry::Triangle& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= mesh.positions_O.size())
      return tl::unexpected("Draco: a triangle names no vertex");
    source.AddFace({draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
  }
  DracoMesh out;
  try {
    draco::Encoder encoder;
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, position_bits);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetSpeedOptions(1, 1);
    draco::EncoderBuffer buffer;
    if (const draco::Status status = encoder.EncodeMeshToBuffer(source, &buffer); !status.ok()) {
      return tl::unexpected(fmt::format("Draco: {}", status.error_msg_string()));
    }
    const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
    out.bytes.assign(first, first + buffer.size());
  } catch (const std::exception& e) {
    return tl::unexpected(fmt::format("Draco: {}", e.what()));
  }
  out.position_id = static_cast<std::uint32_t>(id);
  auto back = draco_decoded(out.bytes, id);
  if (!back) return tl::unexpected(back.error());
  out.decoded = std::move(*back);
  return out;
}

}  // namespace farfeel::codecs
