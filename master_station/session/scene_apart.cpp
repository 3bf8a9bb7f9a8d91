#include "master_station/session/scene_apart.h"

#include <string_view>
#include <utility>

#include "codecs/scene/mesh_messages.h"

namespace farfeel::master_station {

codecs::DecodeMeshes decode_meshes_apart(std::string program, const transport::ApartLimits& limits) {
  return [program = std::move(program), limits](std::span<const codecs::CodedMesh> coded) -> codecs::DecodedMeshes {
    transport::ApartLimits with_answer = limits;
    with_answer.answer_bytes = codecs::most_decoded_bytes(coded);
    const auto answer = transport::ask_apart({program, kDecodeApart}, codecs::write_coded(coded), with_answer);
    if (!answer) return tl::unexpected(answer.error());
    return codecs::read_decoded(*answer, coded);
  };
}

bool is_asked_to_decode(std::span<char* const> arguments) {
  return arguments.size() > 1 && arguments[1] == std::string_view(kDecodeApart);
}

int answer_with_meshes(std::span<char* const> arguments) {
  return transport::answer_apart(
      arguments, [](std::span<const std::byte> question) -> tl::expected<std::vector<std::byte>, std::string> {
        const auto coded = codecs::read_coded(question);
        if (!coded) return tl::unexpected(std::string("its meshes arrived here otherwise than they were sent"));
        const auto meshes = codecs::decode_meshes(*coded);
        if (!meshes) return tl::unexpected(meshes.error());
        return codecs::write_decoded(*meshes);
      });
}

}  // namespace farfeel::master_station
