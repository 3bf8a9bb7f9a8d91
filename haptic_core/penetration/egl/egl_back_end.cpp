#include "haptic_core/penetration/egl/egl_back_end.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "haptic_core/penetration/egl/frame_writer.h"
#include "haptic_core/penetration/overlap_view.h"
#include "haptic_core/penetration/simd/finished_sums.h"
#include "haptic_core/penetration/simd/simd.h"

namespace farfeel::penetration::egl {
namespace {

constexpr double kHidden_m = 50e-9;  ///< the device's search leaves no higher peak than this unlisted
constexpr std::size_t kMemories = 64;

double us_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

/// One contact's words among the results.
class Result {
 public:
  Result(std::span<const std::uint32_t> results, std::uint32_t contact)
      : words_(results.subspan(std::size_t{contact} * kResultWords, kResultWords)) {}
  [[nodiscard]] std::uint32_t outcome() const { return words_[kOutcomeAt]; }
  [[nodiscard]] std::uint32_t candidates() const { return std::min(words_[kCandidateCountAt], kMostCandidates); }
  [[nodiscard]] double at(std::uint32_t word) const { return static_cast<double>(std::bit_cast<float>(words_[word])); }
  [[nodiscard]] glm::dvec2 step() const { return {at(kStepAt), at(kStepAt + 1)}; }

 private:
  std::span<const std::uint32_t> words_;
};

/// What the last answer to the query in the same place of the list may be good for now: a place to look at first.
struct Memory {
  const FeltSurface *s = nullptr, *t = nullptr;
  glm::dvec3 p_TQ{0};
  double cell_m = 0;
};

class Egl final : public EglBackEnd {
 public:
  Egl(std::shared_ptr<Device> device, std::span<Frame> ring, const Limits& limits)
      : device_(std::move(device)), ring_(ring), simd_(make_simd(limits)), writer_(limits), s_(limits), t_(limits) {}
  ~Egl() override { device_->give_back(ring_); }
  Egl(const Egl&) = delete;
  Egl& operator=(const Egl&) = delete;

  [[nodiscard]] Traits traits() const noexcept override {
    return {.finds_extent = true, .may_substitute = true, .has_hessian = true, .batches = true};
  }
  void prepare(const FeltSurface& surface) override {
    if (surfaces_.contains(&surface)) return;
    const std::uint64_t seen = surface.changes();
    if (auto place = device_->hold(surface)) surfaces_[&surface] = {std::move(place), seen};
  }
  void restart() noexcept override {
    memories_.fill({});
    simd_->restart();
  }
  void evaluate(std::span<const Query>, std::span<Penetration>) noexcept override;
  [[nodiscard]] Tally tally() const override { return tally_; }

 private:
  struct Held {
    std::shared_ptr<const SurfacePlace> place;
    std::uint64_t seen = 0;  // of the surface's changes
  };
  /// Who answers a query.
  enum class By : std::uint8_t { kSimd, kNobody, kDevice };

  [[nodiscard]] Frame* free_frame() noexcept;
  /// The place of an up-to-date surface; null while changes still wait for room in a frame.
  [[nodiscard]] const SurfacePlace* ready(const FeltSurface*, Frame&) noexcept;
  [[nodiscard]] By write(const Query&, std::size_t memory, Frame&, std::uint32_t& used) noexcept;
  /// Fills a frame from the queries; how many of them are spoken for by it.
  std::size_t fill(std::span<const Query>, std::size_t first_memory, Frame&) noexcept;
  /// False where the device has no answer, though there may be one.
  [[nodiscard]] bool read(const Query&, const Frame&, std::uint32_t contact, Memory&, Penetration&) noexcept;
  [[nodiscard]] Penetration hard_maximum(const Query&, const Result&, const Window& searched) noexcept;
  void by_simd(const Query&, Penetration&) noexcept;

  std::shared_ptr<Device> device_;
  std::span<Frame> ring_;
  std::map<const FeltSurface*, Held> surfaces_;
  std::unique_ptr<BackEnd> simd_;
  FrameWriter writer_;
  FacingPatch s_, t_;
  std::array<By, kMostContactsAFrame> by_{};
  std::array<Window, kMostContactsAFrame> searched_{};
  std::array<Memory, kMemories> memories_{};
  std::uint32_t stamp_ = 2;  // above the warm-up's
  Tally tally_;
};

Frame* Egl::free_frame() noexcept {
  for (Frame& frame : ring_) {
    const std::uint32_t state = frame.state.load(std::memory_order_acquire);
    if (state != Frame::kSubmitted && state != Frame::kInFlight) return &frame;  // what was late is done by now
  }
  return nullptr;
}

const SurfacePlace* Egl::ready(const FeltSurface* surface, Frame& frame) noexcept {
  const auto found = surfaces_.find(surface);
  if (found == surfaces_.end()) return nullptr;
  Held& held = found->second;
  if (held.seen != surface->changes() &&
      !append_changes(*surface, *held.place, held.seen, frame.tile_bytes, frame.tile_copies))
    return nullptr;
  return held.place.get();
}

Egl::By Egl::write(const Query& query, std::size_t memory_index, Frame& frame, std::uint32_t& used) noexcept {
  const SurfacePlace *s = ready(query.s.surface, frame), *t = ready(query.t.surface, frame);
  if (!s || !t) return By::kSimd;
  std::optional<Recall> recall;
  const Memory& memory = memories_[memory_index % kMemories];
  if (query.soft_width_m > 0 && memory.cell_m > 0 && memory.s == query.s.surface && memory.t == query.t.surface)
    recall = {glm::dvec2{spatial::transform_point(query.t.X_CO, memory.p_TQ)}, memory.cell_m};
  const std::uint32_t first_word = frame.first_word + used;
  const auto written = writer_.write(query, *s, *t, recall, frame.words.subspan(used), first_word);
  if (!written) return By::kSimd;
  if (written->words == 0) return By::kNobody;
  searched_[frame.contacts] = written->searched;
  frame.headers[frame.contacts++] = first_word;
  frame.wants_hessian = frame.wants_hessian || query.wants_hessian;
  used += written->words;
  return By::kDevice;
}

/// The device has no estimate that comes with the gradient: who wants to judge a stiffness gets the second derivative.
Query asked_of_device(const Query& query) noexcept {
  Query asked = query;
  asked.wants_hessian = query.wants_hessian || query.estimates_hessian;
  return asked;
}

std::size_t Egl::fill(std::span<const Query> queries, std::size_t first_memory, Frame& frame) noexcept {
  frame.contacts = 0;
  frame.wants_hessian = false;
  frame.tile_bytes.clear(), frame.tile_copies.clear();
  std::uint32_t used = 0;
  std::size_t taken = 0;
  for (; taken < queries.size() && taken < by_.size(); ++taken) {
    by_[taken] = write(asked_of_device(queries[taken]), first_memory + taken, frame, used);
    if (by_[taken] == By::kSimd && 2 * used > frame.words.size()) break;  // an empty frame may have room for it
  }
  frame.used_words = used;
  frame.stamp = ++stamp_;
  return taken;
}

Penetration Egl::hard_maximum(const Query& query, const Result& result, const Window& searched) noexcept {
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  const OverlapView view{s_, t_, query.deepest_m};
  const auto place = [&result](std::uint32_t i) {
    return glm::dvec2{result.at(kCandidatesAt + 3 * i), result.at(kCandidatesAt + 3 * i + 1)};
  };
  Peak peak;
  if (!query.refines) {
    peak.uv = place(0);
    peak.is_inside = view.at(peak.uv, peak.at);
    return peak.is_inside ? view.hard_maximum(query, peak) : Penetration{};
  }
  for (std::uint32_t i = 0; i < result.candidates(); ++i) {
    if (i > 0 && result.at(kCandidatesAt + 3 * i + 2) <= peak.at.d_m + kHidden_m) continue;
    const Peak next = view.climb(place(i), searched, result.step(), false);
    if (next.at.d_m > peak.at.d_m) peak = next;
  }
  if (peak.at.d_m == kNoOverlapThere_m) return {};
  if (!peak.is_inside) peak = view.climb(peak.uv, searched, result.step(), true);
  return view.hard_maximum(query, peak);
}

bool Egl::read(const Query& query, const Frame& frame, std::uint32_t contact, Memory& memory,
               Penetration& answer) noexcept {
  const Result result(frame.results, contact);
  answer = {};
  if (!frame.has_result(contact) || (result.outcome() & kOverflows) != 0) return false;
  if ((result.outcome() & kKnown) == 0) return true;
  if (query.refines && query.soft_width_m > 0) {
    simd::Sums sums{};
    std::uint32_t word = kSumsAt;
    const auto take = [&](std::span<double> totals) {
      for (double& total : totals) total = result.at(word++);
    };
    for (double* total : {&sums.weight, &sums.edge, &sums.border, &sums.steep}) take({total, 1});
    take(sums.point), take(sums.gradient);
    if (query.wants_hessian) take(sums.square), take(sums.curvature);
    answer = finished(sums, result.at(kLevelAt), query.soft_width_m, query.wants_hessian);
  } else {
    answer = hard_maximum(query, result, searched_[contact]);
  }
  if (!answer.is_known()) return false;  // float's patch is a hair wider than double's
  if ((result.outcome() & kCoarse) != 0) answer.doubts |= kCoarseSteps;
  if ((result.outcome() & kLayers) != 0) answer.doubts |= kSeveralLayers;
  memory = {query.s.surface, query.t.surface, spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C),
            result.step().x};
  return true;
}

void Egl::by_simd(const Query& query, Penetration& answer) noexcept {
  simd_->evaluate({&query, 1}, {&answer, 1});
  ++tally_.by_simd;
}

void Egl::evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept {
  std::size_t done = 0;
  while (done < queries.size()) {
    Frame* frame = device_->is_lost() ? nullptr : free_frame();
    if (!frame) {
      for (; done < queries.size(); ++done) by_simd(queries[done], answers[done]);
      return;
    }
    const auto began = std::chrono::steady_clock::now();
    const std::size_t taken = fill(queries.subspan(done), done, *frame);
    tally_.prepare_us = us_since(began);
    bool is_answered = frame->contacts > 0;
    if (is_answered || !frame->tile_copies.empty()) device_->submit(*frame);
    // Meanwhile, what the device does not take.
    for (std::size_t i = 0; i < taken; ++i) {
      if (by_[i] == By::kSimd) by_simd(queries[done + i], answers[done + i]);
      if (by_[i] == By::kNobody) answers[done + i] = {};
    }
    if (is_answered) {
      is_answered = device_->wait(*frame);
      if (is_answered) tally_.last = frame->times;
    }
    std::uint32_t contact = 0;
    for (std::size_t i = 0; i < taken; ++i) {
      if (by_[i] != By::kDevice) continue;
      const Query& query = queries[done + i];
      Penetration& answer = answers[done + i];
      if (!is_answered || !read(asked_of_device(query), *frame, contact, memories_[(done + i) % kMemories], answer)) {
        by_simd(query, answer);
      } else {
        ++tally_.by_device;
      }
      ++contact;
    }
    done += taken;
  }
}

}  // namespace

std::unique_ptr<EglBackEnd> make_egl(std::shared_ptr<Device> device, const Limits& limits) {
  const std::span<Frame> ring = device->take_ring();
  if (ring.empty()) return nullptr;
  return std::make_unique<Egl>(std::move(device), ring, limits);
}

BackEndMaker egl_maker(std::shared_ptr<Device> device) {
  return [device = std::move(device)](const Limits& limits) -> std::unique_ptr<BackEnd> {
    if (auto egl = make_egl(device, limits)) return egl;
    return make_simd(limits);
  };
}

}  // namespace farfeel::penetration::egl
