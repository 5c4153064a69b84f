#include "daemon/ctl/calibrate/calibrate_swarm.hpp"

#include <vector>

#include "daemon/ctl/calibrate/swarm_recording.hpp"
#include "daemon/ctl/calibrate/swarm_report.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/swarm/swarm_batch.hpp"

namespace crepes {
namespace {

constexpr double kShareOfMeasuring = 0.4;

/// The file for Kalibr and the fragment.
std::vector<std::filesystem::path> result_files(const std::filesystem::path& out,
                                                const std::string& robot) {
  return {out / (robot + ".yaml"), out / (robot + ".fragment.yaml")};
}

Result<void> write_robots(const SwarmBatchResult& found, const SwarmDataset& dataset,
                          const std::filesystem::path& out) {
  for (std::size_t r = 0; r < dataset.robots.size(); ++r) {
    const auto files = result_files(out, dataset.robots[r].robot.name);
    auto written = write_text_file(files[0], calibration_text(found, dataset, r)).and_then([&] {
      return write_text_file(files[1], fragment_text(found, dataset, r));
    });
    if (!written) return written;
  }
  return {};
}

}  // namespace

Result<CalibrationReport> calibrate_swarm(const CalibrateSwarmOptions& options) {
  const auto dataset = load_swarm(options.swarm_dir);
  if (!dataset) return tl::unexpected(dataset.error());
  if (const auto checked = check_modules(*dataset); !checked)
    return tl::unexpected(checked.error());
  for (const RobotRecording& robot : dataset->robots) {
    const auto free =
        check_results(result_files(options.out, robot.robot.name), "swarm", options.force);
    if (!free) return tl::unexpected(free.error());
  }
  const auto progress = [&](double done) {
    if (options.on_progress) options.on_progress(done);
  };
  auto measured =
      swarm_measurements(*dataset, [&](double done) { progress(kShareOfMeasuring * done); });
  if (!measured) return tl::unexpected(measured.error());
  SwarmBatchSettings settings{.names = {}, .on_progress = [&](double done) {
                                progress(kShareOfMeasuring + (1.0 - kShareOfMeasuring) * done);
                              }};
  for (const RobotRecording& robot : dataset->robots) settings.names.push_back(robot.robot.name);
  const SwarmBatchResult found =
      calibrate_swarm(std::move(measured->records), measured->guess, measured->start, settings);
  if (found.refusals.empty()) {
    if (const auto written = write_robots(found, *dataset, options.out); !written)
      return tl::unexpected(written.error());
  }
  CalibrationReport report{.text = {}, .reasons = found.refusals, .faults = dataset->faults};
  if (options.json) {
    report.text = swarm_json(found, *dataset);
  } else if (found.refusals.empty()) {
    report.text = swarm_text(found, *dataset, options.out);
  }
  return report;
}

}  // namespace crepes
