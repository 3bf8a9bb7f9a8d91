#include "tests/bench/svg.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

namespace farfeel::bench {

Svg::Svg(const std::string& path, const glm::dvec2& size_px, double letters_px) : file_(path) {
  fmt::print(file_,
             "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' font-family='sans-serif' font-size='{}'>\n"
             "<rect width='100%' height='100%' fill='white'/>\n",
             size_px.x, size_px.y, letters_px);
}

Svg::~Svg() {
  fmt::print(file_, "</svg>\n");
}

void Svg::words(const glm::dvec2& at, std::string_view text, const WordStyle& style) {
  const std::string size = style.size_px > 0 ? fmt::format(" font-size='{}'", style.size_px) : "";
  fmt::print(file_, "<text transform='translate({:.1f} {:.1f}){}' text-anchor='{}' fill='{}'{}>{}</text>\n", at.x, at.y,
             style.is_turned ? " rotate(-90)" : "", style.anchor, style.colour, size, text);
}

void Svg::line(const glm::dvec2& from, const glm::dvec2& to, const Ink& ink) {
  const glm::dvec2 both[] = {from, to};
  curve(both, ink);
}

void Svg::curve(std::span<const glm::dvec2> points, const Ink& ink) {
  fmt::print(file_, "<polyline fill='none' stroke='{}' stroke-width='{}' stroke-dasharray='{}' points='", ink.colour,
             ink.width_px, ink.dashes);
  for (const glm::dvec2& point : points) fmt::print(file_, "{:.1f},{:.1f} ", point.x, point.y);
  fmt::print(file_, "'/>\n");
}

void Svg::box(const glm::dvec2& corner, const glm::dvec2& size_px, const Ink& ink) {
  fmt::print(file_, "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='none' stroke='{}'/>\n", corner.x,
             corner.y, size_px.x, size_px.y, ink.colour);
}

void Svg::dot(const glm::dvec2& at, std::string_view colour, double opacity, std::string_view tip) {
  fmt::print(file_, "<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}' fill-opacity='{}'><title>{}</title></circle>\n",
             at.x, at.y, colour, opacity, tip);
}

}  // namespace farfeel::bench
