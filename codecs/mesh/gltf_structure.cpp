#include "codecs/mesh/gltf_structure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "codecs/mesh/glb.h"
#include "codecs/mesh/gltf_uri.h"
#include "codecs/mesh/mesh_file.h"

namespace farfeel::codecs {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMost = 1U << 28;  // of anything that is counted; tinygltf reads indices as int
constexpr int kFloat = 5126, kSignedByte = 5120, kByte = 5121, kSignedShort = 5122, kShort = 5123, kInt = 5125;

/// Thrown inside this file only; checked_gltf turns it into an error.
struct Fault {
  std::string why;
};
template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
  throw Fault{fmt::format(format, std::forward<Args>(args)...)};
}

/// in[key] as an integer in [0, most].
std::uint64_t integer(const json& in, const char* key, std::uint64_t most) {
  const auto value = bounded_integer(in, key, most);
  if (!value) throw Fault{value.error()};
  return *value;
}

/// in[key] as an index of a list with `count` entries.
std::uint64_t index(const json& in, const char* key, std::size_t count) {
  if (count == 0) fail("\"{}\" names something in an empty list", key);
  return integer(in, key, count - 1);
}

/// in[key] if it is a list of objects, and an empty list if it is not there.
const json& objects(const json& in, const char* key) {
  static const json kNone = json::array();
  const auto found = in.find(key);
  if (found == in.end()) return kNone;
  if (!found->is_array() || found->size() > kMost) fail("\"{}\" is no list", key);
  for (const json& each : *found) {
    if (!each.is_object()) fail("\"{}\" has something in it that is no object", key);
  }
  return *found;
}

/// Copies in[key], a list of indices, if it is there.
void copy_indices(const json& in, const char* key, std::size_t count, json& out) {
  const auto found = in.find(key);
  if (found == in.end()) return;
  if (!found->is_array()) fail("\"{}\" is no list", key);
  for (const json& each : *found) {
    if (!each.is_number_unsigned() || each.get<std::uint64_t>() >= count) fail("\"{}\" names something not there", key);
  }
  out[key] = *found;
}

constexpr std::size_t kAnyLength = 0;
constexpr int kMostSkinSets = 4;  // of four joints each

/// Copies in[key], `length` finite numbers, if it is there.
void copy_numbers(const json& in, const char* key, std::size_t length, json& out) {
  const auto found = in.find(key);
  if (found == in.end()) return;
  if (!found->is_array() || (length != kAnyLength && found->size() != length))
    fail("a node's {} has the wrong length", key);
  for (const json& each : *found) {
    if (!each.is_number() || !std::isfinite(each.get<double>())) fail("a node's {} has something but numbers", key);
  }
  out[key] = *found;
}

std::uint64_t bytes_of(std::uint64_t component) {
  return component == kByte || component == kSignedByte ? 1 : component == kShort || component == kSignedShort ? 2 : 4;
}
std::uint64_t components_of(const std::string& type) {
  return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "MAT3" ? 9 : type == "MAT4" ? 16 : 4;
}

/// What a document may require without changing its shape, or in ways that are followed.
void check_required(const json& in) {
  const auto required = in.find("extensionsRequired");
  if (required == in.end() || !required->is_array()) return;
  for (const json& each : *required) {
    const std::string name = each.is_string() ? each.get<std::string>() : std::string("?");
    const bool is_followed = name == kDracoExtension || name == kMeshoptExtension || name == "KHR_mesh_quantization";
    const bool is_looks = name.find("_texture_") != std::string::npos ||
                          name.find("_materials_") != std::string::npos || name.find("_lights_") != std::string::npos;
    if (!is_followed && !is_looks)
      fail("it requires the extension {}, which is not understood; export without it", name);
  }
}

class Checker {
 public:
  Checker(const json& in, bool has_binary, std::size_t binary_bytes, bool has_folder)
      : in_(in), has_binary_(has_binary), binary_bytes_(binary_bytes), has_folder_(has_folder) {}

  [[nodiscard]] const auto& files() const { return files_; }
  [[nodiscard]] const auto& packed() const { return packed_; }

  json document() {
    if (const auto asset = in_.find("asset"); asset != in_.end() && asset->is_object()) {
      const json version = asset->value("version", json("2.0"));
      if (version.is_string() && !version.get_ref<const std::string&>().starts_with("2"))
        fail("it is glTF {}, and 2.0 is read; open it in Blender and export it anew",
             version.get_ref<const std::string&>().substr(0, 8));
    }
    check_required(in_);
    json out{{"asset", {{"version", "2.0"}}}};
    for (const char* key : {"buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes"}) {
      out[key] = json::array();  // tinygltf wants to see every list
    }
    for (const json& buffer : objects(in_, "buffers")) out["buffers"].push_back(checked_buffer(buffer));
    for (const json& view : objects(in_, "bufferViews")) out["bufferViews"].push_back(checked_view(view));
    if (packed_bytes_ > std::accumulate(buffer_bytes_.begin(), buffer_bytes_.end(), std::uint64_t{0}))
      fail("views under meshopt compression share their bytes: together they claim more than there are");
    for (const json& accessor : objects(in_, "accessors")) out["accessors"].push_back(checked_accessor(accessor));
    for (const json& mesh : objects(in_, "meshes")) {
      json primitives = json::array();
      for (const json& primitive : objects(mesh, "primitives")) {
        constexpr std::uint64_t kTriangles = 4, kMostMode = 6;
        const std::uint64_t mode = primitive.contains("mode") ? integer(primitive, "mode", kMostMode) : kTriangles;
        if (mode >= kTriangles) primitives.push_back(checked_primitive(primitive, mode));  // points and lines: no feel
      }
      json kept{{"primitives", primitives}};
      copy_numbers(mesh, "weights", kAnyLength, kept);
      out["meshes"].push_back(kept);
    }
    json skins = json::array();  // those that a mesh hangs on; the others may be anything
    for (const json& node : objects(in_, "nodes")) out["nodes"].push_back(checked_node(node, skins));
    if (!skins.empty()) out["skins"] = skins;
    const json& scenes = objects(in_, "scenes");
    for (const json& scene : scenes) {
      json kept = json::object();
      copy_indices(scene, "nodes", count("nodes"), kept);
      out["scenes"].push_back(kept);
    }
    if (in_.contains("scene")) out["scene"] = index(in_, "scene", scenes.size());
    return out;
  }

 private:
  std::size_t count(const char* key) const { return objects(in_, key).size(); }

  json checked_buffer(const json& buffer) {
    const bool is_first = buffer_bytes_.empty();
    const auto uri = buffer.find("uri");
    json kept = json::object();
    if (const json* extension = meshopt_of(buffer);
        extension != nullptr && extension->value("fallback", json()) == true) {
      buffer_bytes_.push_back(0);  // for readers that do not unpack: nothing of it is read
      return {{"byteLength", 1}, {"uri", "data:application/octet-stream;base64,AA=="}};
    }
    if (uri == buffer.end()) {
      if (!is_first || !has_binary_) fail("buffer {} is nowhere", buffer_bytes_.size());
      kept["byteLength"] = integer(buffer, "byteLength", binary_bytes_);
    } else {
      if (!uri->is_string()) fail("a buffer's uri is no text");
      const std::string& name = uri->get_ref<const std::string&>();
      kept["byteLength"] = integer(buffer, "byteLength", 1ULL << 31);
      kept["uri"] = name;
      if (!name.starts_with("data:")) {
        const auto file = file_within(name);
        if (!file) throw Fault{file.error()};
        if (!has_folder_) fail("its buffer '{}' is a file, and there is no folder to find it in", name.substr(0, 60));
        kept["uri"] = fmt::format("file {}", files_.size());
        files_.push_back(*file);
      }
    }
    buffer_bytes_.push_back(kept["byteLength"].get<std::uint64_t>());
    if (buffer_bytes_.back() == 0) fail("a buffer is empty");
    return kept;
  }

  static const json* meshopt_of(const json& in) {
    const auto extensions = in.find("extensions");
    if (extensions == in.end() || !extensions->is_object() || !extensions->contains(kMeshoptExtension)) return nullptr;
    const json& extension = (*extensions)[kMeshoptExtension];
    return extension.is_object() ? &extension : nullptr;
  }

  json checked_view(const json& view) {
    json kept = json::object();
    std::uint64_t length = 0, stride = 0;
    if (const json* extension = meshopt_of(view); extension != nullptr) {
      const auto packed = meshopt_view(*extension, buffer_bytes_);
      if (!packed) throw Fault{packed.error()};
      packed_bytes_ += packed->bytes;
      length = packed->unpacked_bytes();
      if (length != integer(view, "byteLength", kMost * 16)) fail("a packed view has another length than its elements");
      packed_.emplace_back(views_.size(), *packed);
      kept = {{"buffer", packed->buffer}, {"byteOffset", packed->first}, {"byteLength", packed->bytes}};
    } else {
      const std::uint64_t buffer = index(view, "buffer", buffer_bytes_.size());
      const std::uint64_t bytes = buffer_bytes_[buffer];
      const std::uint64_t offset = view.contains("byteOffset") ? integer(view, "byteOffset", bytes) : 0;
      length = integer(view, "byteLength", bytes);
      if (length > bytes - offset) fail("bufferView {} ends beyond its buffer", views_.size());
      kept = {{"buffer", buffer}, {"byteOffset", offset}, {"byteLength", length}};
    }
    if (view.contains("byteStride")) {
      constexpr std::uint64_t kMostStride = 252;
      stride = integer(view, "byteStride", kMostStride);
      if (stride < 4 || stride % 4 != 0) fail("a byteStride is {}, not a multiple of 4 from 4 to 252", stride);
      kept["byteStride"] = stride;
    }
    views_.push_back({length, stride});
    return kept;
  }

  json checked_accessor(const json& accessor) const {
    constexpr std::array kTypes{"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
    constexpr std::array kComponents{5120, kByte, 5122, kShort, kInt, kFloat};
    const std::uint64_t component = integer(accessor, "componentType", kFloat);
    if (std::find(kComponents.begin(), kComponents.end(), static_cast<int>(component)) == kComponents.end())
      fail("an accessor's components are of type {}, which glTF does not have", component);
    const auto type = accessor.find("type");
    if (type == accessor.end() || !type->is_string() ||
        std::find(kTypes.begin(), kTypes.end(), type->get_ref<const std::string&>()) == kTypes.end())
      fail("an accessor's type is none that glTF has");
    json kept{{"componentType", component}, {"type", *type}, {"count", integer(accessor, "count", kMost)}};
    if (accessor.contains("byteOffset")) kept["byteOffset"] = integer(accessor, "byteOffset", kMost);
    if (accessor.contains("bufferView")) kept["bufferView"] = index(accessor, "bufferView", views_.size());
    if (accessor.contains("normalized")) kept["normalized"] = accessor["normalized"] == true;
    if (accessor.contains("sparse")) {
      const json& sparse = accessor["sparse"];
      const std::uint64_t elements = kept["count"].get<std::uint64_t>(), some = integer(sparse, "count", elements);
      for (const char* key : {"indices", "values"}) {
        if (!sparse.contains(key)) fail("a sparse accessor has no {}", key);
        json& to = kept["sparse"][key];
        to["bufferView"] = index(sparse[key], "bufferView", views_.size());
        to["byteOffset"] = sparse[key].contains("byteOffset") ? integer(sparse[key], "byteOffset", kMost) : 0;
      }
      const std::uint64_t of_index = integer(sparse["indices"], "componentType", kInt);
      if (of_index != kByte && of_index != kShort && of_index != kInt)
        fail("a sparse accessor's indices are of type {}", of_index);
      kept["sparse"]["count"] = some;
      kept["sparse"]["indices"]["componentType"] = of_index;
      const std::uint64_t of_value = bytes_of(component) * components_of(type->get<std::string>());
      for (const auto& [key, bytes] : {std::pair("indices", bytes_of(of_index)), std::pair("values", of_value)}) {
        const json& part = kept["sparse"][key];
        if (part["byteOffset"].get<std::uint64_t>() + some * bytes >
            views_[part["bufferView"].get<std::size_t>()].bytes)
          fail("a sparse accessor's {} end beyond their bufferView", key);
      }
    }
    return kept;
  }

  /// The accessor in[key]: of that type, with one of these components, and within its view.
  std::uint64_t usable_accessor(const json& in, const char* key, const char* type,
                                std::initializer_list<int> components) const {
    const json& accessors = objects(in_, "accessors");
    const std::uint64_t at = index(in, key, accessors.size());
    const json& accessor = accessors[at];
    const int component = accessor["componentType"].get<int>();
    if (accessor["type"] != type) fail("accessor {} is not of type {}", at, type);
    if (std::find(components.begin(), components.end(), component) == components.end())
      fail("accessor {} has components of type {}, which does not do here", at, component);
    const std::uint64_t elements = accessor["count"].get<std::uint64_t>();
    if (!accessor.contains("bufferView")) {  // zeros but where it is sparse
      constexpr std::uint64_t kMostWithoutBytes = 1U << 20;
      if (!accessor.contains("sparse") || elements > kMostWithoutBytes) fail("accessor {} has no bytes", at);
      return at;
    }
    const View view = views_[accessor["bufferView"].get<std::size_t>()];
    const std::uint64_t element = bytes_of(component) * components_of(type);
    const std::uint64_t stride = view.stride == 0 ? element : view.stride;
    const std::uint64_t offset = accessor.contains("byteOffset") ? accessor["byteOffset"].get<std::uint64_t>() : 0;
    if (elements > 0 && (stride < element || offset + (elements - 1) * stride + element > view.bytes))
      fail("accessor {} ends beyond its bufferView", at);
    return at;
  }

  json checked_primitive(const json& in, std::uint64_t mode) const {
    json kept{{"mode", mode}, {"attributes", json::object()}};
    const auto extensions = in.find("extensions");
    if (extensions != in.end() && extensions->is_object() && extensions->contains(kDracoExtension)) {
      const json& draco = (*extensions)[kDracoExtension];
      const std::uint64_t view = draco.is_object() ? index(draco, "bufferView", views_.size()) : kMost;
      if (!draco.is_object() || !draco.contains("attributes")) fail("a Draco primitive has no POSITION");
      const std::uint64_t id = integer(draco["attributes"], "POSITION", 1U << 16);
      kept["extensions"][kDracoExtension] = {{"bufferView", view}, {"attributes", {{"POSITION", id}}}};
      return kept;
    }
    if (!in.contains("attributes")) fail("a primitive has no attributes");
    const json& attributes = in["attributes"];
    kept["attributes"]["POSITION"] = position_accessor(attributes);
    if (attributes.contains("COLOR_0")) {
      const json& accessor = objects(in_, "accessors")[index(attributes, "COLOR_0", count("accessors"))];
      const char* type = accessor.value("type", json()) == "VEC3" ? "VEC3" : "VEC4";
      kept["attributes"]["COLOR_0"] = usable_accessor(attributes, "COLOR_0", type, {kFloat, kByte, kShort});
    }
    for (int set = 0; set < kMostSkinSets; ++set) {
      const std::string joints = fmt::format("JOINTS_{}", set), weights = fmt::format("WEIGHTS_{}", set);
      if (!attributes.contains(joints) || !attributes.contains(weights)) break;
      kept["attributes"][joints] = usable_accessor(attributes, joints.c_str(), "VEC4", {kByte, kShort});
      kept["attributes"][weights] = usable_accessor(attributes, weights.c_str(), "VEC4", {kFloat, kByte, kShort});
    }
    for (const json& target : objects(in, "targets")) {
      json moved = json::object();
      if (target.contains("POSITION")) moved["POSITION"] = position_accessor(target);
      kept["targets"].push_back(moved);
    }
    if (in.contains("indices")) kept["indices"] = usable_accessor(in, "indices", "SCALAR", {kByte, kShort, kInt});
    return kept;
  }

  std::uint64_t position_accessor(const json& in) const {
    return usable_accessor(in, "POSITION", "VEC3", {kFloat, kSignedByte, kByte, kSignedShort, kShort});
  }

  json checked_skin(const json& skin) const {
    json kept = json::object();
    copy_indices(skin, "joints", count("nodes"), kept);
    if (!kept.contains("joints") || kept["joints"].empty()) fail("a skin has no joints");
    kept["inverseBindMatrices"] = -1;  // tinygltf wants to see it; its own word for none
    if (skin.contains("inverseBindMatrices")) {
      const std::uint64_t at = usable_accessor(skin, "inverseBindMatrices", "MAT4", {kFloat});
      if (objects(in_, "accessors")[at]["count"].get<std::uint64_t>() < kept["joints"].size())
        fail("a skin has more joints than matrices");
      kept["inverseBindMatrices"] = at;
    }
    return kept;
  }

  json checked_node(const json& node, json& skins) const {
    json kept = json::object();
    if (const auto name = node.find("name"); name != node.end() && name->is_string()) kept["name"] = *name;
    copy_numbers(node, "matrix", 16, kept);
    copy_numbers(node, "translation", 3, kept);
    copy_numbers(node, "rotation", 4, kept);
    copy_numbers(node, "scale", 3, kept);
    if (node.contains("mesh")) kept["mesh"] = index(node, "mesh", count("meshes"));
    copy_indices(node, "children", count("nodes"), kept);
    copy_numbers(node, "weights", kAnyLength, kept);
    if (node.contains("mesh") && node.contains("skin")) {
      skins.push_back(checked_skin(objects(in_, "skins")[index(node, "skin", count("skins"))]));
      kept["skin"] = skins.size() - 1;
    }
    if (const auto more = node.find("extensions"); more != node.end() && more->contains("EXT_mesh_gpu_instancing"))
      fail("a node stands for many (EXT_mesh_gpu_instancing), which is not understood; export without it");
    return kept;
  }

  struct View {
    std::uint64_t bytes, stride;  // stride 0: packed
  };
  const json& in_;
  bool has_binary_;
  std::size_t binary_bytes_;
  bool has_folder_;
  std::vector<std::uint64_t> buffer_bytes_;
  std::vector<View> views_;
  std::vector<std::filesystem::path> files_;
  std::vector<std::pair<std::size_t, MeshoptView>> packed_;
  std::uint64_t packed_bytes_ = 0;
};

}  // namespace

tl::expected<CheckedGltf, std::string> checked_gltf(std::span<const std::byte> bytes,
                                                    const std::filesystem::path& folder) {
  CheckedGltf out;
  json given;
  if (bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
    auto glb = split_glb(bytes);
    if (!glb) return tl::unexpected("it " + glb.error());
    given = std::move(glb->json);
    out.binary = glb->binary;
    out.is_binary = true;
  } else {
    const auto text = plain_text(bytes);
    if (!text) return tl::unexpected(text.error().message);
    given = bounded_json(*text);
    if (!given.is_object()) return tl::unexpected(std::string("it is neither a .glb nor a JSON object"));
  }
  try {
    Checker checker(given, out.is_binary, out.binary.size(), !folder.empty());
    out.document = checker.document();
    out.files = checker.files(), out.packed = checker.packed();
  } catch (const Fault& fault) {
    return tl::unexpected(fault.why);
  }
  return out;
}

}  // namespace farfeel::codecs
