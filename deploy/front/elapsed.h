// What is said while something takes long and says little by itself.
#pragma once

#include <sys/types.h>

#include <string>

namespace farfeel::front {

/// Says on standard error how long this program has been at it: a line every 8 s in a log, on a terminal a few letters
/// that the next line covers. A process of its own does that, so that it goes on when this program becomes another by
/// exec.
class Elapsed {
 public:
  explicit Elapsed(const std::string& what);  ///< "building farfeel-bench"; where it can't begin, nothing is said
  Elapsed(const Elapsed&) = delete;
  Elapsed& operator=(const Elapsed&) = delete;
  ~Elapsed();  ///< ends it; it ends with this program, too

 private:
  pid_t pid_ = -1;
};

}  // namespace farfeel::front
