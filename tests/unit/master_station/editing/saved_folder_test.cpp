#include "master_station/editing/saved_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/private_folder.h"

namespace farfeel::master_station {
namespace {

namespace fs = std::filesystem;

/// A node's object: that scene.toml, and one asset.
std::vector<std::byte> object_of(const std::string& toml, const std::string& asset = "block.glb") {
  const std::string bytes = "glTF and so on";
  return codecs::write_saved_scene(std::vector<codecs::SavedFile>{
      {codecs::kSavedSceneFile, std::as_bytes(std::span(toml))}, {asset, std::as_bytes(std::span(bytes))}});
}

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

const std::string kScene = "[tool]\nasset = \"block.glb\"\n[[object]]\nname = \"a\"\nasset = \"block.glb\"\n";

TEST(SavedFolder, IsThereWholeOrNotAtAll) {
  const test_support::PrivateFolder folder;
  const fs::path out = folder / "out/";
  EXPECT_EQ(in_the_way_of(out), "");
  const auto saved = write_saved_folder(object_of(kScene), out);
  ASSERT_TRUE(saved) << saved.error();
  EXPECT_EQ(saved->objects, 1u);
  EXPECT_EQ(content(out / "scene.toml"), kScene);
  EXPECT_EQ(content(out / "block.glb"), "glTF and so on");
  const auto again = write_saved_folder(object_of(kScene + "# newer\n"), out);
  ASSERT_FALSE(again);
  EXPECT_NE(again.error().find("there is something in"), std::string::npos) << again.error();
  EXPECT_EQ(content(out / "scene.toml"), kScene) << "nothing is written over";
  fs::create_directory(folder / "empty");
  EXPECT_TRUE(write_saved_folder(object_of(kScene), folder / "empty"));
  EXPECT_NE(in_the_way_of(folder / "none/out").find("make it first"), std::string::npos);
  std::ofstream(folder / "file") << "x";
  EXPECT_NE(in_the_way_of(folder / "file").find("is no folder"), std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 3) << "a .part is left";
}

TEST(SavedFolder, ASceneThatNamesOtherFilesIsNotWritten) {
  const test_support::PrivateFolder folder;
  for (const std::string& scene :
       {std::string("[tool]\nasset = \"block.glb\"\n[[object]]\nasset = \"/etc/passwd\"\n"),
        std::string("[tool]\nasset = \"../block.glb\"\n[[object]]\nasset = \"block.glb\"\n"),
        std::string("[tool]\nasset = \"block.glb\"\n[[object]]\nasset = \"--object\"\n"),
        std::string("[tool]\nmodel = \"probe\"\nasset = \"block.glb\"\n[[object]]\nasset = \"block.glb\"\n"),
        std::string("[tool]\nasset = \"block.glb\"\n"), std::string("[[object]]\nasset = \"block.glb\"\n"),
        std::string("tool = 1\nobject = 2\n"), std::string("[= nan"), std::string("\xff\xfe")}) {
    const auto saved = write_saved_folder(object_of(scene), folder / "out");
    EXPECT_FALSE(saved) << scene;
    EXPECT_FALSE(fs::exists(folder / "out"));
  }
  EXPECT_FALSE(write_saved_folder(object_of(kScene, "../block.glb"), folder / "out"));
  EXPECT_FALSE(write_saved_folder({}, folder / "out"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace farfeel::master_station
