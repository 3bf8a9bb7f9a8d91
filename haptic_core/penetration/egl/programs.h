// The compute programs, and the buffers that stay with the device for its life.
#pragma once

#include <array>
#include <string>

#include "haptic_core/penetration/egl/frame_layout.h"
#include "haptic_core/penetration/egl/gl.h"

namespace farfeel::penetration::egl {

inline constexpr std::uint32_t kFramesARing = 3, kWordsAFrame = 1u << 16;  ///< of 16 bytes: 1 MiB a frame
inline constexpr std::uint32_t kDispatchesInFlight = 2, kMostContactsADispatch = 256;

/// A program and where its uniform stands.
struct Program {
  GLuint name = 0;
  GLint directory = -1;
};

/// Belongs to the thread that has the context.
struct Programs {
  Program plain, with_hessian;

  /// Empty, or the driver's complaint.
  [[nodiscard]] std::string compile(const Gl&, std::uint32_t group);
};

/// Words of frames: first the directories of the dispatches in flight, then each client's ring.
struct Buffers {
  GLuint staging = 0, frame = 0, results = 0, workspace = 0;
  Word4* words = nullptr;                     ///< mapped staging
  const std::uint32_t* results_at = nullptr;  ///< mapped results

  /// Empty, or what failed. Leaves them bound.
  [[nodiscard]] std::string create(const Gl&, std::uint32_t frames);
};

inline constexpr std::uint32_t kDirectoryWords = kDispatchesInFlight * kMostContactsADispatch;

}  // namespace farfeel::penetration::egl
