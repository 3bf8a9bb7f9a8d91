// farfeel-replay: recorded sessions again, and the first tick and field that come out otherwise.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "codecs/settings/command_line.h"
#include "deploy/replay/session_replay.h"

namespace {

using namespace farfeel;

struct Options {
  std::string file, folder, record;
  bool keeps_values = false;
  double within = 0;
};

constexpr int kFails = 1, kNotHere = 3;  // exit codes; 2 is the command line's

int fail(const std::string& what, const std::string& why) {
  fmt::print("{}: {}\n", what, why);
  return kFails;
}

/// Writes what came out now, and the asset beside it.
tl::expected<void, std::string> write_anew(const codecs::Recording& anew, const std::filesystem::path& from,
                                           const std::filesystem::path& to) {
  const auto bytes = codecs::write_recording(anew);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto asset = replay::bytes_of(replay::asset_path(from, anew.assets.front()));
  if (!asset) return tl::unexpected(asset.error());
  if (const auto written = replay::write_bytes(to, *bytes); !written) return written;
  return replay::write_bytes(replay::asset_path(to, anew.assets.front()), *asset);
}

int replay_file(const std::filesystem::path& path, const Options& options) {
  const std::string name = path.filename().string();
  const auto bytes = replay::bytes_of(path);
  if (!bytes) return fail(name, bytes.error());
  const auto recording = codecs::read_recording(*bytes);
  if (!recording) return fail(name, recording.error());
  const auto asset = replay::asset_of(*recording, path);
  if (!asset) return fail(name, asset.error());
  const std::string here = replay::made_here(*recording);
  if (recording->made_with != here && options.record.empty()) {
    fmt::print("{}: not to be replayed here: it was made with {}, this is {}\n", name, recording->made_with, here);
    return kNotHere;
  }
  auto replayed = replay::replay(*recording, *asset, {.within = options.within, .keeps_values = options.keeps_values});
  if (!replayed) return fail(name, replayed.error());
  if (!options.record.empty()) {
    replayed->anew.made_with = here;
    const std::filesystem::path to(options.record);
    const auto written = write_anew(replayed->anew, path, options.folder.empty() ? to : to / name);
    if (!written) return fail(name, written.error());
  }
  const std::string size = fmt::format("{} ticks, {} answers", replayed->ticks, replayed->answers);
  if (!replayed->difference.empty()) return fail(name, fmt::format("differs ({}): {}", size, replayed->difference));
  fmt::print("{}: as recorded ({})\n", name, size);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Replays recorded sessions, and names the first tick and field that come out otherwise.\n"
      "Exits with 0 where all is as recorded, 1 where something differs or is broken, 3 where all else is recorded "
      "with\n"
      "another compiler, C library or graphics driver, or this machine has no AVX2.",
      "farfeel replay");
  auto* file = app.add_option("file", options.file, "A recording (.ffrec); its asset lies beside it in assets/")
                   ->check(CLI::ExistingFile);
  app.add_option("--all", options.folder, "Every recording in a folder")->check(CLI::ExistingDirectory)->excludes(file);
  app.add_option("--within", options.within,
                 "Numbers may differ by this times the larger one, or times one. Of recordings with values")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--record", options.record,
                 "Writes the same inputs with what comes out now: a file; beside --all a folder");
  app.add_flag("--values", options.keeps_values, "Of --record: with the values of all outputs, not their hashes alone");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  if (const auto held = replay::hold_to_avx2(); !held) {
    fmt::print("farfeel replay: {}\n", held.error());
    return kNotHere;
  }
  std::vector<std::filesystem::path> paths;
  if (!options.file.empty()) paths.emplace_back(options.file);
  if (!options.folder.empty()) {
    for (const auto& entry : std::filesystem::directory_iterator(options.folder))
      if (entry.path().extension() == ".ffrec") paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
  }
  if (paths.empty()) return fail("farfeel replay", "no recording was named; see --help");
  bool fails = false, is_elsewhere = false;
  for (const auto& path : paths) {
    const int code = replay_file(path, options);
    fails = fails || code == kFails, is_elsewhere = is_elsewhere || code == kNotHere;
  }
  return fails ? kFails : is_elsewhere ? kNotHere : 0;
}
