// Whatever is not read is named, with what to do.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "codecs/mesh/mesh_file.h"
#include "tests/support/private_folder.h"

namespace farfeel::codecs {
namespace {

struct Refused {
  std::string name, contents;
  std::string what, then;  ///< words that are told
};

const std::string kPoints =
    R"("accessors":[{"componentType":5126,"count":1,"type":"VEC3","bufferView":0}],)"
    R"("bufferViews":[{"buffer":0,"byteLength":12}],)"
    R"("buffers":[{"byteLength":12,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAA"}])";

const std::vector<Refused> kRefused{
    {"part.step", "ISO-10303-21;", "does not end in", "export it as one of these"},
    {"part.fbx", "Kaydara FBX Binary", "does not end in", "export it as one of these"},
    {"part.3mf", "PK\x03\x04", "does not end in", "export it as one of these"},
    {"part", "solid x", "does not end in", "export it as one of these"},
    {"part.stl", "ISO-10303-21;\nHEADER;", "a STEP file", "export the part as STL"},
    {"part.obj", "Kaydara FBX Binary  ", "an FBX file", "export it as glTF"},
    {"part.ply", "PK\x03\x04 and so on", "compressed archive", "unpack it"},
    {"part.obj", "\x1f\x8b and so on", "compressed archive", "unpack it"},
    {"part.stl", "BZh9 and so on", "compressed archive", "unpack it"},
    {"part.glb", "\x28\xb5\x2f\xfd and so on", "compressed archive", "unpack it"},
    {"part.obj", "version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git LFS", "git lfs pull"},
    {"part.stl", "<!DOCTYPE html><html></html>", "a web page", "download the file itself"},
    {"part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n", "lines, curves", "make a mesh of it"},
    {"part.obj", "v 0 0 0\nv 1 0 0\ncstype bspline\ncurv 0 1 1 2\nsurf 0 1 0 1 1 2\n", "free-form surfaces",
     "make a mesh"},
    {"part.obj", "v 0 0 0\nv 1 0 0\n", "a cloud of 2 points", "make a surface of it"},
    {"part.obj", "# nothing\n", "no triangles", "with its faces"},
    {"part.ply",
     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 "
     "0\n",
     "a cloud of 1 points", "make a surface of it"},
    {"part.off", "OFF BINARY\n", "OFF file that is binary", "save it as plain text"},
    {"part.gltf", R"({"asset":{"version":"1.0"},"meshes":{}})", "glTF 1.0", "export it anew"},
    {"part.gltf", R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_something"]})", "KHR_something",
     "export without it"},
    {"part.gltf", R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_meshopt_compression"]})",
     "KHR_meshopt_compression", "export without it"},
    {"part.gltf", R"({"buffers":[{"byteLength":4,"uri":"../other.bin"}]})", "not a file beside it", "into the folder"},
    {"part.gltf", R"({"buffers":[{"byteLength":4,"uri":"https://example.org/a.bin"}]})", "somewhere else",
     "into the folder"},
    {"part.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"a.bin"}]})", "no file a.bin",
     "put it"},
    {"part.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"link.bin"}]})",
     "a link that leads out", "put the file itself there"},
    {"part.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"short.bin"}]})",
     "has 3 bytes and the document says 4", "copy it anew"},
    {"part.gltf", R"({"meshes":[{"primitives":[{"mode":0,"attributes":{"POSITION":0}}]}],)" + kPoints + "}",
     "no triangles", "with its faces"},
};

TEST(RefusalTest, NamesWhatItIsAndWhatToDo) {
  const test_support::PrivateFolder folder, elsewhere;
  std::ofstream(elsewhere / "there.bin") << "four";
  std::filesystem::create_symlink(elsewhere / "there.bin", folder / "link.bin");
  std::ofstream(folder / "short.bin") << "abc";
  for (const Refused& refused : kRefused) {
    const std::filesystem::path path = folder / refused.name;
    std::ofstream(path, std::ios::binary) << refused.contents;
    const MeshResult mesh = read_mesh_file(path);
    ASSERT_FALSE(mesh) << refused.name << ": " << refused.contents;
    for (const std::string& words : {path.string(), refused.what, refused.then})
      EXPECT_NE(mesh.error().message.find(words), std::string::npos) << mesh.error().message << "\nlacks " << words;
  }
}

}  // namespace
}  // namespace farfeel::codecs
