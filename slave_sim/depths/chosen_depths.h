// Which back end finds penetration depths in this process, decided once at its start, and why.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::slave_sim {

struct ChosenDepths {
  penetration::BackEndMaker maker{};  ///< for ContactOptions::maker; empty: simd
  std::string reason;                 ///< for a log: what was chosen, and why
};

struct DepthWish {
  std::string name = "auto";                          ///< one of depth_names()
  bool is_textured = true;                            ///< the scene: without texture nobody asks for depths
  std::function<void(const std::string&)> on_loss{};  ///< told why, should a graphics device fail later on
};

/// auto is simd unless a real graphics device is there and found faster in a trial of some tenths of a second; no GL
/// library is loaded for a scene without texture, nor where the machine shows no graphics device. egl and historical
/// take a software driver, too, and fail where there is none. From an ordinary thread, before others start.
[[nodiscard]] tl::expected<ChosenDepths, std::string> choose_depths(const DepthWish&);

/// What --penetration takes: auto, and every back end.
[[nodiscard]] std::vector<std::string> depth_names();
/// Whether this one may load a graphics driver, on a machine that shows a graphics device or not.
[[nodiscard]] bool may_draw(std::string_view name, bool is_textured, bool has_device);

}  // namespace farfeel::slave_sim
