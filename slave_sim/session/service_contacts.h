// The contact service as a session's source of contacts.
#pragma once

#include "slave_sim/session/contact_source.h"

namespace farfeel::slave_sim {

/// The service must outlive it, and what it looks at: `surfaces`, where they may be edited.
class ServiceContacts final : public ContactSource {
 public:
  explicit ServiceContacts(contact_service::ContactService& service, EditableSurfaces* surfaces = nullptr)
      : service_(service), surfaces_(surfaces) {}
  [[nodiscard]] const contact_service::Answer& answer(const contact_service::ToolPose& pose) noexcept override {
    return service_.answer(pose);
  }
  void edit(const SurfaceEdit& edit) noexcept override {
    if (surfaces_) surfaces_->apply(edit);
  }
  void set_out(const motion::ObjectCourse& told) noexcept override { service_.set_out(told); }
  void restart() noexcept override { service_.restart(); }

 private:
  contact_service::ContactService& service_;
  EditableSurfaces* surfaces_;
};

}  // namespace farfeel::slave_sim
