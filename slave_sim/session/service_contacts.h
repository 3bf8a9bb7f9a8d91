// The contact service as a session's source of contacts.
#pragma once

#include "slave_sim/session/contact_source.h"

namespace farfeel::slave_sim {

/// The service must outlive it.
class ServiceContacts final : public ContactSource {
 public:
  explicit ServiceContacts(contact_service::ContactService& service) : service_(service) {}
  [[nodiscard]] const contact::ContactSet& answer(const contact_service::ToolPose& pose) noexcept override {
    return service_.answer(pose);
  }
  void restart() noexcept override { service_.restart(); }

 private:
  contact_service::ContactService& service_;
};

}  // namespace farfeel::slave_sim
