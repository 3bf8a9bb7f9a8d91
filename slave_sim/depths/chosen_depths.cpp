#include "slave_sim/depths/chosen_depths.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "haptic_core/penetration/egl/egl_back_end.h"
#include "haptic_core/penetration/historical/historical.h"
#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/simd.h"
#include "slave_sim/depths/depth_trial.h"

namespace farfeel::slave_sim {
namespace {

using penetration::egl::Device;

constexpr std::size_t kTrialFrames = 300;
constexpr std::uint32_t kRings = 2;  // a session's, and the trial's before it

using Choice = tl::expected<ChosenDepths, std::string>;

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
  return {.maker = penetration::egl::egl_maker(std::move(device)), .reason = std::move(reason)};
}

/// The faster one.
Choice measured(const DepthWish& wish) {
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

Choice simd_as_asked(const DepthWish&) {
  return simd("asked for");
}

Choice egl_as_asked(const DepthWish& wish) {
  auto device = opened(wish);
  if (!device) return tl::unexpected(fmt::format("--penetration egl: {}", device.error()));
  return egl(*std::move(device), "asked for");
}

Choice reference(const DepthWish&) {
  return ChosenDepths{.maker = penetration::reference_maker(), .reason = "the slow obvious reference: asked for"};
}

Choice historical(const DepthWish&) {
  if (auto tried = penetration::historical::make_historical(kTrialLimits); !tried)
    return tl::unexpected(fmt::format("--penetration historical: {}", tried.error().message));
  return ChosenDepths{.maker = penetration::historical::historical_maker(),
                      .reason = "the source's own algorithm: asked for"};
}

enum class Draws { kNever, kOnADevice, kAlways };

struct Choosable {
  std::string_view name;
  Draws draws;
  Choice (*choose)(const DepthWish&);
};

/// A back end is registered here, and nowhere else.
constexpr std::array kChoosable{
    Choosable{"auto", Draws::kOnADevice, measured},      Choosable{"simd", Draws::kNever, simd_as_asked},
    Choosable{"egl", Draws::kAlways, egl_as_asked},      Choosable{"reference", Draws::kNever, reference},
    Choosable{"historical", Draws::kAlways, historical},
};

const Choosable* find(std::string_view name) {
  const auto* const found = std::find_if(kChoosable.begin(), kChoosable.end(),
                                         [name](const Choosable& choosable) { return choosable.name == name; });
  return found == kChoosable.end() ? nullptr : found;
}

}  // namespace

Choice choose_depths(const DepthWish& wish) {
  if (const Choosable* const named = find(wish.name)) return named->choose(wish);
  return tl::unexpected(fmt::format("--penetration {}: there are {}", wish.name, fmt::join(depth_names(), ", ")));
}

std::vector<std::string> depth_names() {
  std::vector<std::string> names;
  for (const Choosable& choosable : kChoosable) names.emplace_back(choosable.name);
  return names;
}

bool may_draw(std::string_view name, bool is_textured, bool has_device) {
  const Choosable* const named = find(name);
  return named && (named->draws == Draws::kAlways || (named->draws == Draws::kOnADevice && is_textured && has_device));
}

}  // namespace farfeel::slave_sim
