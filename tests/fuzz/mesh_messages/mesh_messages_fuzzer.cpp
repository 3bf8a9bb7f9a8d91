// What a process that decodes is asked, and what it answers, from anybody. The first byte says which.

#include <cstdlib>

#include "codecs/scene/mesh_messages.h"

using namespace farfeel;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

void check_question(std::span<const std::byte> bytes) {
  const auto coded = codecs::read_coded(bytes);
  if (!coded) return;
  demand(!codecs::fault_of(*coded));
  const auto again = codecs::write_coded(*coded);
  demand(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()));
}

void check_answer(std::span<const std::byte> bytes) {
  const std::vector<codecs::CodedMesh> coded(2, {1000, {}});
  const auto meshes = codecs::read_decoded(bytes, coded);
  if (!meshes) return;
  demand(meshes->size() == 2 && bytes.size() <= codecs::most_decoded_bytes(coded));
  for (const codecs::ColouredMesh& mesh : *meshes) {
    demand(!codecs::fault_of(mesh) && mesh.triangles.size() <= 1000);
    demand(mesh.colours.empty() || mesh.colours.size() == mesh.positions_O.size());
  }
  const auto again = codecs::write_decoded(*meshes);
  demand(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const auto all = std::as_bytes(std::span(bytes, size));
  (bytes[0] % 2 == 0 ? check_question : check_answer)(all.subspan(1));
  return 0;
}
