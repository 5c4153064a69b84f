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
  explicit CoverageView(bool json) : json_(json) {
    if (!json) screen_.emplace();
  }
  [[nodiscard]] bool is_terminal() const { return screen_ && screen_->is_terminal(); }
  void show(const CameraCoverage& coverage) {
    const Duration period = is_terminal() ? 200ms : json_ ? 1s : 5s;
    if (clock_.now() < next_) return;
    next_ = clock_.now() + period;
    if (json_) {
      print(coverage_json(coverage));
    } else {
      screen_->show(coverage_text(coverage) + "\nq: calibrate with what there is\n");
    }
  }

 private:
  bool json_;
  MonotonicClock clock_;
  std::optional<LiveScreen> screen_;
  Timestamp next_ = Timestamp::min();
};

}  // namespace

Result<std::filesystem::path> record_for_camera(const RecordForCameraOptions& options) {
  std::optional<CameraCoverage> coverage;
  std::optional<Error> fault;
  std::optional<CoverageView> view(std::in_place, options.json);
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
    if (coverage) view->show(*coverage);
    return fault || keys.next() == 'q' || (coverage && coverage->share() >= 1.0);
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
