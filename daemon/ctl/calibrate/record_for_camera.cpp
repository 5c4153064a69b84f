#include "daemon/ctl/calibrate/record_for_camera.hpp"

#include <chrono>
#include <optional>
#include <utility>

#include "daemon/ctl/calibrate/camera_coverage.hpp"
#include "daemon/ctl/dataset/record.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/dataset/dataset_rows.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

/// The coverage on standard output: a terminal that is redrawn, or lines.
class CoverageView {
 public:
  [[nodiscard]] bool is_terminal() const { return screen_.is_terminal(); }
  void show(const CameraCoverage& coverage) {
    const Duration period = is_terminal() ? 200ms : 5s;
    if (clock_.now() < next_) return;
    next_ = clock_.now() + period;
    screen_.show(coverage_text(coverage) + "\nq: calibrate with what there is\n");
  }

 private:
  MonotonicClock clock_;
  LiveScreen screen_;
  Timestamp next_ = Timestamp::min();
};

}  // namespace

Result<std::filesystem::path> record_for_camera(const RecordForCameraOptions& options) {
  std::optional<CameraCoverage> coverage;
  std::optional<Error> fault;
  std::optional<CoverageView> view;
  if (!options.is_quiet) view.emplace();
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
    if (coverage && view) view->show(*coverage);
    return fault || keys.next() == 'q' || (coverage && coverage->share() >= 1.0);
  };
  const Result<RecordSummary> recorded = record(recording);
  const bool is_terminal = view && view->is_terminal();
  view.reset();
  if (fault) return tl::unexpected(*fault);
  if (!recorded) return tl::unexpected(recorded.error());
  if (is_terminal) print("\a" + coverage_text(*coverage) + "\n");
  return recorded->folder;
}

}  // namespace crepes
