// A device for tests, opened once a program; where there is none they are skipped, with the reason.
#pragma once

#include <gtest/gtest.h>

#include <random>

#include "haptic_core/penetration/egl/egl_back_end.h"
#include "haptic_core/penetration/simd/simd.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration::egl {

inline constexpr Limits kLimits{.coarse_triangles = 2048};

class OnDevice : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    // Patience beyond any machine's load: what is judged is answers and counts, and a client that walks away, as one
    // does after 5 ms while another session's surface is uploaded, has its answer from simd.
    const auto opened = Device::open({.clients = 4, .patience_s = 10});
    if (opened) {
      device_ = *opened;
    } else {
      why_not_ = opened.error().message;
    }
  }
  static void TearDownTestSuite() { device_.reset(); }
  void SetUp() override {
    if (!device_) GTEST_SKIP() << "no OpenGL 4.5: " << why_not_;
  }

  /// With the plates' surfaces on the device.
  template <typename... Scenes>
  static std::unique_ptr<EglBackEnd> back_end(const Scenes&... plates) {
    auto egl = make_egl(device_, kLimits);
    (egl->prepare(plates.s), ...);
    (egl->prepare(plates.t), ...);
    return egl;
  }

  static inline std::shared_ptr<Device> device_;
  static inline std::string why_not_;
};

/// T turned, tilted and pressed anyhow, within some tenths of a millimetre.
inline void press_at_random(Plates& plates, std::mt19937& random, double tilt_rad) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const double u = tilt_rad * unit(random), v = tilt_rad * unit(random), turn = 3 * unit(random);
  plates.X_CT.R = spatial::rotation_from_vector({u, v, turn}) * kTurnedOver;
  plates.X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
}

}  // namespace farfeel::penetration::egl
