#include "codecs/mesh/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "codecs/mesh/mesh_parts.h"

namespace farfeel::codecs {
namespace {

bool begins_with(std::span<const std::byte> bytes, std::string_view mark) {
  return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).starts_with(mark);
}

/// Files that are no meshes whatever their name says, by how they begin; and what to do.
constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kOthers{
    {{"PK\x03\x04", "it is a compressed archive; unpack it first"},
     {"\x1f\x8b", "it is a compressed archive; unpack it first"},
     {"7z\xbc\xaf", "it is a compressed archive; unpack it first"},
     {"Rar!", "it is a compressed archive; unpack it first"},
     {"BZh", "it is a compressed archive; unpack it first"},
     {"\xfd\x37zXZ", "it is a compressed archive; unpack it first"},
     {"\x28\xb5\x2f\xfd", "it is a compressed archive; unpack it first"},
     {"version https://git-lfs", "it is a pointer of git LFS, not the file itself; get that with git lfs pull"},
     {"<!DOCTYPE", "it is a web page; download the file itself"},
     {"<html", "it is a web page; download the file itself"},
     {"ISO-10303-21", "it is a STEP file; open it in a CAD program and export the part as STL"},
     {"Kaydara FBX", "it is an FBX file; open it in Blender and export it as glTF"}}};

/// By its mark, or because every other byte of its beginning is zero.
bool is_wide_text(std::span<const std::byte> bytes) {
  if (begins_with(bytes, "\xff\xfe") || begins_with(bytes, "\xfe\xff")) return true;
  const auto is_zero = [&](std::size_t i) { return bytes[i] == std::byte{0}; };
  if (bytes.size() < 4 || is_zero(0) == is_zero(1)) return bytes.size() >= 4 && is_zero(0) && is_zero(2);  // UTF-32
  return is_zero(0) == is_zero(2) && is_zero(1) == is_zero(3);
}

}  // namespace

tl::expected<std::string_view, MeshError> plain_text(std::span<const std::byte> bytes) {
  if (is_wide_text(bytes)) {
    return tl::unexpected(MeshError{"it is text in UTF-16 or UTF-32; save it as UTF-8 (plain text) first"});
  }
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

MeshResult with_faces(MeshInFile mesh) {
  if (!mesh.triangles.empty()) return mesh;
  if (mesh.positions_O.empty())
    return tl::unexpected(MeshError{"it has no triangles; export the part as a mesh, with its faces"});
  return tl::unexpected(MeshError{
      fmt::format("it has no triangles: it is a cloud of {} points without faces; make a surface of it first (in "
                  "MeshLab: Screened Poisson Surface Reconstruction)",
                  mesh.positions_O.size())});
}

namespace {

struct GivenFile {
  std::string suffix;  ///< in small letters
  std::vector<std::byte> bytes;
  std::filesystem::path folder;
};

tl::expected<GivenFile, std::string> file_at(const std::filesystem::path& path) {
  GivenFile file{path.extension().string(), {}, path.has_parent_path() ? path.parent_path() : "."};
  std::transform(file.suffix.begin(), file.suffix.end(), file.suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kSuffixes{".obj", ".off", ".ply", ".stl", ".glb", ".gltf"};
  if (std::find(kSuffixes.begin(), kSuffixes.end(), file.suffix) == kSuffixes.end()) {
    return tl::unexpected(
        std::string("its name does not end in .obj, .off, .ply, .stl, .glb or .gltf; export it as one of these"));
  }
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return tl::unexpected(error.message());
  constexpr std::uintmax_t kMostBytes = 1ULL << 32;
  if (size > kMostBytes) return tl::unexpected(std::string("it is larger than 4 GiB"));
  file.bytes.resize(size);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(file.bytes.data()), static_cast<std::streamsize>(size));
  if (!in) return tl::unexpected(std::string("the file cannot be read"));
  for (const auto& [beginning, words] : kOthers) {
    if (begins_with(file.bytes, beginning)) return tl::unexpected(std::string(words));
  }
  return file;
}

MeshError failure(const std::filesystem::path& path, std::string_view why) {
  return {fmt::format("cannot read the mesh {}: {}", path.string(), why)};
}

}  // namespace

MeshResult read_mesh_file(const std::filesystem::path& path) {
  const auto file = file_at(path);
  if (!file) return tl::unexpected(failure(path, file.error()));
  MeshResult mesh = file->suffix == ".obj"   ? read_obj(file->bytes)
                    : file->suffix == ".off" ? read_off(file->bytes)
                    : file->suffix == ".ply" ? read_ply(file->bytes)
                    : file->suffix == ".stl" ? read_stl(file->bytes)
                                             : read_gltf(file->bytes, file->folder);
  if (!mesh) return tl::unexpected(failure(path, mesh.error().message));
  return mesh;
}

std::string too_many_parts() {
  return fmt::format("it has more than {} parts, and a scene has no more objects; join some, or bake it as one",
                     kMostParts);
}

tl::expected<MeshParts, MeshError> read_mesh_parts(const std::filesystem::path& path) {
  const auto file = file_at(path);
  if (!file) return tl::unexpected(failure(path, file.error()));
  const bool is_gltf = file->suffix == ".glb" || file->suffix == ".gltf";
  if (!is_gltf && file->suffix != ".obj") {
    return tl::unexpected(failure(
        path, fmt::format("a {} file has no parts; bake it as one, or export the assembly as glTF", file->suffix)));
  }
  auto parts = is_gltf ? read_gltf_parts(file->bytes, file->folder) : read_obj_parts(file->bytes);
  if (!parts) return tl::unexpected(failure(path, parts.error().message));
  return parts;
}

}  // namespace farfeel::codecs
