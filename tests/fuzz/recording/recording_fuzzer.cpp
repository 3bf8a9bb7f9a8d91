// Any bytes as a recording: refused with a word, or one that is written and read as the same. Its settings and inputs,
// whatever they are, are read or refused.
#include <cstdlib>

#include "codecs/recording/recording.h"
#include "master_station/recording/tick_fields.h"
#include "slave_sim/recording/answer_fields.h"

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  const auto recording = codecs::read_recording(std::as_bytes(std::span(data, size)));
  if (!recording) return demand(!recording.error().empty()), 0;
  const auto written = codecs::write_recording(*recording);
  demand(written.has_value());
  const auto again = codecs::read_recording(*written);
  demand(again && codecs::write_recording(*again) == written);
  codecs::NumberReader settings(recording->settings.names, recording->settings.values);
  if (const auto loop = master_station::loop_in(settings)) demand(spatial::is_valid(loop->settings.X_WB));
  if (const auto options = slave_sim::options_in(settings)) demand(options->options.tolerance_m > 0);
  for (const codecs::Stream& stream : recording->streams) {
    for (const codecs::Record& record : stream.records) {
      (void)master_station::inputs_in(stream, record);
      (void)slave_sim::pose_in(stream, record);
      for (const codecs::RecordedMessage& message : record.messages) (void)slave_sim::edit_in(message);
    }
  }
  return 0;
}
