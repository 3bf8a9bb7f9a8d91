// The one source that holds tinygltf's code.
#include <nlohmann/json.hpp>

#define TINYGLTF_NO_INCLUDE_JSON
#define TINYGLTF_IMPLEMENTATION
#include "codecs/mesh/gltf_model.h"
#undef TINYGLTF_IMPLEMENTATION

#include <fmt/format.h>

#include <fstream>

#include "codecs/mesh/glb.h"
#include "codecs/mesh/gltf_uri.h"

namespace farfeel::codecs {
namespace {

/// The files that a checked document names, for tinygltf's questions.
struct NamedFiles {
  const CheckedGltf& checked;
  const std::filesystem::path& folder;

  /// tinygltf asks for "FOLDER/file N".
  [[nodiscard]] const std::filesystem::path* named(const std::string& path) const {
    for (std::size_t i = 0; i < checked.files.size(); ++i) {
      if (path == (folder / fmt::format("file {}", i)).string()) return &checked.files[i];
    }
    return nullptr;
  }
  /// How long the document says that it is.
  [[nodiscard]] std::uintmax_t bytes(std::size_t file) const {
    const auto name = fmt::format("file {}", file);
    for (const auto& buffer : checked.document["buffers"]) {
      if (buffer.value("uri", "") == name) return buffer["byteLength"].get<std::uintmax_t>();
    }
    return 0;
  }

  /// The first of them that cannot be read as the document says, and what to do; empty: there is none.
  [[nodiscard]] std::string lacking() const {
    for (std::size_t i = 0; i < checked.files.size(); ++i) {
      const std::filesystem::path &file = checked.files[i], path = folder / file;
      std::error_code ignored;
      if (!std::filesystem::is_regular_file(path, ignored))
        return fmt::format("there is no file {} in its folder, where its buffer is; put it there", file.string());
      if (!is_file_within(folder, file))
        return fmt::format("{} is a link that leads out of its folder; put the file itself there", file.string());
      if (const std::uintmax_t present = std::filesystem::file_size(path, ignored); present < bytes(i))
        return fmt::format("{} has {} bytes and the document says {}: it is cut short, or another's; copy it anew",
                           file.string(), present, bytes(i));
    }
    return {};
  }
};

tinygltf::FsCallbacks callbacks_of(NamedFiles& named) {
  tinygltf::FsCallbacks files{};
  files.FileExists = [](const std::string& path, void* user) {
    return static_cast<const NamedFiles*>(user)->named(path) != nullptr;
  };
  files.ExpandFilePath = [](const std::string& path, void*) { return path; };
  files.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user) {
    const auto& in = *static_cast<const NamedFiles*>(user);
    const std::filesystem::path* file = in.named(path);
    if (file == nullptr) {
      *error += "it names no file " + path;
      return false;
    }
    out->resize(in.bytes(static_cast<std::size_t>(file - in.checked.files.data())));
    std::ifstream stream(in.folder / *file, std::ios::binary);
    return static_cast<bool>(
        stream.read(reinterpret_cast<char*>(out->data()), static_cast<std::streamsize>(out->size())));
  };
  files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  files.user_data = &named;
  return files;
}

/// Packed views get buffers of their own; what is wrong, or nothing.
std::string unpack(const CheckedGltf& checked, tinygltf::Model& model) {
  for (const auto& [index, packed] : checked.packed) {
    tinygltf::BufferView& view = model.bufferViews.at(index);
    const std::vector<unsigned char>& bytes = model.buffers.at(packed.buffer).data;
    auto whole = unpacked(packed, std::span(bytes).subspan(packed.first, packed.bytes));
    if (!whole) return whole.error();
    view.buffer = static_cast<int>(model.buffers.size());
    view.byteOffset = 0, view.byteLength = whole->size();
    model.buffers.emplace_back().data = *std::move(whole);
  }
  return {};
}

}  // namespace

tl::expected<tinygltf::Model, std::string> loaded_gltf(const CheckedGltf& checked,
                                                       const std::filesystem::path& folder) {
  const std::filesystem::path files_folder = folder.empty() ? "/nowhere" : folder.lexically_normal();
  tinygltf::TinyGLTF loader;
  NamedFiles named{checked, files_folder};
  if (std::string lacking = named.lacking(); !lacking.empty()) return tl::unexpected(std::move(lacking));
  loader.SetFsCallbacks(callbacks_of(named));
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
  if (auto wrong = unpack(checked, model); !wrong.empty()) return tl::unexpected(std::move(wrong));
  return model;
}

}  // namespace farfeel::codecs
