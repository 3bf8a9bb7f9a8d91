// The middle stage of an answer: how deep each near contact is, by a penetration back end or in closed form.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/contact/plane_depth.h"
#include "haptic_core/contact/soft_widths.h"
#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/contact_service/far_contacts.h"
#include "haptic_core/contact_service/near_contacts.h"
#include "haptic_core/contact_service/tiles_under.h"
#include "haptic_core/contact_service/twin_contacts.h"
#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/search_budget.h"
#include "haptic_core/penetration/window.h"

namespace farfeel::contact_service {

class Depths {
 public:
  /// The only place that allocates; `near` outlives this.
  Depths(NearContacts& near, const penetration::Limits& limits, const ContactOptions& options);

  /// Fills in the rest of every near contact. Realtime-safe.
  void find(const spatial::Pose& X_WT, double dt_s, bool wants_curvature, StageTimes& times) noexcept;
  void restart() noexcept {
    widths_.restart();
    named_count_ = 0;
    twins_.restart();
    budget_.restart();
    lacks_ = {};
  }

  /// Whether any of an object's or the tool's heights may not be at hand.
  [[nodiscard]] bool may_lack_heights(std::uint32_t object) const noexcept;

  /// The tiles that the near contacts are made from, and those up to margin_m beside them, the deepest contact's first.
  [[nodiscard]] std::span<const SurfaceTile> tiles_needed(const spatial::Pose& X_WT, double margin_m,
                                                          double soft_width_m);

 private:
  /// A textured contact that may push, and for how many answers it has been carried: penetration::SearchBudget.
  struct Open {
    std::size_t i;  ///< of the near contact
    std::uint32_t carries;
    bool is_ready;  ///< to be searched
    penetration::Query query;
  };

  [[nodiscard]] bool is_budgeted() const noexcept { return options_.most_searches > 0; }
  /// Of the whole plane.
  [[nodiscard]] penetration::Query query_for(std::size_t i, const spatial::Pose& X_WT) noexcept;
  /// False where the patches share nothing.
  [[nodiscard]] bool fit_window(penetration::Query&) noexcept;
  /// Makes ready for the back end what may be searched, and notes which of its heights lack: false where there is
  /// nothing.
  [[nodiscard]] bool may_be_searched(NearContact&, penetration::Query&) noexcept;
  void note_lack(NearContact&, const penetration::Query&) noexcept;
  void note_lack_of_layers(NearContact&) const noexcept;
  [[nodiscard]] bool wants_window(std::uint32_t object) const noexcept;
  /// Whether contacts with this object need no grid. The slow back ends answer everything themselves.
  [[nodiscard]] bool is_plain(const FeltObject& object) const noexcept;
  /// Adds a query to be answered.
  void ask(std::size_t i, const penetration::Query&) noexcept;
  /// Answers some of the open contacts anew, and carries the others.
  void search_on_budget(std::span<Open> open) noexcept;
  [[nodiscard]] bool ask_far_one() noexcept;
  /// Answers the queries from this one on.
  void evaluate(std::size_t first) noexcept;
  void judge(const NearContact&, const spatial::Pose& X_WT, StageTimes& times) noexcept;
  /// Where a contact comes as another of the same object and direction goes, it is as wide as that was.
  void follow_names() noexcept;

  NearContacts& near_;
  ContactOptions options_;
  penetration::WindowFinder windows_;
  contact::PlaneDepth plane_depth_;
  TilesUnder tiles_under_;
  std::unique_ptr<penetration::BackEnd> back_end_;
  penetration::SearchBudget budget_;
  contact::SoftWidths widths_;
  struct Named {
    std::uint32_t id, object;
    glm::dvec3 nhat_ST_S, p_S;
  };
  struct Lack {
    std::uint32_t contact = 0;
    bool lacks_heights = false;
    double off_m = 0;
  };
  static constexpr std::size_t kLackSlots = 64;
  std::array<Lack, kLackSlots> lacks_{};              // of contacts as they were searched last
  std::array<Named, contact::kMaxContacts> named_{};  // the contacts of the answer before
  std::size_t named_count_ = 0;
  FarContacts far_;
  TwinContacts twins_;

  std::array<std::vector<std::uint32_t>, contact::kMaxContacts> triangles_s_, triangles_t_;
  std::array<Open, contact::kMaxContacts> open_{};
  std::size_t asked_ = 0;  // queries of this answer
  std::array<penetration::Query, contact::kMaxContacts> queries_{};
  std::array<penetration::Penetration, contact::kMaxContacts> answers_{};
  std::array<std::size_t, contact::kMaxContacts> asked_by_{};              // index of each query's near contact
  std::array<const contact::Cluster*, contact::kMaxContacts> clusters_{};  // of the queries
  std::vector<SurfaceTile> needed_;
};

}  // namespace farfeel::contact_service
