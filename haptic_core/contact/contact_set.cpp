#include "haptic_core/contact/contact_set.h"

#include "haptic_core/contact/depth/contact_frame.h"

namespace farfeel::contact {

Contact carried(Contact contact, const spatial::Pose& way_W) noexcept {
  contact.p_WC_W = spatial::transform_point(way_W, contact.p_WC_W);
  contact.nhat_ST_W = spatial::rotate(way_W, contact.nhat_ST_W);
  const spatial::Twist gradient = spatial::twist_from(contact.gradient);  // the two halves, by name
  contact.gradient = spatial::to_vector6(
      spatial::Twist{spatial::rotate(way_W, gradient.angular_rad_s), spatial::rotate(way_W, gradient.linear_m_s)});
  if (contact.curvature.is_known) contact.curvature = Curvature::of(turned(contact.curvature.matrix(), way_W.R));
  return contact;
}

}  // namespace farfeel::contact
