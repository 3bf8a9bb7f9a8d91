#include "slave_sim/depths/chosen_depths.h"

#include <fmt/format.h>

#include "haptic_core/penetration/egl/egl_back_end.h"
#include "haptic_core/penetration/historical/historical.h"
#include "haptic_core/penetration/simd.h"
#include "slave_sim/depths/depth_trial.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::DepthBackEnd;
using penetration::egl::Device;

constexpr std::size_t kTrialFrames = 300;
constexpr std::uint32_t kRings = 2;  // a session's, and the trial's before it

ChosenDepths simd(const std::string& why) {
  return {.reason = fmt::format("simd ({} kernels): {}", penetration::instruction_set_name(), why)};
}

std::string name_of(const Device& device) {
  return fmt::format("egl on {} ({}, {})", device.info().renderer, device.info().platform, device.info().vendor);
}

tl::expected<std::shared_ptr<Device>, std::string> opened(const DepthWish& wish) {
  auto device = Device::open({.clients = kRings, .on_loss = wish.on_loss});
  if (!device) return tl::unexpected(device.error().message);
  return *device;
}

ChosenDepths egl(std::shared_ptr<Device> device, const std::string& why) {
  std::string reason = fmt::format("{}: {}; warm after {:.0f} ms", name_of(*device), why, device->info().warmup_ms);
  return {.back_end = DepthBackEnd::kGiven,
          .maker = std::make_unique<penetration::egl::EglMaker>(std::move(device)),
          .reason = std::move(reason)};
}

/// The faster one.
ChosenDepths measured(const DepthWish& wish) {
  if (!wish.is_textured) return simd("nothing in this scene has texture");
  if (!headless_gl::has_graphics_device()) return simd("no graphics device (/dev/dri/renderD*, /dev/nvidia*)");
  auto device = opened(wish);
  if (!device) return simd(device.error());
  if ((*device)->info().is_software) return simd(fmt::format("{} draws with the processor", name_of(**device)));
  const double simd_us = trial_us(*penetration::make_simd(kTrialLimits), kTrialFrames);
  const auto on_device = penetration::egl::make_egl(*device, kTrialLimits);
  const double egl_us = trial_us(*on_device, kTrialFrames);
  const std::string trial = fmt::format("seven contacts took {:.0f} us there and {:.0f} us in simd", egl_us, simd_us);
  if (on_device->tally().by_simd > 0) return simd(fmt::format("{} did not answer every contact", name_of(**device)));
  if (egl_us >= simd_us) return simd(fmt::format("{}: {}", name_of(**device), trial));
  return egl(*std::move(device), trial);
}

}  // namespace

tl::expected<ChosenDepths, std::string> choose_depths(const DepthWish& wish) {
  if (wish.name == "auto") return measured(wish);
  if (wish.name == "simd") return simd("asked for");
  if (wish.name == "reference")
    return ChosenDepths{.back_end = DepthBackEnd::kReference, .reason = "the slow obvious reference: asked for"};
  if (wish.name == "egl") {
    auto device = opened(wish);
    if (!device) return tl::unexpected(fmt::format("--penetration egl: {}", device.error()));
    return egl(*std::move(device), "asked for");
  }
  if (wish.name == "historical") {
    if (auto tried = penetration::historical::make_historical(kTrialLimits); !tried)
      return tl::unexpected(fmt::format("--penetration historical: {}", tried.error().message));
    return ChosenDepths{.back_end = DepthBackEnd::kGiven,
                        .maker = std::make_unique<penetration::historical::HistoricalMaker>(),
                        .reason = "the source's own algorithm: asked for"};
  }
  return tl::unexpected(
      fmt::format("--penetration {}: there are auto, simd, egl, reference and historical", wish.name));
}

}  // namespace farfeel::slave_sim
