// Replays a haptic loop's ticks from a recording: the same loop, with a device and a remote that say what was recorded.
#pragma once

#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "codecs/recording/felt_asset.h"
#include "master_station/recording/tick_fields.h"

namespace farfeel::master_station {

class LoopReplay {
 public:
  /// asset: of the session; looked at where the loop finds contacts itself. Fails where the settings are none.
  [[nodiscard]] static tl::expected<LoopReplay, std::string> begin(codecs::NumberReader& settings,
                                                                   const codecs::FeltAsset& asset);
  LoopReplay(LoopReplay&&) noexcept;
  ~LoopReplay();

  [[nodiscard]] std::span<const motion::MovingObject> moving() const;  ///< the scripts among the settings
  /// The next record of the stream of ticks.
  [[nodiscard]] codecs::Outputs tick(const codecs::Stream&, const codecs::Record&);

 private:
  class State;
  explicit LoopReplay(std::unique_ptr<State>);
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::master_station
