/// All subcommands, each registered by the file of its name.
#pragma once

#include <array>

namespace crepes {

class CommandLine;

void add_calibrate(CommandLine& line);
void add_check(CommandLine& line);
void add_codebook(CommandLine& line);
void add_completion(CommandLine& line);
void add_demo(CommandLine& line);
void add_devices(CommandLine& line);
void add_evaluate(CommandLine& line);
void add_exposure(CommandLine& line);
void add_import_calibration(CommandLine& line);
void add_init(CommandLine& line);
void add_keygen(CommandLine& line);
void add_led(CommandLine& line);
void add_plot(CommandLine& line);
void add_record(CommandLine& line);
void add_replay(CommandLine& line);
void add_setup_witmotion(CommandLine& line);
void add_sources(CommandLine& line);
void add_spots(CommandLine& line);
void add_status(CommandLine& line);
void add_waitpose(CommandLine& line);
void add_view(CommandLine& line);
void add_watch(CommandLine& line);

/// In the order of --help: running daemons, recordings, setup.
inline constexpr std::array kCommands{&add_status,
                                      &add_check,
                                      &add_watch,
                                      &add_view,
                                      &add_sources,
                                      &add_waitpose,
                                      &add_record,
                                      &add_replay,
                                      &add_evaluate,
                                      &add_plot,
                                      &add_spots,
                                      &add_demo,
                                      &add_devices,
                                      &add_init,
                                      &add_exposure,
                                      &add_calibrate,
                                      &add_import_calibration,
                                      &add_codebook,
                                      &add_led,
                                      &add_setup_witmotion,
                                      &add_keygen,
                                      &add_completion};

}  // namespace crepes
