// Surfaces' heights on the device: their spline coefficients and the bounds that prune a search.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "haptic_core/penetration/egl/gl.h"
#include "haptic_core/penetration/felt_surface.h"

namespace farfeel::penetration::egl {

/// Where one surface stands in the two buffers.
struct SurfacePlace {
  struct Chart {
    std::uint32_t heights = 0;                             ///< 16-bit words before its first coefficient
    std::array<std::uint32_t, kBoundsLevels> levels = {};  ///< 32-bit words before each level of its bounds
  };
  std::vector<Chart> charts;
  std::uint32_t heights_first = 0, heights_size = 0, bounds_first = 0, bounds_size = 0;
};

/// Copies between buffers that bring a changed tile to the device; offsets and sizes in bytes.
struct TileCopy {
  bool is_bounds;
  std::uint32_t from, to, size;
};

/// Belongs to the thread that has the context, but for release().
class HeightStore {
 public:
  explicit HeightStore(const Gl& gl) : gl_(gl) {}

  /// Uploads a surface. False where the device has no room: a buffer may hold 128 MiB.
  [[nodiscard]] bool add(const FeltSurface&, SurfacePlace&);
  /// Any thread.
  void release(const SurfacePlace&);
  /// Binds both buffers as the shaders expect them.
  void bind() const;
  [[nodiscard]] GLuint heights() const { return heights_.name; }
  [[nodiscard]] GLuint bounds() const { return bounds_.name; }

 private:
  /// Room handed out first fit; units are the shader's.
  struct Room {
    std::map<std::uint32_t, std::uint32_t> taken;  // first, size
    [[nodiscard]] std::uint32_t take(std::uint32_t size);
  };
  struct Buffer {
    GLuint name = 0;
    std::size_t bytes = 0;
  };
  [[nodiscard]] bool grow(Buffer&, std::size_t bytes);

  const Gl& gl_;
  Buffer heights_, bounds_;
  std::mutex mutex_;
  Room heights_room_, bounds_room_;
};

/// What must be copied for the tiles that `surface` has taken since `seen`, oldest first, as many as there is room for:
/// their coefficients and bounds are appended to `bytes` (TileCopy::from: offsets in it), and `seen` follows. True once
/// nothing is left. Allocates nothing beyond the vectors' capacities.
[[nodiscard]] bool append_changes(const FeltSurface& surface, const SurfacePlace& place, std::uint64_t& seen,
                                  std::vector<std::uint8_t>& bytes, std::vector<TileCopy>& copies) noexcept;

}  // namespace farfeel::penetration::egl
