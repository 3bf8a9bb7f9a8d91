// Which back end finds penetration depths in this process, decided once at its start, and why.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "haptic_core/contact_service/contact_service.h"

namespace farfeel::slave_sim {

struct ChosenDepths {
  contact_service::DepthBackEnd back_end = contact_service::DepthBackEnd::kSimd;
  std::unique_ptr<penetration::BackEndMaker> maker{};  ///< of DepthBackEnd::kGiven
  std::string reason;                                  ///< for a log: what was chosen, and why
};

struct DepthWish {
  std::string name = "auto";                          ///< auto, simd, egl, reference, historical
  bool is_textured = true;                            ///< the scene: without texture nobody asks for depths
  std::function<void(const std::string&)> on_loss{};  ///< told why, should a graphics device fail later on
};

/// auto is simd unless a real graphics device is there and found faster in a trial of some tenths of a second; no GL
/// library is loaded for a scene without texture, nor where the machine shows no graphics device. egl and historical
/// take a software driver, too, and fail where there is none. From an ordinary thread, before others start.
[[nodiscard]] tl::expected<ChosenDepths, std::string> choose_depths(const DepthWish&);

}  // namespace farfeel::slave_sim
