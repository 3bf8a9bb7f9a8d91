#include "tests/bench/bench.h"

int main(int argc, char** argv) {
  return farfeel::bench::run_command(argc, argv);
}
