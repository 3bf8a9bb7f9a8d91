#include "codecs/mesh/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>
#include <vector>

namespace farfeel::codecs {
namespace {

bool begins_with(std::span<const std::byte> bytes, std::string_view mark) {
  return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).starts_with(mark);
}

bool is_archive(std::span<const std::byte> bytes) {
  return begins_with(bytes, "PK\x03\x04") || begins_with(bytes, "\x1f\x8b") || begins_with(bytes, "7z\xbc\xaf") ||
         begins_with(bytes, "Rar!");
}

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
  if (mesh.positions_O.empty()) return tl::unexpected(MeshError{"it has no triangles"});
  return tl::unexpected(MeshError{
      fmt::format("it has no triangles: it is a cloud of {} points without faces; make a surface of it first (in "
                  "MeshLab: Screened Poisson Surface Reconstruction)",
                  mesh.positions_O.size())});
}

MeshResult read_mesh_file(const std::filesystem::path& path) {
  const auto failure = [&](std::string_view why) {
    return tl::unexpected(MeshError{fmt::format("cannot read the mesh {}: {}", path.string(), why)});
  };
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (suffix != ".obj" && suffix != ".off" && suffix != ".ply" && suffix != ".stl" && suffix != ".glb" &&
      suffix != ".gltf") {
    return failure("its name does not end in .obj, .off, .ply, .stl, .glb or .gltf; export it as one of these");
  }
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return failure(error.message());
  constexpr std::uintmax_t kMostBytes = 1ULL << 32;
  if (size > kMostBytes) return failure("it is larger than 4 GiB");
  std::vector<std::byte> bytes(size);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!in) return failure("the file cannot be read");
  if (is_archive(bytes)) return failure("it is a compressed archive; unpack it first");
  MeshResult mesh = suffix == ".obj"   ? read_obj(bytes)
                    : suffix == ".off" ? read_off(bytes)
                    : suffix == ".ply" ? read_ply(bytes)
                    : suffix == ".stl" ? read_stl(bytes)
                                       : read_gltf(bytes, path.has_parent_path() ? path.parent_path() : ".");
  if (!mesh) return failure(mesh.error().message);
  return mesh;
}

}  // namespace farfeel::codecs
