// glTF 2.0: triangles (lists, strips, fans) of the default scene's nodes, placed in metres. Accessors may be plain or
// under KHR_draco_mesh_compression; sparse accessors, morphs and skins are not followed. Every index, offset and stride
// is checked against the bytes that are there.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <glm/gtc/type_ptr.hpp>

#include "codecs/asset/glb.h"
#include "codecs/mesh/draco_any.h"
#include "codecs/mesh/mesh_file.h"

namespace farfeel::codecs {
namespace {

using geometry::TriangleMesh;
using nlohmann::json;
template <typename T>
using Expected = tl::expected<T, std::string>;

constexpr std::uint64_t kMost = 1U << 28;
constexpr int kMostNodeDepth = 64;
constexpr const char* kDraco = "KHR_draco_mesh_compression";

tl::unexpected<std::string> wrong(std::string why) {
  return tl::unexpected(std::move(why));
}

Expected<std::vector<std::byte>> base64(std::string_view text) {
  std::vector<std::byte> out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    int value = -1;
    if (c >= 'A' && c <= 'Z') value = c - 'A';
    if (c >= 'a' && c <= 'z') value = c - 'a' + 26;
    if (c >= '0' && c <= '9') value = c - '0' + 52;
    if (c == '+' || c == '-') value = 62;
    if (c == '/' || c == '_') value = 63;
    if (c == '=') break;
    if (value < 0) return wrong("a buffer's base64 has a character that is none");
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    if (++count == 4) {
      for (int shift = 16; shift >= 0; shift -= 8) out.push_back(static_cast<std::byte>(bits >> shift & 0xFF));
      bits = 0, count = 0;
    }
  }
  if (count == 2) out.push_back(static_cast<std::byte>(bits >> 4 & 0xFF));
  if (count == 3) {
    out.push_back(static_cast<std::byte>(bits >> 10 & 0xFF));
    out.push_back(static_cast<std::byte>(bits >> 2 & 0xFF));
  }
  return out;
}

class Document {
 public:
  static Expected<Document> open(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
    Document document;
    std::span<const std::byte> binary;
    if (bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
      auto glb = split_glb(bytes);
      if (!glb) return wrong("it " + glb.error());
      document.json_ = std::move(glb->json);
      binary = glb->binary;
    } else {
      document.json_ = bounded_json({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
      if (!document.json_.is_object()) return wrong("it is neither a .glb nor a JSON object");
    }
    const json& buffers = document.list("buffers");
    for (std::size_t i = 0; i < buffers.size(); ++i) {
      const json& buffer = buffers[i];
      if (!buffer.is_object()) return wrong("a buffer is no object");
      const auto uri = buffer.find("uri");
      if (uri == buffer.end()) {
        if (i != 0) return wrong(fmt::format("buffer {} is nowhere", i));
        document.buffers_.emplace_back(binary.begin(), binary.end());
        continue;
      }
      if (!uri->is_string()) return wrong("a buffer's uri is no text");
      auto contents = document.contents_of(uri->get<std::string>(), folder);
      if (!contents) return wrong(contents.error());
      document.buffers_.push_back(std::move(*contents));
    }
    return document;
  }

  Expected<TriangleMesh> mesh() const {
    TriangleMesh out;
    const json& scenes = list("scenes");
    const json& nodes = list("nodes");
    std::vector<std::size_t> roots;
    if (!scenes.empty()) {
      const auto scene =
          json_.contains("scene") ? bounded_integer(json_, "scene", scenes.size() - 1) : Expected<std::uint64_t>(0);
      if (!scene) return wrong(scene.error());
      for (const json& root : list_in(scenes[*scene], "nodes")) {
        if (!root.is_number_unsigned() || root.get<std::uint64_t>() >= nodes.size())
          return wrong("a scene names no node");
        roots.push_back(root.get<std::size_t>());
      }
    } else {
      for (std::size_t i = 0; i < nodes.size(); ++i) roots.push_back(i);
    }
    std::size_t visits = 0;
    for (const std::size_t root : roots) {
      if (auto error = add_node(root, glm::dmat4(1), 0, visits, out); !error.empty()) return wrong(error);
    }
    return out;
  }

 private:
  static const json& nothing() {
    static const json kNothing = json::array();
    return kNothing;
  }
  static const json& list_in(const json& object, const char* key) {
    const auto found = object.is_object() ? object.find(key) : object.end();
    return object.is_object() && found != object.end() && found->is_array() ? *found : nothing();
  }
  [[nodiscard]] const json& list(const char* key) const { return list_in(json_, key); }

  static Expected<std::vector<std::byte>> contents_of(const std::string& uri, const std::filesystem::path& folder) {
    if (uri.starts_with("data:")) {
      const std::size_t comma = uri.find(";base64,");
      if (comma == std::string::npos) return wrong("a buffer's data URI is not base64");
      return base64(std::string_view(uri).substr(comma + 8));
    }
    const std::filesystem::path name(uri);
    const bool is_beside = !name.is_absolute() && name == name.filename() && name != "." && name != "..";
    if (folder.empty() || !is_beside)
      return wrong(fmt::format("its buffer '{}' is not a file beside it", uri.substr(0, 60)));
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(folder / name, error);
    if (error || size > (1ULL << 31)) return wrong(fmt::format("its buffer '{}' cannot be read", uri.substr(0, 60)));
    std::vector<std::byte> contents(size);
    std::ifstream in(folder / name, std::ios::binary);
    in.read(reinterpret_cast<char*>(contents.data()), static_cast<std::streamsize>(size));
    if (!in) return wrong(fmt::format("its buffer '{}' cannot be read", uri.substr(0, 60)));
    return contents;
  }

  struct View {
    std::span<const std::byte> bytes;
    std::uint64_t stride = 0;  ///< 0: packed
  };
  [[nodiscard]] Expected<View> view(std::uint64_t index) const {
    const json& views = list("bufferViews");
    if (index >= views.size()) return wrong(fmt::format("there is no bufferView {}", index));
    const auto buffer = bounded_integer(views[index], "buffer", kMost);
    if (!buffer || *buffer >= buffers_.size()) return wrong(fmt::format("bufferView {} names no buffer", index));
    // As in an asset, but of any buffer: lend buffer_view() a document in which it is the first.
    json alone = views[index];
    alone["buffer"] = 0U;
    json document;
    document["bufferViews"] = json::array({alone});
    const auto bytes = buffer_view(document, buffers_[*buffer], 0);
    if (!bytes) return wrong(bytes.error());
    View out{*bytes};
    if (views[index].contains("byteStride")) {
      const auto stride = bounded_integer(views[index], "byteStride", 252);
      if (!stride) return wrong(stride.error());
      out.stride = *stride;
    }
    return out;
  }

  /// Calls each(i, pointer to the first component) for every element of a plain accessor.
  template <typename Each>
  std::string walk(std::uint64_t index, std::string_view type, std::span<const int> component_types, Each each) const {
    const json& accessors = list("accessors");
    if (index >= accessors.size()) return fmt::format("there is no accessor {}", index);
    const json& accessor = accessors[index];
    if (accessor.contains("sparse")) return "sparse accessors are not understood; export without them";
    const auto count = bounded_integer(accessor, "count", kMost);
    const auto component = bounded_integer(accessor, "componentType", 6000);
    const auto offset =
        accessor.contains("byteOffset") ? bounded_integer(accessor, "byteOffset", kMost) : Expected<std::uint64_t>(0);
    if (!count || !component || !offset) return fmt::format("accessor {} has no valid count, type or offset", index);
    const auto kind = accessor.find("type");
    if (kind == accessor.end() || *kind != type) return fmt::format("accessor {} is not of type {}", index, type);
    const int given = static_cast<int>(*component);
    if (std::find(component_types.begin(), component_types.end(), given) == component_types.end()) {
      return fmt::format("accessor {} has components of type {}, which does not do here", index, given);
    }
    if (!accessor.contains("bufferView")) return fmt::format("accessor {} has no bytes", index);
    const auto where = bounded_integer(accessor, "bufferView", kMost);
    const auto bytes = where ? view(*where) : Expected<View>(wrong(where.error()));
    if (!bytes) return bytes.error();
    const std::uint64_t component_bytes = given == 5121 ? 1 : given == 5123 ? 2 : 4;
    const std::uint64_t element_bytes = component_bytes * (type == "VEC3" ? 3 : 1);
    const std::uint64_t stride = bytes->stride == 0 ? element_bytes : bytes->stride;
    if (*count > 0 &&
        (stride < element_bytes || *offset + (*count - 1) * stride + element_bytes > bytes->bytes.size())) {
      return fmt::format("accessor {} ends beyond its bufferView", index);
    }
    for (std::uint64_t i = 0; i < *count; ++i) each(&bytes->bytes[*offset + i * stride], given);
    return {};
  }

  Expected<TriangleMesh> primitive(const json& in) const {
    const auto mode =
        in.is_object() && in.contains("mode") ? bounded_integer(in, "mode", 6) : Expected<std::uint64_t>(4);
    if (!mode) return wrong(mode.error());
    TriangleMesh out;
    if (*mode < 4) return out;  // points and lines: nothing to feel
    if (in.contains("extensions") && in["extensions"].is_object() && in["extensions"].contains(kDraco)) {
      const json& draco = in["extensions"][kDraco];
      const auto where = bounded_integer(draco, "bufferView", kMost);
      const auto id = where && draco.contains("attributes")
                          ? bounded_integer(draco["attributes"], "POSITION", 1U << 16)
                          : Expected<std::uint64_t>(wrong("a Draco primitive has no POSITION"));
      if (!id) return wrong(id.error());
      const auto bytes = view(*where);
      if (!bytes) return wrong(bytes.error());
      return draco_positions(bytes->bytes, static_cast<std::uint32_t>(*id));
    }
    if (!in.contains("attributes")) return wrong("a primitive has no attributes");
    const auto position = bounded_integer(in["attributes"], "POSITION", kMost);
    if (!position) return wrong(position.error());
    constexpr std::array kFloatOnly{5126};
    constexpr std::array kIndexTypes{5121, 5123, 5125};
    std::string error = walk(*position, "VEC3", kFloatOnly, [&](const std::byte* at, int) {
      std::array<float, 3> p{};
      std::memcpy(p.data(), at, sizeof p);
      out.positions_O.emplace_back(p[0], p[1], p[2]);
    });
    if (!error.empty()) return wrong(error);
    std::vector<std::uint32_t> order;
    if (in.contains("indices")) {
      const auto indices = bounded_integer(in, "indices", kMost);
      if (!indices) return wrong(indices.error());
      error = walk(*indices, "SCALAR", kIndexTypes, [&](const std::byte* at, int type) {
        std::uint32_t value = 0;
        std::memcpy(&value, at, type == 5121 ? 1 : type == 5123 ? 2 : 4);
        order.push_back(value);
      });
      if (!error.empty()) return wrong(error);
    } else {
      for (std::uint32_t i = 0; i < out.positions_O.size(); ++i) order.push_back(i);
    }
    for (const std::uint32_t i : order) {
      if (i >= out.positions_O.size())
        return wrong(fmt::format("an index names vertex {} of {}", i, out.positions_O.size()));
    }
    constexpr std::uint64_t kStrip = 5, kFan = 6;
    if (*mode == kStrip) {
      for (std::size_t i = 2; i < order.size(); ++i) {
        out.triangles.push_back({order[i - 2], order[i - 1 + i % 2], order[i - i % 2]});
      }
    } else if (*mode == kFan) {
      for (std::size_t i = 2; i < order.size(); ++i) out.triangles.push_back({order[0], order[i - 1], order[i]});
    } else {
      for (std::size_t i = 2; i < order.size(); i += 3) out.triangles.push_back({order[i - 2], order[i - 1], order[i]});
    }
    return out;
  }

  static Expected<glm::dmat4> placement(const json& node) {
    const auto numbers = [&](const char* key, std::vector<double> values) -> Expected<std::vector<double>> {
      if (!node.contains(key)) return values;
      const json& given = node[key];
      if (!given.is_array() || given.size() != values.size())
        return wrong(fmt::format("a node's {} has the wrong length", key));
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (!given[i].is_number()) return wrong(fmt::format("a node's {} has something other than numbers", key));
        values[i] = given[i].get<double>();
      }
      return values;
    };
    const auto matrix = numbers("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    const auto t = numbers("translation", {0, 0, 0}), r = numbers("rotation", {0, 0, 0, 1}),
               s = numbers("scale", {1, 1, 1});
    for (const auto* part : {&matrix, &t, &r, &s}) {
      if (!*part) return wrong(part->error());
    }
    if (node.contains("matrix")) return glm::make_mat4(matrix->data());
    glm::dmat4 out(glm::mat3_cast(glm::dquat((*r)[3], (*r)[0], (*r)[1], (*r)[2])));
    for (int axis = 0; axis < 3; ++axis) out[axis] *= (*s)[axis], out[3][axis] = (*t)[axis];
    return out;
  }

  std::string add_node(std::size_t index, const glm::dmat4& parent, int depth, std::size_t& visits,
                       TriangleMesh& out) const {
    const json& nodes = list("nodes");
    if (depth > kMostNodeDepth || ++visits > nodes.size()) return "its nodes are not a tree";
    const json& node = nodes[index];
    if (!node.is_object()) return "a node is no object";
    const auto own = placement(node);
    if (!own) return own.error();
    const glm::dmat4 place = parent * *own;
    if (node.contains("mesh")) {
      const json& meshes = list("meshes");
      const auto mesh = bounded_integer(node, "mesh", kMost);
      if (!mesh || *mesh >= meshes.size()) return "a node names no mesh";
      for (const json& in : list_in(meshes[*mesh], "primitives")) {
        const auto part = primitive(in);
        if (!part) return part.error();
        const auto first = static_cast<std::uint32_t>(out.positions_O.size());
        if (first + part->positions_O.size() > kMost) return "it has too many vertices";
        for (const glm::dvec3& p : part->positions_O) out.positions_O.emplace_back(place * glm::dvec4(p, 1));
        const bool is_mirrored = glm::determinant(glm::dmat3(place)) < 0;
        for (const geometry::Triangle& t : part->triangles) {
          out.triangles.push_back({first + t[0], first + t[is_mirrored ? 2 : 1], first + t[is_mirrored ? 1 : 2]});
        }
      }
    }
    for (const json& child : list_in(node, "children")) {
      if (!child.is_number_unsigned() || child.get<std::uint64_t>() >= nodes.size()) return "a node names no child";
      if (auto error = add_node(child.get<std::size_t>(), place, depth + 1, visits, out); !error.empty()) return error;
    }
    return {};
  }

  json json_;
  std::vector<std::vector<std::byte>> buffers_;
};

}  // namespace

MeshResult read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  const auto document = Document::open(bytes, folder);
  if (!document) return tl::unexpected(MeshError{document.error()});
  auto mesh = document->mesh();
  if (!mesh) return tl::unexpected(MeshError{mesh.error()});
  return *std::move(mesh);
}

}  // namespace farfeel::codecs
