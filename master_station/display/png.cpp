#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "master_station/display/picture.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace farfeel::master_station {
namespace {

// The library packs with fixed codes, which fit a drawn picture better than what a filter leaves of it. Set once,
// before threads pack.
[[maybe_unused]] const int kFilter = stbi_write_force_png_filter = 0;

}  // namespace

std::string png(const Image& image) {
  std::string bytes;
  const auto append = [](void* to, void* from, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(from), static_cast<std::size_t>(size));
  };
  std::vector<std::uint8_t> rgb;  // a picture is opaque
  rgb.reserve(image.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4)
    rgb.insert(rgb.end(), image.rgba.begin() + static_cast<std::ptrdiff_t>(i),
               image.rgba.begin() + static_cast<std::ptrdiff_t>(i) + 3);
  stbi_write_png_to_func(append, &bytes, image.width, image.height, 3, rgb.data(), image.width * 3);
  return bytes;
}

}  // namespace farfeel::master_station
