// Where requests to change the scene wait for who makes the changes, and answers for the io thread. Any thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "codecs/wire/edit_messages.h"
#include "transport/seal/suite.h"

namespace farfeel::slave_sim {

/// A request, and whose it is.
struct EditQuestion {
  transport::Key32 key{};
  std::string name;  ///< of the key, in the list of operators
  std::uint32_t session = 0;
  codecs::EditRequest request;
};

class EditDesk {
 public:
  /// False where too many wait: who asks will ask again.
  bool ask(EditQuestion question) {
    const std::lock_guard lock(mutex_);
    if (questions_.size() >= kMostWaiting) return false;
    questions_.push_back(std::move(question));
    came_.notify_one();
    return true;
  }
  /// The next question, waited for so long.
  std::optional<EditQuestion> next(std::chrono::nanoseconds patience) {
    std::unique_lock lock(mutex_);
    if (!came_.wait_for(lock, patience, [this] { return !questions_.empty(); })) return std::nullopt;
    EditQuestion first = std::move(questions_.front());
    questions_.pop_front();
    return first;
  }

  struct Answered {
    std::uint32_t session = 0;
    codecs::EditAnswer answer;
  };
  void answer(std::uint32_t session, codecs::EditAnswer answer) {
    const std::lock_guard lock(mutex_);
    answers_.push_back({session, std::move(answer)});
  }
  std::vector<Answered> take_answers() {
    const std::lock_guard lock(mutex_);
    return std::exchange(answers_, {});
  }
  void set_news(codecs::SceneNews news) {
    const std::lock_guard lock(mutex_);
    news_ = std::move(news);
  }
  codecs::SceneNews news() {
    const std::lock_guard lock(mutex_);
    return news_;
  }

 private:
  static constexpr std::size_t kMostWaiting = 64;

  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<EditQuestion> questions_;
  std::vector<Answered> answers_;
  codecs::SceneNews news_;
};

}  // namespace farfeel::slave_sim
