#include "slave_sim/bake/progress_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <system_error>

#include "slave_sim/bake/progress_words.h"

namespace farfeel::slave_sim {

ProgressLine::ProgressLine(Out out)
    : out_(std::move(out)), is_terminal_(out_.is_terminal.value_or(::isatty(::fileno(out_.to)) != 0)) {
  try {
    again_ = std::jthread([this](const std::stop_token& is_over) { watch(is_over); });
  } catch (const std::system_error&) {  // no thread is to be had: stages are told as they begin
  }
}

ProgressLine::~ProgressLine() {
  clear();
}

void ProgressLine::show(const std::string& stage, std::optional<double> done) {
  const std::scoped_lock lock(mutex_);
  stage_ = stage;
  done_ = done;
  if (is_terminal_ || Clock::now() - told_ >= kStage) print(false);
}

void ProgressLine::clear() {
  const std::scoped_lock lock(mutex_);
  if (is_terminal_ && !stage_.empty()) fmt::print(out_.to, "\r\033[K"), std::fflush(out_.to);
  stage_.clear();
}

std::string ProgressLine::words(bool with_time) const {
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - started_).count();
  const std::string stage = done_ ? progress_words(stage_, *done_, elapsed_s) : stage_;
  return with_time ? fmt::format("{}, {:.0f} s so far", stage, elapsed_s) : stage;
}

void ProgressLine::print(bool with_time) {
  told_ = Clock::now();
  if (is_terminal_) {
    fmt::print(out_.to, "\r\033[K{}", words(with_time));
  } else if (out_.log) {
    return out_.log(words(with_time));
  } else {
    fmt::print(out_.to, "  {}\n", words(with_time));
  }
  std::fflush(out_.to);
}

void ProgressLine::watch(const std::stop_token& is_over) {
  const std::chrono::milliseconds again =
      is_terminal_ ? std::min(out_.again, std::chrono::milliseconds(kRedrawn)) : out_.again;
  std::unique_lock lock(mutex_);
  while (!is_over.stop_requested()) {
    never_.wait_until(lock, is_over, told_ + again, [] { return false; });
    if (is_over.stop_requested()) return;
    if (Clock::now() - told_ < again) continue;
    if (stage_.empty())
      told_ = Clock::now();
    else
      print(true);
  }
}

}  // namespace farfeel::slave_sim
