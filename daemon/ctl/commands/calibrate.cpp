#include <filesystem>
#include <utility>

#include "daemon/ctl/calibrate/calibrate_camera.hpp"
#include "daemon/ctl/calibrate/calibrate_grid.hpp"
#include "daemon/ctl/calibrate/calibrate_imu.hpp"
#include "daemon/ctl/calibrate/calibrate_range.hpp"
#include "daemon/ctl/calibrate/calibrate_swarm.hpp"
#include "daemon/ctl/calibrate/record_for_camera.hpp"
#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/dataset/record.hpp"

namespace crepes {
namespace {

/// Prints the report. Rows that were skipped and the reasons of a refusal go to standard error, one
/// a line. With `json` there is one object on standard output, whatever happens.
Result<void> finish(const Result<CalibrationReport>& report, bool json) {
  if (!report) {
    if (json)
      if (auto printed = print_result(failed_report(report.error())); !printed) return printed;
    return tl::unexpected(report.error());
  }
  print_skipped(report->faults);
  if (auto printed = print_result(report->text); !printed) return printed;
  if (report->reasons.empty()) return {};
  std::string message;
  for (const std::string& reason : report->reasons)
    message += (message.empty() ? "" : "\n") + reason;
  return fail(ErrorCode::kFormat, message);
}

struct CameraCommand {
  CalibrateCameraOptions options;
  std::string model = "ds";
  bool live = false;
  std::filesystem::path socket = RecordOptions{}.socket;
  std::string grid;  ///< empty: boards are the target
  double pitch_m = 0.0;
};

Result<CalibrationReport> calibrate_grid_with_progress(const CameraCommand& command) {
  const auto grid = parse_grid(command.grid, command.pitch_m);
  if (!grid) return tl::unexpected(grid.error());
  if (command.live)
    return fail(ErrorCode::kUsage, "--live: pictures of a grid are not recorded live");
  const TerminalProgress progress;
  return calibrate_grid({.pictures = command.options.robot_dir,
                         .out = command.options.out,
                         .grid = *grid,
                         .fov_deg = command.options.fov_deg,
                         .kannala_brandt = command.model == "kb",
                         .force = command.options.force,
                         .json = command.options.json,
                         .on_progress = progress.sink()});
}

Result<CalibrationReport> calibrate_camera_with_progress(const CameraCommand& command) {
  if (command.model != "ds" && command.model != "kb")
    return fail(ErrorCode::kUsage, "--model: '" + command.model + "' is none; ds or kb");
  if (!command.grid.empty()) return calibrate_grid_with_progress(command);
  CalibrateCameraOptions options = command.options;
  options.kannala_brandt = command.model == "kb";
  if (command.live) {
    if (const auto free = check_results({options.out}, "camera", options.force); !free)
      return tl::unexpected(free.error());
    auto folder = record_for_camera(
        {.dir = options.robot_dir, .socket = command.socket, .is_quiet = options.json});
    if (!folder) return tl::unexpected(folder.error());
    options.robot_dir = std::move(*folder);
  }
  const TerminalProgress progress;
  options.on_progress = progress.sink();
  return calibrate_camera(options);
}

void add_force_flag(CLI::App* sub, bool& force) {
  sub->add_flag("--force", force, "replace files that are no earlier results of this command");
}

/// Runs `calibrate` with a bar on the terminal.
template <class Options, class Calibrate>
Result<CalibrationReport> with_progress(Options options, const Calibrate& calibrate) {
  const TerminalProgress progress;
  options.on_progress = progress.sink();
  return calibrate(options);
}

void add_imu(CommandLine& line, CLI::App* calibrate) {
  auto& options = line.make<CalibrateImuOptions>();
  CLI::App* sub = calibrate->add_subcommand(
      "imu",
      "Accelerometer and gyroscope: bias, scale and axes, from 30 to 50 attitudes at rest; or "
      "their noise, from an hour at rest");
  sub->add_option("ROBOT_DIR", options.robot_dir, "the robot's folder of a recording")->required();
  sub->add_option("--out", options.out,
                  "fragment of crepesd.yaml; Kalibr's imu.yaml is written beside it as "
                  "NAME.kalibr.yaml")
      ->required();
  sub->add_flag("--rest", options.rest,
                "the robot lay still for an hour: noise densities and random walks");
  sub->add_option("--gravity", options.gravity_mps2, "gravity at this place [m/s^2]")
      ->capture_default_str()
      ->check(CLI::Range(9.7, 9.9));
  add_force_flag(sub, options.force);
  add_json_flag(sub, options.json);
  line.run(sub, [&options] {
    return finish(with_progress(options, [](const auto& o) { return calibrate_imu(o); }),
                  options.json);
  });
}

void add_range(CommandLine& line, CLI::App* calibrate) {
  auto& options = line.make<CalibrateRangeOptions>();
  CLI::App* sub = calibrate->add_subcommand(
      "range", "Antenna delays of pairs and modules, from robots at rest at taped distances");
  sub->add_option("SWARM_DIR", options.swarm_dir, "the recording of all robots")->required();
  sub->add_option("--tape", options.tape,
                  "segments: [{from_s, to_s, pairs: [{ids: [1, 2], distance_m: 5.00}]}]; seconds "
                  "after the first row, distances from antenna to antenna; with turning: ID in a "
                  "segment that robot turned slowly about its antenna");
  sub->add_option(
         "--distance", options.distances,
         "ROBOT,ROBOT=METERS, as in r1,r2=5.00: both rested for the whole recording; may be "
         "repeated")
      ->allow_extra_args(false);
  sub->add_option("--out", options.out,
                  "biases of pairs and modules, YAML; a fragment of crepesd.yaml with delays and "
                  "noise is written beside it as NAME.members.yaml")
      ->required();
  add_force_flag(sub, options.force);
  add_json_flag(sub, options.json);
  line.run(sub, [&options] {
    return finish(with_progress(options, [](const auto& o) { return calibrate_range(o); }),
                  options.json);
  });
}

void add_camera(CommandLine& line, CLI::App* calibrate) {
  auto& command = line.make<CameraCommand>();
  CalibrateCameraOptions& options = command.options;
  CLI::App* sub = calibrate->add_subcommand(
      "camera",
      "Lens, mounting and time shift of the first camera: one to four LED boards at rest, 2 to 5 m "
      "away, and the robot turned by hand for a minute");
  sub->add_option("ROBOT_DIR", options.robot_dir,
                  "the robot's folder of a recording; with --live a new directory for one; with "
                  "--grid also a folder of pictures")
      ->required();
  sub->add_option("--out", options.out, "camchain-imucam.yaml of Kalibr")->required();
  sub->add_flag("--live", command.live,
                "first record the running daemon, showing which parts of the picture and which "
                "turns are missing, until there is enough or q is pressed");
  sub->add_option("--socket", command.socket, "with --live: the daemon's recording.socket")
      ->capture_default_str();
  sub->add_option("--fov", options.fov_deg,
                  "the lens's rough field of view [deg]; default: start from the lens in "
                  "crepesd.yaml")
      ->check(CLI::Range(60.0, 220.0));
  sub->add_option("--model", command.model,
                  "ds: Double Sphere; kb: Kannala-Brandt, Kalibr's pinhole with equidistant "
                  "distortion")
      ->capture_default_str();
  CLI::Option* grid = sub->add_option(
      "--grid", command.grid,
      "the target is a flat grid of LEDs, rows x columns as in 5x7; ROBOT_DIR may be any folder of "
      "pictures, whose lens is calibrated; a robot's folder with a film and imu0 also gives the "
      "mounting and the time shift");
  CLI::Option* pitch =
      sub->add_option("--pitch", command.pitch_m, "with --grid: from LED to LED [m]")
          ->check(CLI::Range(0.001, 10.0));
  pitch->needs(grid);
  grid->needs(pitch);
  add_force_flag(sub, options.force);
  add_json_flag(sub, options.json);
  line.run(sub, [&command] {
    return finish(calibrate_camera_with_progress(command), command.options.json);
  });
}

void add_swarm(CommandLine& line, CLI::App* calibrate) {
  auto& options = line.make<CalibrateSwarmOptions>();
  CLI::App* sub = calibrate->add_subcommand(
      "swarm",
      "Cameras, lever arms, antenna delays and IMUs of two to six robots at once, from half a "
      "minute in which they move in view of each other");
  sub->add_option("SWARM_DIR", options.swarm_dir, "the recording of all robots")->required();
  sub->add_option("--out", options.out,
                  "directory for <robot>.yaml; a fragment of crepesd.yaml for crepesd.d/ of each "
                  "robot is written beside it as <robot>.fragment.yaml")
      ->required();
  add_force_flag(sub, options.force);
  add_json_flag(sub, options.json);
  line.run(sub, [&options] {
    return finish(with_progress(options, [](const auto& o) { return calibrate_swarm(o); }),
                  options.json);
  });
}

}  // namespace

void add_calibrate(CommandLine& line) {
  CLI::App* sub = line.add("calibrate", "Calibrate a robot's sensors from a recording");
  sub->require_subcommand(1);
  add_camera(line, sub);
  add_imu(line, sub);
  add_range(line, sub);
  add_swarm(line, sub);
}

}  // namespace crepes
