#include <CLI/CLI.hpp>

#include "tests/bench/bench.h"

int main(int argc, char** argv) {
  CLI::App bench("farfeel-bench: every measurement of Farfeel, one name each", "farfeel-bench");
  bench.require_subcommand(1);
  farfeel::bench::add_collision(bench);
  farfeel::bench::add_contact(bench);
  farfeel::bench::add_penetration(bench);
  farfeel::bench::add_points(bench);
  farfeel::bench::add_gpu(bench);
  farfeel::bench::add_bake(bench);
  farfeel::bench::add_loop(bench);
  farfeel::bench::add_session(bench);
  farfeel::bench::add_stability(bench);
  farfeel::bench::add_tiles(bench);
  farfeel::bench::add_touch(bench);
  farfeel::bench::add_fresh(bench);
  farfeel::bench::add_wire(bench);
  farfeel::bench::add_scene_apart(bench);
  farfeel::bench::add_device(bench);
  farfeel::bench::add_link(bench);
  farfeel::bench::add_bulk(bench);
  farfeel::bench::add_features(bench);
  farfeel::bench::add_figures(bench);
  CLI::App* hardcases = bench.add_subcommand("hardcases", "Situations that break haptic rendering, with verdicts");
  hardcases->require_subcommand(1);
  farfeel::bench::add_hardcases_loop(*hardcases);
  farfeel::bench::add_hardcases_contact(*hardcases);
  CLI11_PARSE(bench, argc, argv);
}
