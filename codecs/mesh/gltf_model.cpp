// The one source that holds tinygltf's code.
#include <nlohmann/json.hpp>

#define TINYGLTF_NO_INCLUDE_JSON
#define TINYGLTF_IMPLEMENTATION
#include "codecs/mesh/gltf_model.h"
#undef TINYGLTF_IMPLEMENTATION

#include <fstream>

#include "codecs/mesh/glb.h"

namespace farfeel::codecs {
namespace {

/// Is it a file in that folder itself, whatever an encoded name has turned out to say?
bool is_beside(const std::string& path, const void* folder) {
  const std::filesystem::path file(path);
  const auto& wanted = *static_cast<const std::filesystem::path*>(folder);
  std::error_code error;
  return file.filename() != ".." && file.parent_path() == wanted && std::filesystem::is_regular_file(file, error);
}

tinygltf::FsCallbacks files_in(const std::filesystem::path& folder) {
  tinygltf::FsCallbacks files{};
  files.FileExists = [](const std::string& path, void* user) { return is_beside(path, user); };
  files.ExpandFilePath = [](const std::string& path, void*) { return path; };
  files.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user) {
    std::error_code ignored;
    const std::uintmax_t size = is_beside(path, user) ? std::filesystem::file_size(path, ignored) : 0;
    constexpr std::uintmax_t kMostBytes = 1ULL << 31;
    if (size == 0 || size > kMostBytes) {
      *error += "is not a readable file beside it";
      return false;
    }
    out->resize(size);
    std::ifstream in(path, std::ios::binary);
    return static_cast<bool>(in.read(reinterpret_cast<char*>(out->data()), static_cast<std::streamsize>(size)));
  };
  files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  files.user_data = const_cast<std::filesystem::path*>(&folder);  // the callbacks only read it
  return files;
}

}  // namespace

tl::expected<tinygltf::Model, std::string> loaded_gltf(const CheckedGltf& checked,
                                                       const std::filesystem::path& folder) {
  const std::filesystem::path files_folder = folder.empty() ? "/nowhere" : folder.lexically_normal();
  tinygltf::TinyGLTF loader;
  loader.SetFsCallbacks(files_in(files_folder));
  tinygltf::Model model;
  std::string error, warning;
  bool is_loaded = false;
  constexpr unsigned kNothingRequired = tinygltf::NO_REQUIRE;
  try {
    if (checked.is_binary) {
      // tinygltf refuses an empty binary chunk, so without bytes there is none.
      const auto glb = joined_glb(checked.document, checked.binary);
      const auto size = static_cast<unsigned>(glb.size() - (checked.binary.empty() ? 8 : 0));
      auto bytes = glb;
      if (checked.binary.empty()) std::memcpy(&bytes[8], &size, sizeof size);
      is_loaded =
          loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                      size, files_folder.string(), kNothingRequired);
    } else {
      const std::string text = checked.document.dump();
      is_loaded = loader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()),
                                             files_folder.string(), kNothingRequired);
    }
  } catch (const std::exception& thrown) {
    error += thrown.what();
  }
  if (!is_loaded || !error.empty()) {
    while (!error.empty() && error.back() == '\n') error.pop_back();
    return tl::unexpected("tinygltf cannot load it: " + error.substr(0, 200));
  }
  return model;
}

}  // namespace farfeel::codecs
