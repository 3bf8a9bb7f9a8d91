// A picture in SVG, element by element: what every plot of the benchmarks is drawn with.
#pragma once

#include <fstream>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>

namespace farfeel::bench {

struct WordStyle {
  std::string_view anchor = "start";  ///< middle, end
  std::string_view colour = "black";
  double size_px = 0;      ///< 0: the picture's
  bool is_turned = false;  ///< read from below
};
struct Ink {
  std::string_view colour = "#ddd";
  double width_px = 1;
  std::string_view dashes = "none";  ///< "4 3"
};

/// Places and sizes in pixels, from the upper left corner. Words go in as they are: no <, > or &.
class Svg {
 public:
  Svg(const std::string& path, const glm::dvec2& size_px, double letters_px = 12);
  ~Svg();
  Svg(const Svg&) = delete;
  Svg& operator=(const Svg&) = delete;

  void words(const glm::dvec2& at, std::string_view text, const WordStyle& = {});
  void line(const glm::dvec2& from, const glm::dvec2& to, const Ink& = {});
  void curve(std::span<const glm::dvec2> points, const Ink&);
  void box(const glm::dvec2& corner, const glm::dvec2& size_px, const Ink& = {});
  /// tip: what a pointer over it tells.
  void dot(const glm::dvec2& at, std::string_view colour, double opacity = 1, std::string_view tip = {});

 private:
  std::ofstream file_;
};

}  // namespace farfeel::bench
