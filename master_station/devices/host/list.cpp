#include <fmt/format.h>

#include "master_station/devices/host/commands.h"

namespace farfeel::devices {

int list(const Hardware& hardware, ListForm form) {
  const std::vector<ListedDevice> all = listed_devices(hardware.families, hardware.options, hardware.lookup);
  switch (form) {
    case ListForm::kForPerson:
      fmt::print("{}", list_for_person(all, hardware.families));
      break;
    case ListForm::kJson:
      fmt::print("{}", list_as_json(all, hardware.families));
      break;
    case ListForm::kForStation:
      fmt::print("{}", list_for_station(all));
      break;
  }
  return 0;
}

}  // namespace farfeel::devices
