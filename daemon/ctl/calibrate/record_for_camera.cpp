#include "daemon/ctl/calibrate/record_for_camera.hpp"

#include <chrono>
#include <optional>
#include <utility>

#include "daemon/ctl/calibrate/camera_coverage.hpp"
#include "daemon/ctl/calibrate/coverage_file.hpp"
#include "daemon/ctl/dataset/record.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/dataset/dataset_rows.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

/// The coverage on standard output, a terminal that is redrawn or lines, unless it is quiet; and
/// once a second in a file for the page of `crepesctl view`.
class CoverageView {
 public:
  CoverageView(bool is_quiet, const std::filesystem::path& socket) : file_(socket) {
    if (!is_quiet) screen_.emplace();
  }
  [[nodiscard]] bool is_terminal() const { return screen_ && screen_->is_terminal(); }
  void show(const CameraCoverage& coverage) {
    const Timestamp now = clock_.now();
    if (now >= next_file_) {
      next_file_ = now + 1s;
      const auto written = file_.write(coverage_json(coverage));
      page_ = written ? "" : "crepesctl view does not show this: " + written.error().message + "\n";
    }
    if (!screen_ || now < next_) return;
    next_ = now + (is_terminal() ? 200ms : 5s);
    screen_->show(coverage_text(coverage) + page_ + keys_text());
  }

  /// `?` shows what the signs mean.
  void toggle_help() { has_help_ = !has_help_; }

 private:
  [[nodiscard]] std::string keys_text() const {
    std::string text = "\nq: calibrate with what there is; ?: help\n";
    if (!has_help_) return text;
    return text +
           "\n# a board was seen there three times or more, . not yet, blank: no light falls "
           "there\n"
           "The bar is what there is least of: the picture's cells, turns about each axis, time.\n"
           "The recording ends by itself when it is full. The page of crepesctl view shows the\n"
           "cells over the camera's picture.\n";
  }

  CoverageFile file_;
  MonotonicClock clock_;
  std::optional<LiveScreen> screen_;
  Timestamp next_ = Timestamp::min();
  Timestamp next_file_ = Timestamp::min();
  std::string page_;  ///< why the page does not show it
  bool has_help_ = false;
};

}  // namespace

Result<std::filesystem::path> record_for_camera(const RecordForCameraOptions& options) {
  std::optional<CameraCoverage> coverage;
  std::optional<Error> fault;
  const StopSignals until_restored;
  std::optional<CoverageView> view(std::in_place, options.is_quiet, options.socket);
  const KeyReader keys;
  RecordOptions recording;
  recording.dir = options.dir;
  recording.socket = options.socket;
  recording.on_config = [&](const Config& config) {
    if (coverage) return;  // a reload changes no calibration
    auto made = CameraCoverage::of(config);
    if (made) {
      coverage.emplace(std::move(*made));
    } else {
      fault = made.error();
    }
  };
  recording.on_rows = [&](const std::string& sensor, std::string_view rows) {
    if (!coverage) return;
    if (sensor == "imu0")
      for (const ImuSample& sample : imu_samples(rows)) coverage->add(sample);
    if (sensor == "cam0")
      for (const SpotFrame& frame : spot_frames(rows)) coverage->add(frame);
  };
  recording.is_enough = [&] {
    const auto key = keys.next();
    if (key == '?') view->toggle_help();
    if (coverage) view->show(*coverage);
    return fault || key == 'q' || (coverage && coverage->share() >= 1.0);
  };
  const Result<RecordSummary> recorded = record(recording);
  const bool is_terminal = view->is_terminal();
  view.reset();
  if (fault) return tl::unexpected(*fault);
  if (!recorded) return tl::unexpected(recorded.error());
  if (is_terminal) print("\a" + coverage_text(*coverage) + "\n");
  return recorded->folder;
}

}  // namespace crepes
