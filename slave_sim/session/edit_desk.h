// Where requests of side sessions wait for who changes the scene, and answers for the io thread. Any thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "codecs/wire/edit_messages.h"
#include "transport/bulk/object.h"
#include "transport/seal/suite.h"

namespace farfeel::slave_sim {

/// A request, and whose it is.
struct EditQuestion {
  transport::Key32 key{};
  std::string name;  ///< of the key, in the list of operators
  std::uint32_t session = 0;
  codecs::EditRequest request;
};

/// Who asks for the scene as it is now.
struct SaveQuestion {
  std::string name;  ///< of the key, in the list of operators
  std::uint32_t session = 0;
  std::uint64_t number = 0;  ///< of the request
};
/// object: what is offered; null unless the answer says so.
struct Saved {
  codecs::SaveAnswer answer;
  std::shared_ptr<const transport::Object> object;
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
  /// Of a session one waits at most: the newest.
  void ask(SaveQuestion question) {
    const std::lock_guard lock(mutex_);
    std::erase_if(saves_, [&](const SaveQuestion& waiting) { return waiting.session == question.session; });
    if (saves_.size() >= kMostWaiting) return;
    saves_.push_back(std::move(question));
    came_.notify_one();
  }
  /// The next question, waited for so long, or until somebody asks for the scene.
  std::optional<EditQuestion> next(std::chrono::nanoseconds patience) {
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, patience, [this] { return !questions_.empty() || !saves_.empty(); });
    if (questions_.empty()) return std::nullopt;
    EditQuestion first = std::move(questions_.front());
    questions_.pop_front();
    return first;
  }

  std::optional<SaveQuestion> next_save() {
    const std::lock_guard lock(mutex_);
    if (saves_.empty()) return std::nullopt;
    SaveQuestion first = std::move(saves_.front());
    saves_.pop_front();
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
  struct SaveAnswered {
    std::uint32_t session = 0;
    Saved saved;
  };
  void answer(std::uint32_t session, Saved saved) {
    const std::lock_guard lock(mutex_);
    save_answers_.push_back({session, std::move(saved)});
  }
  std::vector<SaveAnswered> take_save_answers() {
    const std::lock_guard lock(mutex_);
    return std::exchange(save_answers_, {});
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
  std::deque<SaveQuestion> saves_;
  std::vector<SaveAnswered> save_answers_;
  codecs::SceneNews news_;
};

}  // namespace farfeel::slave_sim
