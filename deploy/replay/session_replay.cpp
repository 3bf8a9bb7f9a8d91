#include "deploy/replay/session_replay.h"

#include <fmt/format.h>
#include <gnu/libc-version.h>

#include <fstream>
#include <iterator>

#include "haptic_core/headless_gl/headless_context.h"
#include "haptic_core/penetration/historical/historical.h"
#include "haptic_core/penetration/simd/simd.h"
#include "master_station/recording/loop_replay.h"
#include "slave_sim/recording/answer_replay.h"

namespace farfeel::replay {
namespace {

using codecs::Outputs;
using codecs::Record;
using codecs::Recording;
using codecs::Stream;

/// Replays one stream, record by record: run(record) -> Outputs. Adds what came out to the recording anew.
template <typename Run>
tl::expected<void, std::string> replay_stream(const Stream& stream, const ReplayWish& wish, Replayed& replayed,
                                              Run&& run) {
  Stream& anew = replayed.anew.streams.emplace_back(Stream{stream.name, stream.inputs, {}, {}});
  bool differs = false;
  for (std::size_t i = 0; i < stream.records.size(); ++i) {
    const Record& record = stream.records[i];
    const tl::expected<Outputs, std::string> outputs = run(record);
    if (!outputs) return tl::unexpected(outputs.error());
    if (anew.outputs.empty())
      for (const codecs::Output& output : *outputs) anew.outputs.push_back(output.name);
    anew.records.push_back({record.inputs, record.messages, codecs::outcome_of(*outputs, wish.keeps_values)});
    if (differs) continue;
    const auto difference = codecs::first_difference(record.outcome, *outputs, wish.within);
    if (!difference) continue;
    differs = true;
    replayed.difference += fmt::format("{}{} {}: {}: {}", replayed.difference.empty() ? "" : "; ", stream.name, i,
                                       difference->field, difference->how);
  }
  if (stream.outputs != anew.outputs && !stream.records.empty() && replayed.difference.empty())
    return tl::unexpected(fmt::format("the outputs of its {} are named otherwise: record it anew", stream.name));
  return {};
}

}  // namespace

tl::expected<void, std::string> hold_to_avx2() {
  penetration::hold_best_to(penetration::InstructionSet::kAvx2);
  if (penetration::instruction_set_name() != "avx2") return tl::unexpected(std::string("this machine has no AVX2"));
  return {};
}

std::string made_here(const Recording& recording) {
#if defined(__clang__)
  std::string here = fmt::format("clang {}.{}", __clang_major__, __clang_minor__);
#else
  std::string here = fmt::format("g++ {}.{}", __GNUC__, __GNUC_MINOR__);
#endif
#if !defined(__OPTIMIZE__)
  here += " without optimisation";
#endif
  here += fmt::format(", glibc {}, {} kernels", gnu_get_libc_version(), penetration::instruction_set_name());
  codecs::NumberReader settings(recording.settings.names, recording.settings.values);
  const auto options = slave_sim::options_in(settings);
  if (!options || !options->is_historical) return here;
  const auto gl = headless_gl::HeadlessContext::create({.major = 4, .minor = 5});
  return here + ", " + (gl ? gl->renderer() + ", OpenGL " + gl->version() : "no OpenGL");
}

tl::expected<Replayed, std::string> replay(const Recording& recording, const codecs::FeltAsset& asset,
                                           const ReplayWish& wish) {
  codecs::NumberReader settings(recording.settings.names, recording.settings.values);
  auto loop = master_station::LoopReplay::begin(settings, asset);
  if (!loop) return tl::unexpected(loop.error());
  auto answers = slave_sim::AnswerReplay::begin(settings, asset.scene, loop->moving(),
                                                penetration::historical::historical_maker());
  if (!answers) return tl::unexpected(answers.error());
  if (!settings.unasked().empty())
    return tl::unexpected(fmt::format("nobody here knows its setting {}", settings.unasked()));

  Replayed replayed;
  replayed.anew = {recording.title, recording.made_with, wish.keeps_values, recording.settings, recording.assets, {}};
  for (const Stream& stream : recording.streams) {
    const bool are_ticks = stream.name == master_station::kTicks;
    if (!are_ticks && stream.name != slave_sim::kAnswers)
      return tl::unexpected(fmt::format("nobody here knows its stream {}", stream.name));
    (are_ticks ? replayed.ticks : replayed.answers) = stream.records.size();
    const auto went = replay_stream(stream, wish, replayed, [&](const Record& record) {
      return are_ticks ? tl::expected<Outputs, std::string>(loop->tick(stream, record))
                       : answers->answer(stream, record);
    });
    if (!went) return tl::unexpected(went.error());
  }
  return replayed;
}

std::filesystem::path asset_path(const std::filesystem::path& recording, std::uint64_t hash) {
  return recording.parent_path() / "assets" / fmt::format("{:016x}.felt", hash);
}

tl::expected<std::vector<std::byte>, std::string> bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> read{std::istreambuf_iterator<char>(file), {}};
  if (!file) return tl::unexpected(fmt::format("{} can't be read", path.string()));
  const auto bytes = std::as_bytes(std::span(read));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

tl::expected<void, std::string> write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return tl::unexpected(fmt::format("{} can't be written", path.string()));
  return {};
}

tl::expected<codecs::FeltAsset, std::string> asset_of(const Recording& recording, const std::filesystem::path& path) {
  if (recording.assets.size() != 1) return tl::unexpected(std::string("it is not of one asset"));
  const std::filesystem::path where = asset_path(path, recording.assets.front());
  const auto bytes = bytes_of(where);
  if (!bytes) return tl::unexpected(bytes.error());
  if (codecs::hashed(*bytes) != recording.assets.front())
    return tl::unexpected(fmt::format("{} is not the asset that it was recorded on", where.string()));
  return codecs::read_felt_asset(*bytes);
}

}  // namespace farfeel::replay
