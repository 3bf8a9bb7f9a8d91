#include "master_station/editing/saved_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <set>
#include <system_error>

#include "codecs/text/toml.h"
#include "codecs/text/whole_file.h"

namespace farfeel::master_station {
namespace {

namespace fs = std::filesystem;

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

fs::path without_slash(const fs::path& folder) {
  return folder.has_filename() ? folder : folder.parent_path();
}

/// Whether a tool or an object of the scene has its shape from one of these files, and from nowhere else.
bool is_within(const toml::node* entry, const std::set<std::string_view>& names) {
  const toml::table* const table = entry == nullptr ? nullptr : entry->as_table();
  if (table == nullptr || table->contains("model")) return false;
  const auto asset = (*table)["asset"].value<std::string_view>();
  return asset && names.contains(*asset);
}

}  // namespace

std::string in_the_way_of(const fs::path& as_typed) {
  const fs::path folder = without_slash(as_typed);
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (!fs::exists(status)) {
    const fs::path parent = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
    if (fs::is_directory(parent, error)) return {};
    return fmt::format("there is no folder {}: make it first", parent.string());
  }
  if (!fs::is_directory(status)) return fmt::format("{} is no folder: name another with -o", folder.string());
  if (!fs::is_empty(folder, error) || error)
    return fmt::format("there is something in {}: name another folder with -o, or empty it", folder.string());
  return {};
}

std::size_t objects_within(const std::vector<codecs::SavedFile>& files) {
  std::set<std::string_view> names;
  for (const codecs::SavedFile& file : files) names.insert(file.name);
  try {
    const toml::table root = toml::parse(text_of(files.front().bytes));
    const toml::array* const objects = root["object"].as_array();
    if (objects == nullptr || !is_within(root.get("tool"), names)) return 0;
    for (const toml::node& object : *objects) {
      if (!is_within(&object, names)) return 0;
    }
    return objects->size();
  } catch (const toml::parse_error&) {
    return 0;
  } catch (const codecs::TableFault&) {
    return 0;
  }
}

tl::expected<SavedFolder, std::string> write_saved_folder(std::span<const std::byte> object, const fs::path& folder) {
  const auto files = codecs::read_saved_scene(object);
  if (!files) return tl::unexpected(std::string("what the slave sent is no saved scene of this version"));
  SavedFolder saved{objects_within(*files), 0};
  for (const codecs::SavedFile& file : *files) saved.bytes += file.bytes.size();
  if (saved.objects == 0)
    return tl::unexpected(
        std::string("the scene that the slave sent names other files than those it sent: nothing is written"));
  if (const std::string why = in_the_way_of(folder); !why.empty()) return tl::unexpected(why);
  const fs::path whole = without_slash(folder);
  const fs::path beside = fmt::format("{}.{}.part", whole.string(), ::getpid());
  const auto given_up = [&](const std::string& why) {
    std::error_code ignored;
    fs::remove_all(beside, ignored);
    return tl::unexpected(why);
  };
  std::error_code error;
  if (!fs::create_directory(beside, error))
    return tl::unexpected(codecs::why_not_written(beside.string(), error ? error.value() : EEXIST));
  for (const codecs::SavedFile& file : *files) {
    if (const auto why = codecs::write_whole_file((beside / file.name).string(), text_of(file.bytes)); !why.empty())
      return given_up(why);
  }
  fs::rename(beside, whole, error);  // in place of an empty one, too
  if (error) return given_up(codecs::why_not_written(whole.string(), error.value()));
  return saved;
}

}  // namespace farfeel::master_station
