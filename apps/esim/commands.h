#pragma once

#include <CLI/CLI.hpp>

namespace esim::app {

/// The exit codes of subcommands.
enum ExitCode : int { kOk = 0, kOurFault = 1, kUsersFault = 2, kInterrupted = 130 };

// Each function adds its subcommand to `app`. The subcommand that runs sets `exit_code`.
void add_simulate(CLI::App& app, int& exit_code);
void add_resense(CLI::App& app, int& exit_code);
void add_serve(CLI::App& app, int& exit_code);
void add_sweep(CLI::App& app, int& exit_code);
void add_video(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_dataset(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_filter(CLI::App& app, int& exit_code);
void add_import(CLI::App& app, int& exit_code);
void add_info(CLI::App& app, int& exit_code);
void add_play(CLI::App& app, int& exit_code);
void add_stats(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_characterise(CLI::App& app, int& exit_code);
void add_fit(CLI::App& app, int& exit_code);
void add_studio(CLI::App& app, int& exit_code);
void add_evaluate(CLI::App& app, int& exit_code);
void add_realism(CLI::App& evaluate, int& exit_code);
void add_scenes(CLI::App& app, int& exit_code);
void add_docs(CLI::App& app, int& exit_code);
void add_options(CLI::App& app, int& exit_code);

/// Adds the commands of earlier versions, which name their successors.
void add_removed(CLI::App& app);

}  // namespace esim::app
