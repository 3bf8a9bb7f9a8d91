// Any bytes as a scene that a node saved: what is accepted names files of one folder, and its scene no others.

#include <cstdlib>
#include <cstring>

#include "codecs/scene/saved_scene.h"
#include "master_station/editing/saved_folder.h"

using namespace farfeel;

namespace {

void demand(bool is_so) {
  if (!is_so) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto object = std::as_bytes(std::span(bytes, size));
  const auto files = codecs::read_saved_scene(object);
  if (!files) return 0;
  const std::vector<std::byte> again = codecs::write_saved_scene(*files);
  demand(again.size() == size && std::memcmp(again.data(), object.data(), size) == 0);
  for (const codecs::SavedFile& file : *files)
    demand(file.name.find('/') == std::string::npos && file.name.front() != '.' && !file.bytes.empty());
  demand(master_station::objects_within(*files) <= size);
  return 0;
}
