// Newell's normal N = 1/2 sum of p_i x p_(i+1) is the polygon's area vector; seen along it the outline has its greatest
// signed area, and runs counter-clockwise. There ears are clipped: a corner i may go, as the triangle (p, i, q) with
// its neighbours, if it turns left and no corner that turns right lies in that triangle (Meisters, Am. Math. Monthly
// 82, 1975: every simple polygon of four or more corners has two). A clipped ear changes its neighbours alone
// (O'Rourke, Computational Geometry in C, 1.6), so that each corner waits in a queue until one of its neighbours has
// gone; corners whose neighbour has just gone wait longest, which keeps the triangles from becoming a fan.
#include "codecs/mesh/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

namespace farfeel::codecs {
namespace {

using geometry::Triangle;

constexpr double kFlat = 4e-15;        ///< twice an area below this share of the extent's square is rounding
constexpr double kSliver = 1e-6;       ///< what is narrower than this share of its extent has no inside to be left
constexpr double kBent = 1e-3;         ///< a quad further from its plane than this share of its extent is bent
constexpr std::size_t kMost = 20'000;  ///< corners of a polygon that is not convex: work grows with their square
constexpr std::string_view kCrosses =
    "a polygon whose outline crosses itself, so that it has no inside; let the exporter cut it into triangles";
constexpr std::string_view kTooMany =
    "a polygon of more than 20000 corners that is not convex; let the exporter cut it into triangles";

class Outline {
 public:
  /// Seen along n, a unit vector.
  Outline(std::span<const glm::dvec3> corners, const glm::dvec3& n) {
    glm::dvec3 least(0);
    least[std::abs(n.x) <= std::abs(n.y) ? (std::abs(n.x) <= std::abs(n.z) ? 0 : 2)
                                         : (std::abs(n.y) <= std::abs(n.z) ? 1 : 2)] = 1;
    const glm::dvec3 u = glm::normalize(glm::cross(least, n)), v = glm::cross(n, u);
    double extent = 0;
    for (const glm::dvec3& p : corners) {
      at_.emplace_back(glm::dot(p, u), glm::dot(p, v));
      extent = std::max({extent, std::abs(at_.back().x), std::abs(at_.back().y)});
    }
    none_ = kFlat * extent * extent;
    near_ = kSliver * extent;
  }
  [[nodiscard]] std::size_t size() const { return at_.size(); }
  [[nodiscard]] const glm::dvec2& operator[](std::size_t i) const { return at_[i]; }
  /// 1: c lies to the left of a -> b; -1: to the right; 0: in line.
  [[nodiscard]] int side(std::size_t a, std::size_t b, std::size_t c) const {
    const glm::dvec2 ab = at_[b] - at_[a], ac = at_[c] - at_[a];
    const double area = ab.x * ac.y - ab.y * ac.x;
    return area > none_ ? 1 : area < -none_ ? -1 : 0;
  }
  /// Every corner turns left, and they turn round once.
  [[nodiscard]] bool is_convex() const {
    const std::size_t n = size();
    int flips = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t next = (i + 1) % n, after = (i + 2) % n;
      if (side(i, next, after) <= 0) return false;
      flips += (at_[next].x > at_[i].x) != (at_[after].x > at_[next].x);
    }
    return flips <= 2;
  }
  [[nodiscard]] bool crosses_itself() const {
    const std::size_t n = size();
    std::vector<std::size_t> by_left(n);
    for (std::size_t i = 0; i < n; ++i) by_left[i] = i;
    const auto left = [&](std::size_t i) { return std::min(at_[i].x, at_[(i + 1) % n].x); };
    const auto right = [&](std::size_t i) { return std::max(at_[i].x, at_[(i + 1) % n].x); };
    std::sort(by_left.begin(), by_left.end(), [&](std::size_t a, std::size_t b) { return left(a) < left(b); });
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t a = by_left[i], b = (a + 1) % n;
      for (std::size_t j = i + 1; j < n && left(by_left[j]) <= right(a); ++j) {
        const std::size_t c = by_left[j], d = (c + 1) % n;
        if (lie_apart(a, b, c, d) && lie_apart(c, d, a, b)) return true;
      }
    }
    return false;
  }

 private:
  /// Do c and d lie on different sides of a -> b, further than files' digits tell?
  [[nodiscard]] bool lie_apart(std::size_t a, std::size_t b, std::size_t c, std::size_t d) const {
    const glm::dvec2 ab = at_[b] - at_[a], ac = at_[c] - at_[a], ad = at_[d] - at_[a];
    const double to_c = ab.x * ac.y - ab.y * ac.x, to_d = ab.x * ad.y - ab.y * ad.x, least = glm::length(ab) * near_;
    return std::min(std::abs(to_c), std::abs(to_d)) > least && (to_c > 0) != (to_d > 0);
  }

  std::vector<glm::dvec2> at_;
  double none_ = 0, near_ = 0;
};

/// The outline's corners that are left, and the triangles that are gone.
class EarClipping {
 public:
  explicit EarClipping(const Outline& outline) : at_(outline), left_(outline.size()), corners_(outline.size()) {
    for (std::size_t i = 0; i < left_; ++i) {
      corners_[i].before = (i + left_ - 1) % left_;
      corners_[i].after = (i + 1) % left_;
    }
    for (std::size_t i = 0; i < left_; ++i) {
      if (turn(i) <= 0) not_left_.push_back(i);
    }
  }

  /// Empty if some corner could not be clipped.
  std::vector<std::array<std::size_t, 3>> triangles() {
    // What touches its ear stops it at first; then only what lies inside it; at last corners in line may go.
    for (int patience = 0; left_ > 3 && patience <= 2;) patience = clip_all(patience) ? 0 : patience + 1;
    if (left_ > 3) return {};
    add(first_alive());
    return std::move(triangles_);
  }

 private:
  struct Corner {
    std::size_t before = 0, after = 0;
    std::uint32_t wait = 0;  ///< only its newest place in the queue counts
    bool is_gone = false;
  };

  [[nodiscard]] int turn(std::size_t i) const { return at_.side(corners_[i].before, i, corners_[i].after); }

  /// True if any ear went.
  bool clip_all(int patience) {
    bool any = false;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (!corners_[i].is_gone) enqueue(i);
    }
    while (!queue_.empty() && left_ > 3) {
      const auto [i, wait] = queue_.front();
      queue_.pop_front();
      if (corners_[i].is_gone || corners_[i].wait != wait || !is_ear(i, patience)) continue;
      const std::size_t before = corners_[i].before, after = corners_[i].after;
      add(i);
      corners_[i].is_gone = true;
      --left_;
      corners_[before].after = after;
      corners_[after].before = before;
      enqueue(before), enqueue(after);
      any = true;
      if (patience > 0) break;  // a strict one may have become possible
    }
    queue_.clear();
    return any;
  }

  void enqueue(std::size_t i) { queue_.emplace_back(i, ++corners_[i].wait); }
  void add(std::size_t i) { triangles_.push_back({corners_[i].before, i, corners_[i].after}); }
  [[nodiscard]] std::size_t first_alive() const {
    std::size_t i = 0;
    while (corners_[i].is_gone) ++i;
    return i;
  }

  bool is_ear(std::size_t i, int patience) {
    if (const int left = turn(i); left <= 0) return left == 0 && patience == 2;
    const std::size_t p = corners_[i].before, q = corners_[i].after;
    const int least = patience == 0 ? 0 : 1;  // on the triangle's border, or inside it
    std::size_t kept = 0;
    bool is_free = true;
    for (std::size_t n = 0; n < not_left_.size(); ++n) {
      const std::size_t r = not_left_[n];
      if (corners_[r].is_gone || turn(r) > 0) continue;  // a corner that turns left once does so ever after
      not_left_[kept++] = r;
      if (!is_free || r == p || r == q || at_[r] == at_[p] || at_[r] == at_[i] || at_[r] == at_[q]) continue;
      is_free = !(at_.side(p, i, r) >= least && at_.side(i, q, r) >= least && at_.side(q, p, r) >= least);
    }
    not_left_.resize(kept);
    return is_free;
  }

  const Outline& at_;
  std::size_t left_;
  std::vector<Corner> corners_;
  std::vector<std::size_t> not_left_;
  std::deque<std::pair<std::size_t, std::uint32_t>> queue_;
  std::vector<std::array<std::size_t, 3>> triangles_;
};

}  // namespace

std::optional<std::string_view> cut_polygon(const std::vector<glm::dvec3>& positions,
                                            std::span<const std::uint32_t> corners, std::vector<Triangle>& out) {
  const auto fan = [&](std::span<const std::uint32_t> of) {
    for (std::size_t i = 2; i < of.size(); ++i) out.push_back({of[0], of[i - 1], of[i]});
    return std::nullopt;
  };
  if (corners.size() == 3) return fan(corners);
  std::vector<std::uint32_t> kept;  // a corner named twice in a row is one
  for (const std::uint32_t corner : corners) {
    if (kept.empty() || corner != kept.back()) kept.push_back(corner);
  }
  while (kept.size() > 1 && kept.front() == kept.back()) kept.pop_back();
  if (kept.size() <= 3) return fan(kept);

  const std::size_t n = kept.size();
  std::vector<glm::dvec3> p;
  for (const std::uint32_t corner : kept) p.push_back(positions[corner] - positions[kept[0]]);
  glm::dvec3 normal(0);
  double area = 0, extent = 0;  // twice the areas
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec3 one = glm::cross(p[i], p[(i + 1) % n]);
    normal += one, area += glm::length(one), extent = std::max(extent, glm::length(p[i]));
  }
  // All in line, or not numbers: it has no area, whatever the triangles; the latter is refused later.
  if (!(area > kSliver * extent * extent) || !std::isfinite(area)) return fan(kept);
  const double length = glm::length(normal);
  if (!(length > kSliver * area)) return kCrosses;
  normal /= length;
  const Outline outline(p, normal);
  const bool is_convex = outline.is_convex();
  if (is_convex && n == 4) return fan(kept);
  if (!is_convex) {
    if (n > kMost) return kTooMany;
    if (outline.crosses_itself()) {
      // A quad that is bent that much only seems to cross itself: either diagonal spans its outline.
      const double bent = std::abs(glm::dot(normal, p[0] + p[2] - p[1] - p[3]));
      if (n != 4 || bent < kBent * extent) return kCrosses;
      if (glm::length(p[2]) > glm::length(p[3] - p[1])) std::rotate(kept.begin(), kept.begin() + 1, kept.end());
      return fan(kept);
    }
  }
  const auto triangles = EarClipping(outline).triangles();
  if (triangles.empty()) return kCrosses;
  for (const auto& [a, b, c] : triangles) out.push_back({kept[a], kept[b], kept[c]});
  return std::nullopt;
}

}  // namespace farfeel::codecs
