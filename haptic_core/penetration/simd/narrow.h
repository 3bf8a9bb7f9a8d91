// The kernels reckon in float, whoever asks them in double.
#pragma once

namespace farfeel::penetration {

[[nodiscard]] constexpr float narrow(double x) {
  return static_cast<float>(x);
}

}  // namespace farfeel::penetration
