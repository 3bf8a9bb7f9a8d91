// farfeel-bench: every measurement has one name, and one file that adds it.
#pragma once

namespace CLI {
class App;
}

namespace farfeel::bench {

// Each adds its subcommand. Figures go to standard output for a person; with --json, one object is the last line.
void add_ablation(CLI::App& bench);
void add_codec(CLI::App& bench);
void add_collision(CLI::App& bench);
void add_contact(CLI::App& bench);
void add_count(CLI::App& bench);
void add_penetration(CLI::App& bench);
void add_points(CLI::App& bench);
void add_gpu(CLI::App& bench);
void add_loop(CLI::App& bench);
void add_mechanisms(CLI::App& bench);
void add_session(CLI::App& bench);
void add_record_sessions(CLI::App& bench);
void add_stability(CLI::App& bench);
void add_tiles(CLI::App& bench);
void add_fresh(CLI::App& bench);
void add_view(CLI::App& bench);
void add_watches(CLI::App& bench);
void add_wire(CLI::App& bench);
void add_scene(CLI::App& bench);
void add_scene_apart(CLI::App& bench);
void add_device(CLI::App& bench);
void add_link(CLI::App& bench);
void add_bulk(CLI::App& bench);
void add_bake(CLI::App& bench);
void add_touch(CLI::App& bench);
void add_features(CLI::App& bench);
void add_figures(CLI::App& bench);
void add_hardcases_loop(CLI::App& hardcases);
void add_hardcases_contact(CLI::App& hardcases);

/// The whole command line: one of the above. Returns the exit code.
int run_command(int argc, char** argv);

}  // namespace farfeel::bench
