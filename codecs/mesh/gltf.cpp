// glTF 2.0: triangles (lists, strips, fans) of the default scene's nodes, placed in metres, morphed and skinned as the
// file stands. Accessors may be plain, sparse, quantised, or under KHR_draco_mesh_compression or
// EXT_meshopt_compression. What gltf_structure.h
// has checked is not checked again here.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/gtc/type_ptr.hpp>

#include "codecs/mesh/draco_any.h"
#include "codecs/mesh/gltf_model.h"
#include "codecs/mesh/mesh_parts.h"

namespace farfeel::codecs {
namespace {

using geometry::TriangleMesh;
template <typename T>
using Expected = tl::expected<T, std::string>;

constexpr std::size_t kMostVertices = 1U << 26, kMostTriangles = 1U << 26;  // some 3 GB; nodes may repeat a mesh

/// One of an accessor's components.
double component_at(const unsigned char* at, int type, bool is_normalized) {
  const auto of = [&]<typename T>(T value, double one) {
    std::memcpy(&value, at, sizeof value);
    return is_normalized ? std::max(static_cast<double>(value) / one, -1.0) : static_cast<double>(value);
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return of(std::int8_t{}, 127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return of(std::uint8_t{}, 255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return of(std::int16_t{}, 32'767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return of(std::uint16_t{}, 65'535);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return of(std::uint32_t{}, 1);
    default:
      return of(float{}, 1);
  }
}

/// All components of an accessor, element by element, with its sparse ones in their place.
Expected<std::vector<double>> numbers_of(const tinygltf::Model& model, int accessor_index) {
  const tinygltf::Accessor& accessor = model.accessors.at(static_cast<std::size_t>(accessor_index));
  const auto components =
      static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
  const auto size_of = [](int type) {
    return static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type)));
  };
  const auto bytes_at = [&](int view_index, std::size_t offset) {
    const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(view_index));
    return model.buffers.at(static_cast<std::size_t>(view.buffer)).data.data() + view.byteOffset + offset;
  };
  const std::size_t size = size_of(accessor.componentType);
  std::vector<double> out(accessor.count * components);
  const auto read_element = [&](const unsigned char* from, std::size_t element) {
    for (std::size_t c = 0; c < components; ++c)
      out[element * components + c] = component_at(from + c * size, accessor.componentType, accessor.normalized);
  };
  if (accessor.bufferView >= 0) {
    const unsigned char* first = bytes_at(accessor.bufferView, accessor.byteOffset);
    const auto stride = static_cast<std::size_t>(
        accessor.ByteStride(model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView))));
    for (std::size_t i = 0; i < accessor.count; ++i) read_element(first + i * stride, i);
  }
  if (const auto& sparse = accessor.sparse; sparse.isSparse) {
    const auto offset = [](auto given) { return static_cast<std::size_t>(given); };
    const unsigned char* indices = bytes_at(sparse.indices.bufferView, offset(sparse.indices.byteOffset));
    const unsigned char* values = bytes_at(sparse.values.bufferView, offset(sparse.values.byteOffset));
    for (std::size_t i = 0; i < static_cast<std::size_t>(sparse.count); ++i) {
      const double element =
          component_at(indices + i * size_of(sparse.indices.componentType), sparse.indices.componentType, false);
      if (!(element < static_cast<double>(accessor.count)))
        return tl::unexpected(fmt::format("a sparse accessor names element {} of {}", element, accessor.count));
      read_element(values + i * components * size, static_cast<std::size_t>(element));
    }
  }
  return out;
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
  const auto positions = numbers_of(model, in.attributes.at("POSITION"));
  if (!positions) return tl::unexpected(positions.error());
  for (std::size_t i = 0; i < positions->size(); i += 3)
    out.positions_O.emplace_back((*positions)[i], (*positions)[i + 1], (*positions)[i + 2]);
  std::vector<std::uint32_t> order;
  if (in.indices >= 0) {
    const auto indices = numbers_of(model, in.indices);
    if (!indices) return tl::unexpected(indices.error());
    for (const double index : *indices) order.push_back(static_cast<std::uint32_t>(index));
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

/// A document's nodes as the tree that they form.
struct Tree {
  std::vector<int> parent;       ///< -1: nobody's child
  std::vector<glm::dmat4> X_WN;  ///< where each node stands in the scene
};

Expected<Tree> tree_of(const tinygltf::Model& model) {
  Tree tree{std::vector<int>(model.nodes.size(), -1), std::vector<glm::dmat4>(model.nodes.size(), glm::dmat4(1))};
  const std::string no_tree = "its nodes are not a tree: one hangs on two others, or on itself; export it again";
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    for (const int child : model.nodes[i].children) {
      int& parent = tree.parent.at(static_cast<std::size_t>(child));
      if (parent >= 0) return tl::unexpected(no_tree);
      parent = static_cast<int>(i);
    }
  }
  std::vector<int> reached;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    if (tree.parent[i] < 0) reached.push_back(static_cast<int>(i));
  }
  for (std::size_t n = 0; n < reached.size(); ++n) {
    const auto i = static_cast<std::size_t>(reached[n]);
    const glm::dmat4 own = placement(model.nodes[i]);
    tree.X_WN[i] = tree.parent[i] < 0 ? own : tree.X_WN[static_cast<std::size_t>(tree.parent[i])] * own;
    reached.insert(reached.end(), model.nodes[i].children.begin(), model.nodes[i].children.end());
  }
  if (reached.size() < model.nodes.size()) return tl::unexpected(no_tree);
  return tree;
}

/// Moves a primitive's vertices by its morph targets, as far as they are weighted; what is wrong, or nothing.
std::string morph(const tinygltf::Model& model, const tinygltf::Primitive& in, const std::vector<double>& weights,
                  TriangleMesh& part) {
  for (std::size_t t = 0; t < std::min(weights.size(), in.targets.size()); ++t) {
    const auto found = in.targets[t].find("POSITION");
    if (weights[t] == 0 || found == in.targets[t].end()) continue;
    if (model.accessors.at(static_cast<std::size_t>(found->second)).count != part.positions_O.size())
      return "a morph target has another number of vertices than its mesh";
    const auto moves = numbers_of(model, found->second);
    if (!moves) return moves.error();
    for (std::size_t v = 0; v < part.positions_O.size(); ++v)
      part.positions_O[v] += weights[t] * glm::dvec3((*moves)[3 * v], (*moves)[3 * v + 1], (*moves)[3 * v + 2]);
  }
  return {};
}

/// Moves a primitive's vertices to where its joints take them (glTF 2.0, "Skins": the node's own place does not count),
/// as the joints stand in the file; what is wrong, or nothing.
std::string pose(const tinygltf::Model& model, const Tree& tree, const tinygltf::Primitive& in,
                 const tinygltf::Skin& skin, TriangleMesh& part) {
  std::vector<glm::dmat4> joints;
  for (const int joint : skin.joints) joints.push_back(tree.X_WN.at(static_cast<std::size_t>(joint)));
  if (skin.inverseBindMatrices >= 0) {
    const auto inverse = numbers_of(model, skin.inverseBindMatrices);
    if (!inverse) return inverse.error();
    for (std::size_t i = 0; i < joints.size(); ++i) joints[i] *= glm::make_mat4(&(*inverse)[16 * i]);
  }
  std::vector<glm::dmat4> moves(part.positions_O.size(), glm::dmat4(0));
  std::vector<double> sums(part.positions_O.size());
  for (int set = 0;; ++set) {
    const auto joint_at = in.attributes.find(fmt::format("JOINTS_{}", set)),
               weight_at = in.attributes.find(fmt::format("WEIGHTS_{}", set));
    if (joint_at == in.attributes.end() || weight_at == in.attributes.end()) break;
    const auto which = numbers_of(model, joint_at->second), weights = numbers_of(model, weight_at->second);
    if (!which || !weights) return which ? weights.error() : which.error();
    if (which->size() != 4 * moves.size() || weights->size() != which->size())
      return "a skinned mesh has another number of weights than of vertices";
    for (std::size_t i = 0; i < which->size(); ++i) {
      if ((*weights)[i] == 0) continue;
      const auto joint = static_cast<std::size_t>((*which)[i]);
      if (joint >= joints.size()) return fmt::format("a vertex hangs on joint {} of {}", joint, joints.size());
      moves[i / 4] += (*weights)[i] * joints[joint];
      sums[i / 4] += (*weights)[i];
    }
  }
  for (std::size_t v = 0; v < moves.size(); ++v) {
    if (!(sums[v] > 0)) return "a vertex of a skinned mesh hangs on no joint; apply the armature and export without it";
    part.positions_O[v] = glm::dvec3(moves[v] / sums[v] * glm::dvec4(part.positions_O[v], 1));
  }
  if (!joints.empty() && glm::determinant(glm::dmat3(joints[0])) < 0) {
    for (geometry::Triangle& t : part.triangles) std::swap(t[1], t[2]);
  }
  return {};
}

/// Colours of a primitive's vertices, which are light there; none where it has none, or another number of them.
Expected<std::vector<Colour>> colours_of(const tinygltf::Model& model, const tinygltf::Primitive& in,
                                         std::size_t vertices) {
  const auto found = in.attributes.find("COLOR_0");
  std::vector<Colour> out;
  if (found == in.attributes.end()) return out;
  const auto light = numbers_of(model, found->second);
  if (!light) return tl::unexpected(light.error());
  const std::size_t channels = light->size() / std::max<std::size_t>(1, vertices);
  if (light->size() != channels * vertices || channels < 3) return out;
  for (std::size_t v = 0; v < vertices; ++v) {
    Colour& colour = out.emplace_back();
    for (std::size_t c = 0; c < colour.size(); ++c) colour[c] = on_screen((*light)[channels * v + c]);
  }
  return out;
}

/// Adds a mesh; what is wrong, or nothing.
std::string add_mesh(const tinygltf::Model& model, const Tree& tree, const tinygltf::Mesh& mesh,
                     const tinygltf::Node& node, const glm::dmat4& X_WN, MeshInFile& out) {
  const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
  const bool is_morphed = std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; });
  for (const tinygltf::Primitive& in : mesh.primitives) {
    if (in.extensions.contains(kDracoExtension) && (node.skin >= 0 || is_morphed))
      return "a mesh under Draco hangs on a skeleton or is morphed, which is not understood; export without Draco";
    auto part = triangles_of(model, in);
    if (!part) return part.error();
    if (out.positions_O.size() + part->positions_O.size() > kMostVertices ||
        out.triangles.size() + part->triangles.size() > kMostTriangles)
      return fmt::format("its nodes show more than {} vertices or triangles; simplify it first", kMostVertices);
    if (auto wrong = morph(model, in, weights, *part); !wrong.empty()) return wrong;
    if (node.skin >= 0) {
      const tinygltf::Skin& skin = model.skins.at(static_cast<std::size_t>(node.skin));
      if (auto wrong = pose(model, tree, in, skin, *part); !wrong.empty()) return wrong;
      if (out.notes.empty()) out.notes.emplace_back("a skinned mesh stands as its joints do in the file");
    } else {
      for (glm::dvec3& p : part->positions_O) p = glm::dvec3(X_WN * glm::dvec4(p, 1));
    }
    const auto first = static_cast<std::uint32_t>(out.positions_O.size());
    const auto colours = colours_of(model, in, part->positions_O.size());
    if (!colours) return colours.error();
    if (!colours->empty() || !out.colours.empty()) {  // what has none is white beside what has some
      constexpr Colour kWhite{255, 255, 255};
      out.colours.resize(first, kWhite);
      out.colours.insert(out.colours.end(), colours->begin(), colours->end());
      out.colours.resize(first + part->positions_O.size(), kWhite);
    }
    const bool is_mirrored = node.skin < 0 && glm::determinant(glm::dmat3(X_WN)) < 0;
    out.positions_O.insert(out.positions_O.end(), part->positions_O.begin(), part->positions_O.end());
    for (const auto& [a, b, c] : part->triangles)
      out.triangles.push_back({first + a, first + (is_mirrored ? c : b), first + (is_mirrored ? b : c)});
  }
  return {};
}

/// The nodes with meshes of the default scene, or the first; without scenes of all that is nobody's child.
std::vector<std::size_t> shown_nodes(const tinygltf::Model& model, const Tree& tree) {
  std::vector<int> shown;
  if (!model.scenes.empty()) {
    shown = model.scenes.at(static_cast<std::size_t>(std::max(model.defaultScene, 0))).nodes;
  } else {
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
      if (tree.parent[i] < 0) shown.push_back(static_cast<int>(i));
    }
  }
  std::vector<bool> is_shown(model.nodes.size());
  std::vector<std::size_t> with_meshes;
  for (std::size_t n = 0; n < shown.size(); ++n) {
    const auto i = static_cast<std::size_t>(shown[n]);
    if (is_shown.at(i)) continue;
    is_shown[i] = true;
    shown.insert(shown.end(), model.nodes[i].children.begin(), model.nodes[i].children.end());
    if (model.nodes[i].mesh >= 0) with_meshes.push_back(i);
  }
  return with_meshes;
}

/// All that is shown; without nodes all meshes.
Expected<MeshInFile> default_scene(const tinygltf::Model& model) {
  const auto tree = tree_of(model);
  if (!tree) return tl::unexpected(tree.error());
  MeshInFile out;
  for (const std::size_t i : shown_nodes(model, *tree)) {
    const tinygltf::Node& node = model.nodes[i];
    const tinygltf::Mesh& mesh = model.meshes.at(static_cast<std::size_t>(node.mesh));
    if (auto wrong = add_mesh(model, *tree, mesh, node, tree->X_WN[i], out); !wrong.empty())
      return tl::unexpected(wrong);
  }
  if (model.nodes.empty() && model.scenes.empty()) {
    for (const tinygltf::Mesh& mesh : model.meshes) {
      if (auto wrong = add_mesh(model, *tree, mesh, {}, glm::dmat4(1), out); !wrong.empty())
        return tl::unexpected(wrong);
    }
  }
  return out;
}

/// A node's place as a turn and a shift, and what is left of it for the shape.
struct Placed {
  glm::dquat R{1, 0, 0, 0};
  glm::dvec3 p{0};
  glm::dmat3 shape{1};
};
Placed placed(const glm::dmat4& X_WN) {
  constexpr double kEven = 1e-6;  // of the scale: what exporters round to
  const glm::dmat3 A(X_WN);
  const double scale = std::cbrt(std::max(0.0, glm::determinant(A)));
  const glm::dmat3 AtA = glm::transpose(A) * A;
  bool is_even = scale > 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      is_even = is_even && std::abs(AtA[i][j] - (i == j ? scale * scale : 0)) < kEven * scale * scale;
  }
  if (!is_even) return {.p = glm::dvec3(X_WN[3]), .shape = A};
  return {glm::normalize(glm::quat_cast(A / scale)), glm::dvec3(X_WN[3]), glm::dmat3(scale)};
}

Expected<MeshParts> parts_of(const tinygltf::Model& model) {
  const auto tree = tree_of(model);
  if (!tree) return tl::unexpected(tree.error());
  MeshParts out;
  constexpr double kSameScale = 1e-6;
  std::size_t vertices = 0;
  std::vector<std::pair<int, glm::dmat3>> mesh_of_shape;
  for (const std::size_t i : shown_nodes(model, *tree)) {
    const tinygltf::Node& node = model.nodes[i];
    const bool stands_alone = node.skin >= 0 || !node.weights.empty();  // it may look like no other of its mesh
    const Placed at = node.skin >= 0 ? Placed{} : placed(tree->X_WN[i]);
    const auto is_same = [&](const std::pair<int, glm::dmat3>& shape) {
      double off = 0;
      for (int column = 0; column < 3; ++column)
        off = std::max(off, glm::length(shape.second[column] - at.shape[column]) / glm::length(at.shape[column]));
      return !stands_alone && shape.first == node.mesh && off < kSameScale;
    };
    const auto known = std::find_if(mesh_of_shape.begin(), mesh_of_shape.end(), is_same);
    if (known == mesh_of_shape.end()) {
      MeshInFile mesh;
      const tinygltf::Mesh& in = model.meshes.at(static_cast<std::size_t>(node.mesh));
      if (auto wrong = add_mesh(model, *tree, in, node, glm::dmat4(at.shape), mesh); !wrong.empty())
        return tl::unexpected(wrong);
      if (mesh.triangles.empty()) continue;  // points and lines
      if ((vertices += mesh.positions_O.size()) > kMostVertices)
        return tl::unexpected(fmt::format("its parts have more than {} vertices; simplify them first", kMostVertices));
      out.shapes.push_back(std::move(mesh));
      mesh_of_shape.emplace_back(stands_alone ? -1 : node.mesh, at.shape);
      out.parts.push_back({node.name, out.shapes.size() - 1, at.R, at.p});
    } else {
      out.parts.push_back({node.name, static_cast<std::size_t>(known - mesh_of_shape.begin()), at.R, at.p});
    }
    if (out.parts.size() > kMostParts) return tl::unexpected(too_many_parts());
  }
  if (out.parts.empty()) return tl::unexpected(std::string("no node of it shows triangles"));
  return out;
}

Expected<tinygltf::Model> model_of(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  return checked_gltf(bytes, folder).and_then([&](const CheckedGltf& checked) { return loaded_gltf(checked, folder); });
}

}  // namespace

MeshResult read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  auto mesh = model_of(bytes, folder).and_then(default_scene);
  if (!mesh) return tl::unexpected(MeshError{mesh.error()});
  return with_faces(*std::move(mesh));
}

tl::expected<MeshParts, MeshError> read_gltf_parts(std::span<const std::byte> bytes,
                                                   const std::filesystem::path& folder) {
  auto parts = model_of(bytes, folder).and_then(parts_of);
  if (!parts) return tl::unexpected(MeshError{parts.error()});
  return *std::move(parts);
}

}  // namespace farfeel::codecs
