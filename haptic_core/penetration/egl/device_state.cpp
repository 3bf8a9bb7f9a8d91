#include "haptic_core/penetration/egl/device_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <future>

namespace farfeel::penetration::egl {
namespace {

using headless_gl::Failure;

/// A real device's thread watches this long before it sleeps: at 1 kHz a frame never finds it asleep.
constexpr std::chrono::microseconds kWatch{2000}, kSoftwareWatch{20};
constexpr double kPatience_s = 5e-3, kSoftwarePatience_s = 10;
constexpr double kLost_s = 1, kSoftwareLost_s = 300;
constexpr int kMostEmpty = 3;
constexpr int kChecks = 64;  ///< dispatches between two looks at the context's health
constexpr std::uint32_t kGroup = 512, kSoftwareGroup = 128;

}  // namespace

tl::expected<void, Failure> Device::State::start() {
  std::promise<std::string> ready;
  auto failure = ready.get_future();
  thread_ = std::jthread([this, &ready](const std::stop_token& stop) {
    std::string what = open();
    const bool is_open = what.empty();
    ready.set_value(std::move(what));
    if (is_open) run(stop);
    context_.reset();
  });
  const std::string what = failure.get();
  if (!what.empty()) return tl::unexpected(Failure{what});
  return {};
}

bool Device::State::ask(const std::function<void()>& what) {
  std::promise<void> done;
  {
    const std::scoped_lock lock(mutex_);
    if (is_lost_) return false;
    asked_.push_back([&] { what(), done.set_value(); });
    has_asked_.store(true);
  }
  ring_bell();
  done.get_future().wait();
  return !is_lost_;
}

void Device::State::ring_bell() noexcept {
  bell_.fetch_add(1, std::memory_order_seq_cst);
  bell_.notify_one();
}

std::string Device::State::open() {
  const auto began = Clock::now();
  auto context =
      headless_gl::HeadlessContext::create({.major = 4, .minor = 5, .vendor = options_.vendor, .is_robust = true});
  if (!context) return context.error().message;
  context_.emplace(*std::move(context));
  if (const char* missing = gl_.load(*context_)) return fmt::format("{} lacks {}", context_->renderer(), missing);
  if (options_.amend) options_.amend(gl_);
  info_ = {.vendor = context_->vendor(),
           .renderer = context_->renderer(),
           .version = context_->version(),
           .platform = context_->platform(),
           .is_software = context_->is_software(),
           .group = options_.group != 0       ? std::bit_floor(std::clamp(options_.group, 64u, 1024u))
                    : context_->is_software() ? kSoftwareGroup
                                              : kGroup};
  if (options_.patience_s <= 0) options_.patience_s = info_.is_software ? kSoftwarePatience_s : kPatience_s;
  if (options_.lost_after_s <= 0) options_.lost_after_s = info_.is_software ? kSoftwareLost_s : kLost_s;
  if (options_.most_empty < 0) options_.most_empty = info_.is_software ? 0 : kMostEmpty;
  const auto with_name = [this](const std::string& what) {
    return what.empty() ? what : fmt::format("{}: {}", info_.renderer, what);
  };
  if (const std::string failure = programs_.compile(gl_, info_.group); !failure.empty()) return with_name(failure);
  const auto frames = static_cast<std::uint32_t>(frames_.size());
  if (const std::string failure = buffers_.create(gl_, frames); !failure.empty()) return with_name(failure);
  heights_ = std::make_unique<HeightStore>(gl_);
  for (auto& clocks : clocks_) gl_.CreateQueries(GL_TIMESTAMP, static_cast<GLsizei>(clocks.size()), clocks.data());
  for (std::uint32_t i = 0; i < frames; ++i) {
    Frame& frame = frames_[i];
    frame.first_word = kDirectoryWords + i * kWordsAFrame;
    frame.words = {buffers_.words + frame.first_word, kWordsAFrame};
    frame.first_result = i * kMostContactsAFrame;
    frame.results = {buffers_.results_at + std::size_t{frame.first_result} * kResultWords,
                     std::size_t{kMostContactsAFrame} * kResultWords};
    frame.tile_bytes.reserve(1u << 17);  // some eight tiles a frame
    frame.tile_copies.reserve(1u << 11);
  }
  // Both programs run once, on a contact without surfaces: drivers finish compiling only then.
  Frame& first = frames_.front();
  for (const bool wants_hessian : {false, true}) {
    std::fill_n(first.words.begin(), kHeaderWords, Word4{});
    first.words[2][3] = 1u | 1u << 16;
    first.used_words = kHeaderWords, first.contacts = 1, first.headers[0] = first.first_word;
    first.wants_hessian = wants_hessian;
    first.stamp = wants_hessian ? 2 : 1;
    first.state = Frame::kSubmitted;
    const auto submitted = Clock::now();
    while (first.state != Frame::kDone && first.state != Frame::kFailed && seconds_since(submitted) < 60) {
      dispatch_submitted();
      collect();
    }
    if (first.state != Frame::kDone || !first.has_result(0)) return with_name("the search does not run");
    first.state = Frame::kFree;
  }
  dispatches_ = answered_frames_ = contacts_ = 0;
  info_.warmup_ms = 1e3 * seconds_since(began);
  return {};
}

void Device::State::run(const std::stop_token& stop) {
  const auto watch = info_.is_software ? kSoftwareWatch : kWatch;
  auto last = Clock::now();
  while (!stop.stop_requested() && !is_lost_) {
    const std::uint32_t bell = bell_.load();
    const bool did_something = int{answer_asked()} + int{dispatch_submitted()} + int{collect()} > 0;
    if (did_something || !in_flight_.empty()) {
      last = Clock::now();
    } else if (Clock::now() - last > watch) {
      bell_.wait(bell);
    } else {
      pause();
    }
  }
  gl_.Finish();
  abandon();
}

bool Device::State::answer_asked() {
  if (!has_asked_) return false;
  std::vector<std::function<void()>> asked;
  {
    const std::scoped_lock lock(mutex_);
    asked.swap(asked_);
    has_asked_ = false;
  }
  for (const auto& what : asked) what();
  return !asked.empty();
}

void Device::State::upload_tiles(const Frame& frame) {
  for (const TileCopy& copy : frame.tile_copies) {
    gl_.NamedBufferSubData(copy.is_bounds ? heights_->bounds() : heights_->heights(), copy.to, copy.size,
                           frame.tile_bytes.data() + copy.from);
  }
}

bool Device::State::dispatch_submitted() {
  if (in_flight_.size() >= kDispatchesInFlight) return false;
  Dispatch dispatch{.place = next_place_, .fence = nullptr, .began = Clock::now()};
  const std::uint32_t first_entry = dispatch.place * kMostContactsADispatch;
  std::uint32_t contacts = 0;
  bool wants_hessian = false;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    Frame& frame = frames_[(next_frame_ + i) % frames_.size()];
    if (frame.state.load(std::memory_order_acquire) != Frame::kSubmitted) continue;
    if (contacts + frame.contacts > kMostContactsADispatch) continue;
    for (std::uint32_t k = 0; k < frame.contacts; ++k)
      buffers_.words[first_entry + contacts + k] = {frame.headers[k], frame.first_result + k, frame.stamp, 2};
    contacts += frame.contacts;
    wants_hessian = wants_hessian || frame.wants_hessian;
    frame.state.store(Frame::kInFlight, std::memory_order_relaxed);
    dispatch.frames[dispatch.count++] = &frame;
  }
  if (dispatch.count == 0) return false;
  ++next_frame_;
  next_place_ = (next_place_ + 1) % kDispatchesInFlight;

  const auto& clocks = clocks_[dispatch.place];
  const auto tick = [&](std::size_t which) {
    if (options_.is_timed) gl_.QueryCounter(clocks[which], GL_TIMESTAMP);
  };
  const auto copy = [this](std::uint32_t first, std::uint32_t count) {
    gl_.CopyNamedBufferSubData(buffers_.staging, buffers_.frame, GLintptr{16} * first, GLintptr{16} * first,
                               GLsizeiptr{16} * count);
  };
  tick(0);
  copy(first_entry, contacts);
  for (std::size_t i = 0; i < dispatch.count; ++i) {
    upload_tiles(*dispatch.frames[i]);
    copy(dispatch.frames[i]->first_word, dispatch.frames[i]->used_words);
  }
  gl_.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);  // the last dispatch's workspace is this one's, too
  tick(1);
  const Program& program = wants_hessian ? programs_.with_hessian : programs_.plain;
  gl_.UseProgram(program.name);
  gl_.ProgramUniform1ui(program.name, program.directory, first_entry);
  gl_.DispatchCompute(contacts, 1, 1);
  gl_.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
  tick(2);
  dispatch.fence = gl_.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl_.Flush();
  dispatches_.fetch_add(1, std::memory_order_relaxed);
  contacts_.fetch_add(contacts, std::memory_order_relaxed);
  in_flight_.push_back(dispatch);
  return true;
}

bool Device::State::collect() {
  if (in_flight_.empty()) return false;
  Dispatch& oldest = in_flight_.front();
  // A software device needs this processor: the thread sleeps in the driver meanwhile, but not past new arrivals.
  const GLuint64 patience_ns = info_.is_software ? 200'000 : 0;
  const GLenum status = oldest.fence ? gl_.ClientWaitSync(oldest.fence, 0, patience_ns) : GL_WAIT_FAILED;
  if (status == GL_TIMEOUT_EXPIRED) {
    if (seconds_since(oldest.began) > options_.lost_after_s) lose("it did not finish a dispatch");
    return false;
  }
  if (status == GL_WAIT_FAILED) {
    lose("its fence failed");
    return true;
  }
  bool is_whole = true;
  for (std::size_t i = 0; i < oldest.count; ++i) {
    for (std::uint32_t k = 0; k < oldest.frames[i]->contacts; ++k)
      is_whole = is_whole && oldest.frames[i]->has_result(k);
  }
  empty_answers_ = is_whole ? 0 : empty_answers_ + 1;
  if ((!is_whole || ++unchecked_ >= kChecks) && !is_healthy()) return true;
  if (options_.most_empty > 0 && empty_answers_ >= options_.most_empty) {
    lose("it finishes dispatches without an answer");
    return true;
  }
  finish(oldest, Frame::kDone);  // each contact is looked at by its owner
  in_flight_.pop_front();
  return true;
}

bool Device::State::is_healthy() {
  unchecked_ = 0;
  if (const GLenum reset = gl_.GetGraphicsResetStatus(); reset != GL_NO_ERROR) {
    lose(fmt::format("its context was reset (0x{:x})", reset));
    return false;
  }
  if (const GLenum error = gl_.GetError(); error != GL_NO_ERROR) {
    lose(fmt::format("it reported the error 0x{:x}", error));
    return false;
  }
  return true;
}

void Device::State::finish(Dispatch& dispatch, Frame::State state) {
  FrameTimes times;
  if (options_.is_timed && state == Frame::kDone) {
    std::array<GLuint64, 3> ns{};
    for (std::size_t i = 0; i < ns.size(); ++i)
      gl_.GetQueryObjectui64v(clocks_[dispatch.place][i], GL_QUERY_RESULT, &ns[i]);
    times.upload_us = 1e-3 * static_cast<double>(ns[1] - ns[0]);
    times.dispatch_us = 1e-3 * static_cast<double>(ns[2] - ns[1]);
  }
  if (dispatch.fence) gl_.DeleteSync(dispatch.fence);
  dispatch.fence = nullptr;
  answered_frames_.fetch_add(dispatch.count, std::memory_order_relaxed);
  for (std::size_t i = 0; i < dispatch.count; ++i) {
    dispatch.frames[i]->times = times;
    dispatch.frames[i]->state.store(state, std::memory_order_release);
  }
}

void Device::State::lose(const std::string& why) {
  abandon();
  if (options_.on_loss) options_.on_loss(why);
}

/// Everybody who waits is told; later frames are refused by wait().
void Device::State::abandon() {
  is_lost_ = true;
  for (Dispatch& dispatch : in_flight_) finish(dispatch, Frame::kFailed);
  in_flight_.clear();
  for (Frame& frame : frames_) {
    std::uint32_t submitted = Frame::kSubmitted;
    frame.state.compare_exchange_strong(submitted, Frame::kFailed);
  }
  {
    const std::scoped_lock lock(mutex_);
    for (const auto& what : asked_) what();  // harmless: GL calls on a lost context do nothing
    asked_.clear();
  }
}

}  // namespace farfeel::penetration::egl
