#include "codecs/mesh/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>
#include <vector>

namespace farfeel::codecs {

MeshResult read_mesh_file(const std::filesystem::path& path) {
  const auto failure = [&](std::string_view why) {
    return tl::unexpected(MeshError{fmt::format("cannot read the mesh {}: {}", path.string(), why)});
  };
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (suffix != ".obj" && suffix != ".ply" && suffix != ".stl" && suffix != ".glb" && suffix != ".gltf") {
    return failure("its name does not end in .obj, .ply, .stl, .glb or .gltf");
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
  MeshResult mesh = suffix == ".obj"   ? read_obj(bytes)
                    : suffix == ".ply" ? read_ply(bytes)
                    : suffix == ".stl" ? read_stl(bytes)
                                       : read_gltf(bytes, path.has_parent_path() ? path.parent_path() : ".");
  if (!mesh) return failure(mesh.error().message);
  return mesh;
}

}  // namespace farfeel::codecs
