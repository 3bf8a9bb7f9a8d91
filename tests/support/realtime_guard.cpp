#include "tests/support/realtime_guard.h"

#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <cstddef>

namespace farfeel::test_support {
namespace {

// Static thread-local storage of the program itself: touching it allocates nothing.
thread_local int guarded_scopes = 0;
thread_local std::uint64_t violation_count = 0;
thread_local const char* first_name = "";

}  // namespace

RealtimeGuard::RealtimeGuard() noexcept {
  ++guarded_scopes;
}
RealtimeGuard::~RealtimeGuard() {
  --guarded_scopes;
}
std::uint64_t RealtimeGuard::violations() noexcept {
  return violation_count;
}
std::string_view RealtimeGuard::first_violation() noexcept {
  return first_name;
}

#ifdef FARFEEL_SANITIZED

bool RealtimeGuard::is_available() noexcept {
  return false;
}
}  // namespace farfeel::test_support

#else

bool RealtimeGuard::is_available() noexcept {
  return true;
}

static void note(const char* name) {
  if (guarded_scopes == 0) return;
  if (violation_count++ == 0) first_name = name;
}

/// The next definition after ours, in libc or libstdc++.
template <typename Function>
static Function real(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace farfeel::test_support

using farfeel::test_support::note;
using farfeel::test_support::real;

extern "C" {

// glibc's own names for its allocator: dlsym() would itself call calloc().
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  note("malloc");
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note("calloc");
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  note("realloc");
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note("memalign");
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note("aligned_alloc");
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  note("posix_memalign");
  *block = __libc_memalign(alignment, size);
  return *block != nullptr ? 0 : ENOMEM;
}
void free(void* block) {
  if (block != nullptr) note("free");
  __libc_free(block);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static const auto next = real<int (*)(pthread_mutex_t*)>("pthread_mutex_lock");
  note("pthread_mutex_lock");
  return next(mutex);
}

void* __cxa_allocate_exception(std::size_t size) {
  static const auto next = real<void* (*)(std::size_t)>("__cxa_allocate_exception");
  note("__cxa_allocate_exception");
  return next(size);
}

}  // extern "C"

#endif
