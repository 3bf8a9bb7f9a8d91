#include <CLI/CLI.hpp>

#include "codecs/settings/command_line.h"
#include "tests/bench/bench.h"

namespace farfeel::bench {

int run_command(int argc, char** argv) {
  CLI::App bench("farfeel-bench: every measurement of Farfeel, one name each", "farfeel-bench");
  bench.require_subcommand(1);
  add_ablation(bench);
  add_collision(bench);
  add_contact(bench);
  add_count(bench);
  add_penetration(bench);
  add_points(bench);
  add_gpu(bench);
  add_bake(bench);
  add_codec(bench);
  add_loop(bench);
  add_mechanisms(bench);
  add_session(bench);
  add_record_sessions(bench);
  add_stability(bench);
  add_tiles(bench);
  add_touch(bench);
  add_fresh(bench);
  add_view(bench);
  add_watches(bench);
  add_wire(bench);
  add_scene(bench);
  add_scene_apart(bench);
  add_device(bench);
  add_link(bench);
  add_bulk(bench);
  add_features(bench);
  add_figures(bench);
  CLI::App* hardcases = bench.add_subcommand("hardcases", "Situations that break haptic rendering, with verdicts");
  hardcases->require_subcommand(1);
  add_hardcases_loop(*hardcases);
  add_hardcases_contact(*hardcases);
  return codecs::parse_command_line(bench, argc, argv).value_or(0);
}

}  // namespace farfeel::bench
