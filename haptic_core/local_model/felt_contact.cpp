#include "haptic_core/local_model/felt_contact.h"

#include "haptic_core/ablation/ablation.h"

namespace farfeel::local_model {

FeltContact felt_contact(const ReceivedContact& received) noexcept {
  FeltContact felt;
  felt.received = received;
  felt.transition.nhat_W = received.contact.nhat_ST_W;
  felt.transition.slope_W = received.slope_W;
  return felt;
}

Tangent FeltContact::in_use(const glm::dvec3& aside_W) const noexcept {
  Tangent tangent = received.tangent();
  tangent.p_WC_W += aside_W;
  tangent.nhat_W = transition.nhat_W;
  tangent.slope_W = transition.slope_W;
  return tangent;
}

double FeltContact::beyond_received_m(const spatial::Pose& X_WT) const noexcept {
  if (!(received.origin.news_s > 0)) return 0;
  const Tangent told = received.tangent();
  const spatial::Pose X_WP{X_WT.R, X_WT.p - pad_W};
  const Tangent::Turned by = told.turned_to(X_WP);
  const double in_pad_m = glm::dot(transition.nhat_W - received.contact.nhat_ST_W, pad_W);
  return received.bent(in_use(transition.offset_W), X_WP, by).at.depth_m - received.bent(told, X_WP, by).at.depth_m -
         in_pad_m;
}

FeltContact::Sample FeltContact::sample(const spatial::Pose& X_WT) const noexcept {
  if (pad_W == glm::dvec3(0)) return sample_there(X_WT);
  Sample at = sample_there({X_WT.R, X_WT.p - pad_W});
  at.depth_m -= glm::dot(transition.nhat_W, pad_W);
  return at;
}

FeltContact::Sample FeltContact::sample_there(const spatial::Pose& X_WT) const noexcept {
  const glm::dvec3& offset_W = transition.offset_W;
  const Tangent tangent = in_use(offset_W);
  const Tangent::Turned by = tangent.turned_to(X_WT);
  ReceivedContact::Bent newest = received.bent(tangent, X_WT, by);
  Tangent::At& at = newest.at;
  if (!kept.is_empty() && offset_W == glm::dvec3(0)) {
    kept.join(at, X_WT);
  } else if (!kept.is_empty()) {
    // The offset is the whole contact's: it adds to the maximum what it adds to the newest, and chooses nothing.
    const Tangent::At aside = at;
    at = received.bent(in_use(glm::dvec3(0)), X_WT, by).at;
    const Tangent::At straight = at;
    kept.join(at, X_WT);
    at.depth_m += aside.depth_m - straight.depth_m;
    at.gradient += aside.gradient - straight.gradient;
    at.p_ToC_W += aside.p_ToC_W - straight.p_ToC_W;
  }
  return {.depth_m = at.depth_m, .gradient = at.gradient, .p_ToC_W = at.p_ToC_W, .bend_slope_W = newest.bend_slope_W};
}

spatial::Matrix6 FeltContact::bend_at(const spatial::Pose& X_WT) const noexcept {
  spatial::Matrix6 by_kept = spatial::Matrix6::Zero();
  const Tangent tangent = in_use(transition.offset_W);
  const Tangent::Turned by = tangent.turned_to(X_WT);
  if (!kept.is_empty() && !ablated(Mechanism::kKeptBend))
    by_kept = kept.bend_at(received.bent(in_use(glm::dvec3(0)), X_WT, by).at, X_WT);
  if (!received.is_bent()) return by_kept;
  return received.bend_at(tangent, X_WT, by) + by_kept;
}

void FeltContact::go_along(const spatial::Pose& way_W) noexcept {
  received = carried(received, way_W);
  for (glm::dvec3* v : {&transition.nhat_W, &transition.slope_W, &transition.offset_W, &friction.stretch_W})
    *v = spatial::rotate(way_W, *v);
  kept.go_along(way_W);
  seen.turn(way_W.R);
}

void FeltContact::keep(const FeltContact& older) noexcept {
  if (received.is_from_tiles() || older.received.is_from_tiles()) return;
  kept = older.kept;
  kept.keep(older.received.tangent(), received.tangent(), received.origin.news_s > 0);
}

}  // namespace farfeel::local_model
