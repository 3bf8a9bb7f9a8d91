// Triangles of a felt stream, in any order and turned in any way; an order along edges takes some two bits each.
//
// A triangle hangs on an open edge u -> v of one before it, or on nothing. Then it is (v, u, w), and told are: how many
// open edges were opened since that one, how the triangle is turned, and w: the next new vertex, what lies across the
// next open edge after v or before u, or any by its number. Cf. Touma & Gotsman 1998, Triangle mesh compression.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "codecs/asset/felt_coder.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

inline constexpr std::uint32_t kNoVertex = 0xFFFF'FFFF;

/// Where a new vertex is expected: beside `from` and `to` as `across` is on their other side.
struct Parallelogram {
  std::uint32_t from = kNoVertex, to = kNoVertex, across = kNoVertex;
};

/// Edges that one triangle has on one side so far. Every step takes a bounded or amortised constant time.
class OpenEdges {
 public:
  static constexpr std::int32_t kMostRank = 32;  ///< open edges looked at from the newest on
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;
  struct Edge {
    std::uint32_t from, to, across;
    std::uint32_t before_from, before_to;  ///< the edge opened before it that leaves `from`; that comes to `to`
    bool is_open;
  };

  explicit OpenEdges(std::uint32_t vertices) : leaving_(vertices, kNone), coming_(vertices, kNone) {}

  [[nodiscard]] const Edge& operator[](std::uint32_t edge) const { return edges_[edge]; }
  /// The open edge before which `rank` newer ones are open; kNone if there is none, or it is far behind.
  [[nodiscard]] std::uint32_t of_rank(std::int32_t rank) const {
    std::size_t at = newest_.size();
    for (int looked = 0; at > 0 && looked < 4 * kMostRank; ++looked) {
      if (edges_[newest_[--at]].is_open && rank-- == 0) return newest_[at];
    }
    return kNone;
  }
  [[nodiscard]] std::uint32_t leaving(std::uint32_t vertex) { return open_from(leaving_[vertex], &Edge::before_from); }
  [[nodiscard]] std::uint32_t coming(std::uint32_t vertex) { return open_from(coming_[vertex], &Edge::before_to); }

  /// A triangle's three edges, each of which closes the one that runs against it, or else is open.
  void take(const geometry::Triangle& t) {
    for (std::size_t k = 0; k < 3; ++k) take(t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
    // Here, and not where one looks for an edge: who reads looks less often than who writes.
    while (!newest_.empty() && !edges_[newest_.back()].is_open) newest_.pop_back();
  }

 private:
  static std::uint64_t key(std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; }
  std::uint32_t open_from(std::uint32_t& head, std::uint32_t Edge::*before) {
    while (head != kNone && !edges_[head].is_open) head = edges_[head].*before;
    return head;
  }
  void take(std::uint32_t from, std::uint32_t to, std::uint32_t across) {
    if (const auto other = open_.find(key(to, from)); other != open_.end()) {
      edges_[other->second].is_open = false;
      open_.erase(other);
      return;
    }
    const auto edge = static_cast<std::uint32_t>(edges_.size());
    edges_.push_back({from, to, across, leaving_[from], coming_[to], true});
    leaving_[from] = coming_[to] = edge;
    newest_.push_back(edge);
    open_[key(from, to)] = edge;
  }

  std::vector<Edge> edges_;
  std::vector<std::uint32_t> leaving_, coming_;  // a vertex's newest; closed ones are passed over
  std::vector<std::uint32_t> newest_;
  std::unordered_map<std::uint64_t, std::uint32_t> open_;
};

class TriangleModels {
 public:
  explicit TriangleModels(std::uint32_t vertices) : open_(vertices), expected_(vertices) {}

  /// False where it names a vertex or an edge that is not there.
  template <typename Coder>
  [[nodiscard]] bool tell(geometry::Triangle& t, Coder& coder) {
    std::int32_t rank = -1, turn = 0;
    if constexpr (!Coder::kReads) find_edge(t, rank, turn);
    ++rank;
    coder.number(rank, 0, ranks_);
    --rank;
    if (rank < -1 || rank > OpenEdges::kMostRank) return false;
    if (rank < 0) {
      for (std::uint32_t& v : t) {
        if (!tell_vertex(v, coder)) return false;
      }
    } else {
      coder.number(turn, 0, turns_);
      const std::uint32_t edge = open_.of_rank(rank);
      if (turn < 0 || turn > 2 || edge == OpenEdges::kNone) return false;
      if (!tell_apex(edge, t[(static_cast<std::size_t>(turn) + 2) % 3], coder)) return false;
      t[static_cast<std::size_t>(turn)] = open_[edge].to;
      t[(static_cast<std::size_t>(turn) + 1) % 3] = open_[edge].from;
    }
    open_.take(t);
    return true;
  }
  /// Of each vertex, where its first triangle lets it be expected.
  [[nodiscard]] const std::vector<Parallelogram>& expected() const { return expected_; }

 private:
  void find_edge(const geometry::Triangle& t, std::int32_t& rank, std::int32_t& turn) {
    for (std::int32_t r = 0; r <= OpenEdges::kMostRank; ++r) {
      const std::uint32_t edge = open_.of_rank(r);
      if (edge == OpenEdges::kNone) return;
      for (std::size_t k = 0; k < 3; ++k) {
        if (t[k] != open_[edge].to || t[(k + 1) % 3] != open_[edge].from) continue;
        rank = r, turn = static_cast<std::int32_t>(k);
        return;
      }
    }
  }
  template <typename Coder>
  bool tell_vertex(std::uint32_t& v, Coder& coder) {
    bool is_new = v == next_;
    coder.bit(is_new, is_new_[0]);
    return is_new ? take_new(v) : tell_number(v, coder);
  }
  template <typename Coder>
  bool tell_apex(std::uint32_t edge, std::uint32_t& w, Coder& coder) {
    const OpenEdges::Edge e = open_[edge];
    bool is_new = w == next_;
    coder.bit(is_new, is_new_[last_]);
    if (is_new) {
      last_ = 1;
      if (!take_new(w)) return false;
      expected_[w] = {e.from, e.to, e.across};
      return true;
    }
    const std::uint32_t after = open_.leaving(e.to), before = open_.coming(e.from);
    if (after != OpenEdges::kNone) {
      bool is_it = w == open_[after].to;
      coder.bit(is_it, is_after_[last_]);
      if (is_it) return last_ = 2, w = open_[after].to, true;
    }
    if (before != OpenEdges::kNone) {
      bool is_it = w == open_[before].from;
      coder.bit(is_it, is_before_[last_]);
      if (is_it) return last_ = 3, w = open_[before].from, true;
    }
    last_ = 0;
    return tell_number(w, coder);
  }
  bool take_new(std::uint32_t& v) {
    v = next_;
    return ++next_ <= expected_.size();
  }
  /// From the newest backwards; ahead of it where vertices are not met in their order.
  template <typename Coder>
  bool tell_number(std::uint32_t& v, Coder& coder) {
    auto back = static_cast<std::int32_t>(next_) - static_cast<std::int32_t>(v);
    coder.number(back, 0, numbers_);
    const std::int64_t at = std::int64_t{next_} - back;
    if (at < 0 || at >= static_cast<std::int64_t>(expected_.size())) return false;
    v = static_cast<std::uint32_t>(at);
    next_ = std::max(next_, v + 1);
    return true;
  }

  OpenEdges open_;
  std::vector<Parallelogram> expected_;
  std::uint32_t next_ = 0;
  std::size_t last_ = 0;  // what the last apex was: any, new, after, before
  std::array<BitModel, 4> is_new_, is_after_, is_before_;
  NumberModels ranks_, turns_, numbers_;
};

}  // namespace farfeel::codecs
