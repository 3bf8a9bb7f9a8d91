// glTF 2.0: triangles (lists, strips, fans) of the default scene's nodes, placed in metres. Accessors may be plain or
// under KHR_draco_mesh_compression; sparse accessors, morphs and skins are not followed. What gltf_structure.h has
// checked is not checked again here.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <glm/gtc/type_ptr.hpp>

#include "codecs/mesh/draco_any.h"
#include "codecs/mesh/gltf_model.h"
#include "codecs/mesh/mesh_file.h"

namespace farfeel::codecs {
namespace {

using geometry::TriangleMesh;
template <typename T>
using Expected = tl::expected<T, std::string>;

constexpr std::size_t kMostVertices = 1U << 28;
constexpr int kMostNodeDepth = 64;

/// The first byte of every element of an accessor.
template <typename Each>
void walk(const tinygltf::Model& model, int accessor_index, Each each) {
  const tinygltf::Accessor& accessor = model.accessors.at(static_cast<std::size_t>(accessor_index));
  const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  const std::vector<unsigned char>& bytes = model.buffers.at(static_cast<std::size_t>(view.buffer)).data;
  const auto stride = static_cast<std::size_t>(accessor.ByteStride(view));
  for (std::size_t i = 0; i < accessor.count; ++i) each(&bytes[view.byteOffset + accessor.byteOffset + i * stride]);
}

Expected<TriangleMesh> draco_primitive(const tinygltf::Model& model, const tinygltf::Value& draco) {
  const auto view_index = static_cast<std::size_t>(draco.Get("bufferView").GetNumberAsInt());
  const tinygltf::BufferView& view = model.bufferViews.at(view_index);
  const std::vector<unsigned char>& bytes = model.buffers.at(static_cast<std::size_t>(view.buffer)).data;
  return draco_positions(std::as_bytes(std::span(bytes).subspan(view.byteOffset, view.byteLength)),
                         static_cast<std::uint32_t>(draco.Get("attributes").Get("POSITION").GetNumberAsInt()));
}

Expected<TriangleMesh> triangles_of(const tinygltf::Model& model, const tinygltf::Primitive& in) {
  const auto draco = in.extensions.find(kDracoExtension);
  if (draco != in.extensions.end()) return draco_primitive(model, draco->second);
  TriangleMesh out;
  walk(model, in.attributes.at("POSITION"), [&](const unsigned char* at) {
    std::array<float, 3> p{};
    std::memcpy(p.data(), at, sizeof p);
    out.positions_O.emplace_back(p[0], p[1], p[2]);
  });
  std::vector<std::uint32_t> order;
  if (in.indices >= 0) {
    const int type = model.accessors.at(static_cast<std::size_t>(in.indices)).componentType;
    const auto bytes = static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type)));
    walk(model, in.indices, [&](const unsigned char* at) {
      std::uint32_t value = 0;
      std::memcpy(&value, at, bytes);
      order.push_back(value);
    });
  } else {
    for (std::uint32_t i = 0; i < out.positions_O.size(); ++i) order.push_back(i);
  }
  for (const std::uint32_t i : order) {
    if (i >= out.positions_O.size())
      return tl::unexpected(fmt::format("an index names vertex {} of {}", i, out.positions_O.size()));
  }
  if (in.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (std::size_t i = 2; i < order.size(); ++i)
      out.triangles.push_back({order[i - 2], order[i - 1 + i % 2], order[i - i % 2]});
  } else if (in.mode == TINYGLTF_MODE_TRIANGLE_FAN) {
    for (std::size_t i = 2; i < order.size(); ++i) out.triangles.push_back({order[0], order[i - 1], order[i]});
  } else {
    for (std::size_t i = 2; i < order.size(); i += 3) out.triangles.push_back({order[i - 2], order[i - 1], order[i]});
  }
  return out;
}

glm::dmat4 placement(const tinygltf::Node& node) {
  if (!node.matrix.empty()) return glm::make_mat4(node.matrix.data());
  glm::dmat4 out(1);
  if (const auto& r = node.rotation; !r.empty()) out = glm::dmat4(glm::mat3_cast(glm::dquat(r[3], r[0], r[1], r[2])));
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (!node.scale.empty()) out[axis] *= node.scale[i];
    if (!node.translation.empty()) out[3][axis] = node.translation[i];
  }
  return out;
}

/// Adds what hangs on a node; what is wrong, or nothing. `visits` counts nodes: more than there are means no tree.
std::string add_node(const tinygltf::Model& model, int index, const glm::dmat4& parent, int depth, std::size_t& visits,
                     TriangleMesh& out) {
  if (depth > kMostNodeDepth || ++visits > model.nodes.size()) return "its nodes are not a tree";
  const tinygltf::Node& node = model.nodes.at(static_cast<std::size_t>(index));
  const glm::dmat4 place = parent * placement(node);
  if (node.mesh >= 0) {
    for (const tinygltf::Primitive& in : model.meshes.at(static_cast<std::size_t>(node.mesh)).primitives) {
      const auto part = triangles_of(model, in);
      if (!part) return part.error();
      const auto first = static_cast<std::uint32_t>(out.positions_O.size());
      if (first + part->positions_O.size() > kMostVertices) return "it has too many vertices";
      for (const glm::dvec3& p : part->positions_O) out.positions_O.emplace_back(place * glm::dvec4(p, 1));
      const bool is_mirrored = glm::determinant(glm::dmat3(place)) < 0;
      for (const auto& [a, b, c] : part->triangles)
        out.triangles.push_back({first + a, first + (is_mirrored ? c : b), first + (is_mirrored ? b : c)});
    }
  }
  for (const int child : node.children) {
    if (auto error = add_node(model, child, place, depth + 1, visits, out); !error.empty()) return error;
  }
  return {};
}

Expected<TriangleMesh> default_scene(const tinygltf::Model& model) {
  std::vector<int> roots;
  if (model.scenes.empty()) {
    for (std::size_t i = 0; i < model.nodes.size(); ++i) roots.push_back(static_cast<int>(i));
  } else {
    roots = model.scenes.at(static_cast<std::size_t>(std::max(model.defaultScene, 0))).nodes;
  }
  TriangleMesh out;
  std::size_t visits = 0;
  for (const int root : roots) {
    if (auto error = add_node(model, root, glm::dmat4(1), 0, visits, out); !error.empty()) return tl::unexpected(error);
  }
  return out;
}

}  // namespace

MeshResult read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  const auto model =
      checked_gltf(bytes, folder).and_then([&](const CheckedGltf& checked) { return loaded_gltf(checked, folder); });
  if (!model) return tl::unexpected(MeshError{model.error()});
  auto mesh = default_scene(*model);
  if (!mesh) return tl::unexpected(MeshError{mesh.error()});
  return with_faces({*std::move(mesh), {}});
}

}  // namespace farfeel::codecs
