// Independent pieces of work, shared out to every core.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace farfeel::bench {

/// Calls work(i) once for every i below count; returns when all are done.
template <typename Work>
void on_all_cores(std::size_t count, Work&& work) {
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t) {
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    });
  }
}

}  // namespace farfeel::bench
