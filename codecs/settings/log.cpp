#include "codecs/settings/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>

namespace farfeel::codecs {

void log_as(const std::string& name) {
  const char* const no_color = std::getenv("NO_COLOR");
  const bool is_plain = no_color != nullptr && *no_color != '\0';
  spdlog::set_default_logger(
      spdlog::stderr_color_mt(name, is_plain ? spdlog::color_mode::never : spdlog::color_mode::automatic));
  spdlog::set_pattern("%H:%M:%S.%e %n: %^%v%$");
}

}  // namespace farfeel::codecs
