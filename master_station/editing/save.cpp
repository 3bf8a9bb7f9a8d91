#include "master_station/editing/save.h"

#include <fmt/format.h>

#include <array>
#include <optional>

#include "transport/lane/lane_keys.h"

namespace farfeel::master_station {
namespace {

constexpr double kLook_s = 0.05;
constexpr std::int64_t kAskAgain_ns = 100'000'000, kAskLater_ns = 500'000'000;

}  // namespace

tl::expected<SavedScene, std::string> asked_scene(SideLink& link, double quiet_s,
                                                  const std::function<bool()>& is_stopped) {
  using codecs::SaveOutcome;
  const codecs::SaveRequest request{transport::random_identity()};
  std::array<std::byte, codecs::kMostEditBytes> payload;
  const std::size_t bytes = codecs::write(request, payload);
  const auto quiet_ns = static_cast<std::int64_t>(1e9 * quiet_s);
  std::optional<codecs::SaveAnswer> answer;
  std::string later;
  std::int64_t ask_ns = 0, moved_ns = transport::monotonic_ns();
  std::uint64_t here = 0;
  for (std::uint32_t session = link.client().session();;) {
    const std::int64_t now_ns = transport::monotonic_ns();
    if (is_stopped()) return tl::unexpected(std::string("stopped"));
    if (link.client().session() != session) {  // what was offered in the last one is not in this
      session = link.client().session();
      answer.reset();
    }
    if (!answer && now_ns >= ask_ns) {
      ask_ns = now_ns + kAskAgain_ns;
      link.send(transport::MessageType::kSaveRequest, std::span(payload).first(bytes));
    }
    link.look(kLook_s, [&](const transport::Message& message) {
      if (message.type != transport::MessageType::kSaveAnswer) return;
      auto read = codecs::read_save_answer(message.payload);
      if (!read || read->number != request.number) return;
      if (read->outcome == SaveOutcome::kLater) {
        ask_ns = transport::monotonic_ns() + kAskLater_ns;
        later = read->words;
      } else {
        answer = std::move(read);
      }
    });
    if (answer && answer->outcome == SaveOutcome::kRefused) return tl::unexpected(answer->words);
    const auto& saved = link.client().saved();
    if (answer && saved && saved->hash == answer->hash) return SavedScene{*answer, *saved};
    if (const std::uint64_t now_here = link.client().bytes_here(); now_here != here) {
      here = now_here;
      moved_ns = now_ns;
    }
    if (now_ns - moved_ns <= quiet_ns) continue;
    const std::string trouble = link.trouble();
    return tl::unexpected(fmt::format("{} within {:g} s{}",
                                      answer          ? "nothing more of the scene came"
                                      : later.empty() ? "the slave did not say how its scene is: it may be of an "
                                                        "older release, and nothing came"
                                                      : later + "; it did not come",
                                      quiet_s, trouble.empty() ? "" : "; " + trouble));
  }
}

}  // namespace farfeel::master_station
