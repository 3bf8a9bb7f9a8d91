// Runs LLVMFuzzerTestOneInput without libFuzzer: every file of the seed corpus, then mutated copies of each, made from
// a fixed seed, so that every compiler and every preset exercises the decoders on the same hostile bytes.
//
//   NAME [--mutations N] [--seed N] [FILE or FOLDER ...]
//
// An input that kills the program is left as crash-input in the current folder, and is run alone by naming it.

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);
// Optional, as in libFuzzer.
extern "C" __attribute__((weak)) int LLVMFuzzerInitialize(int* argc, char*** argv);
// There only in a sanitized build.
extern "C" __attribute__((weak)) void __sanitizer_set_death_callback(void (*callback)());

namespace {

using Input = std::vector<std::uint8_t>;

constexpr std::size_t kInputBytesMax = std::size_t{1} << 20;  // as libFuzzer's default, far above any datagram

const Input* running = nullptr;  // what a crash is blamed on

// Called as the program dies, so with system calls' thinnest wrappers only.
void keep_input() {
  if (running == nullptr) return;
  if (std::FILE* file = std::fopen("crash-input", "wb")) {
    std::fwrite(running->data(), 1, running->size(), file);
    std::fclose(file);
    std::fputs("the input that did this is kept as crash-input\n", stderr);
  }
  running = nullptr;
}

void on_signal(int signal) {
  keep_input();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(const Input& input) {
  // A copy of exactly the input's size on the heap, so that a sanitizer sees a read one byte past its end.
  const Input exact(input.begin(), input.end());
  running = &exact;
  LLVMFuzzerTestOneInput(exact.data(), exact.size());
  running = nullptr;
}

// One of libFuzzer's elementary mutations. What decoders trip over: lengths and counts that lie, so boundary values in
// every width; records cut short, grown, repeated or joined with another's tail.
void mutate(Input& input, const Input& other, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const auto place = [&](std::uint64_t value, std::size_t width) {
    if (input.size() >= width) std::memcpy(input.data() + below(input.size() - width + 1), &value, width);
  };
  constexpr std::uint64_t kBoundaries[] = {0,          1,          0x7f,       0x80,       0xff,
                                           0x7fff,     0x8000,     0xffff,     0x7fffffff, 0x80000000,
                                           0x7f800000, 0x7fc00000, 0xffffffff, ~0ULL,      0x7ff8000000000000ULL};
  switch (below(9)) {
    case 0:
      if (!input.empty()) input[below(input.size())] ^= static_cast<std::uint8_t>(1U << below(8));
      break;
    case 1:
      if (!input.empty()) input[below(input.size())] = static_cast<std::uint8_t>(random());
      break;
    case 2:
      place(kBoundaries[below(std::size(kBoundaries))], std::size_t{1} << below(4));
      break;
    case 3:
      place(random(), std::size_t{1} << below(4));
      break;
    case 4:
      input.resize(below(input.size() + 1));
      break;
    case 5:
      for (std::size_t extra = 1 + below(16); extra > 0; --extra) input.push_back(static_cast<std::uint8_t>(random()));
      break;
    case 6:
      if (!input.empty()) input.erase(input.begin() + static_cast<std::ptrdiff_t>(below(input.size())));
      break;
    case 7:
      if (!input.empty()) {
        const std::size_t begin = below(input.size());
        const Input piece(input.begin() + static_cast<std::ptrdiff_t>(begin),
                          input.begin() + static_cast<std::ptrdiff_t>(begin + 1 + below(input.size() - begin)));
        input.insert(input.begin() + static_cast<std::ptrdiff_t>(below(input.size() + 1)), piece.begin(), piece.end());
      }
      break;
    default:
      if (!other.empty()) {
        input.resize(below(input.size() + 1));
        input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(below(other.size())), other.end());
      }
  }
  if (input.size() > kInputBytesMax) input.resize(kInputBytesMax);
}

bool read_into(std::vector<Input>& inputs, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return false;
  inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  return true;
}

// Seeds in the order of their names: a folder's own order differs from machine to machine.
bool read_seeds(std::vector<Input>& inputs, const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return read_into(inputs, path);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& file : files)
    if (!read_into(inputs, file)) return false;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (LLVMFuzzerInitialize != nullptr) LLVMFuzzerInitialize(&argc, &argv);
  std::size_t mutations = 0;
  std::uint64_t seed = 1;
  std::vector<Input> inputs;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--mutations" && i + 1 < argc) {
      mutations = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--seed" && i + 1 < argc) {
      seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (!read_seeds(inputs, argument)) {
      std::fprintf(stderr, "cannot read the input %s: name a file or a folder of files\n", argv[i]);
      return 2;
    }
  }

  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(keep_input);
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL})
    if (__sanitizer_set_death_callback == nullptr || signal == SIGABRT) std::signal(signal, on_signal);

  const std::size_t seeds = inputs.size();
  for (const Input& input : inputs) run(input);
  run({});
  inputs.emplace_back();  // mutations start from nothing too

  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < mutations; ++i) {
    Input input = inputs[random() % inputs.size()];
    const Input& other = inputs[random() % inputs.size()];
    for (std::size_t steps = 1 + random() % 4; steps > 0; --steps) mutate(input, other, random);
    run(input);
  }
  std::printf("%zu seeds and %zu mutated inputs (seed %llu): no crash\n", seeds, mutations,
              static_cast<unsigned long long>(seed));
  return 0;
}
