#include "daemon/stages/vision_stage.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/stages/auto_exposure.hpp"
#include "daemon/stages/health_report.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;

/// In memory of its own.
Frame copy_of(const Frame& frame) {
  Frame copy{.stamp = frame.stamp,
             .arrival = frame.arrival,
             .camera = frame.camera,
             .width = frame.width,
             .height = frame.height,
             .pixels = std::vector<std::uint8_t>()};
  copy.pixels.reserve(static_cast<std::size_t>(frame.width) *
                      static_cast<std::size_t>(frame.height));
  for (int row = 0; row < frame.height; ++row) {
    const std::uint8_t* const begin = frame.data() + row * frame.stride();
    copy.pixels.insert(copy.pixels.end(), begin, begin + frame.width);
  }
  return copy;
}

/// The frame and what was found in it, for whoever asked.
Picture picture_of(const Frame& frame, const Detection& found) {
  const auto hot =
      found.hot_pixels.first(std::min(found.hot_pixels.size(), Picture::kMaxHotPixels));
  return {.frame = copy_of(frame),
          .spots = {found.spots.begin(), found.spots.end()},
          .hot_pixels = {hot.begin(), hot.end()},
          .hot_pixel_count = found.hot_pixels.size(),
          .background = found.background,
          .threshold = found.threshold,
          .saturated_share = found.saturated_share};
}

std::string_view calibration_hint(bool is_calibrated) {
  return is_calibrated ? ""
                       : "not calibrated: no pose comes from this camera; record, then crepesctl "
                         "calibrate camera";
}

std::string_view diagnosis_of(const Detection& found, bool is_calibrated) {
  if (!found.failure.empty()) return found.failure;
  if (found.exposure == Exposure::kBright)
    return "the picture is bright all over: shorten the exposure or mend the infrared filter";
  return calibration_hint(is_calibrated);
}

/// The gray levels of the spots since the last call.
class SpotLevels {
 public:
  void add(std::span<const Spot> spots) {
    spots_ = std::max(spots_, spots.size());
    for (const Spot& spot : spots) {
      brightest_ = std::max(brightest_, spot.peak);
      faintest_ = std::min(faintest_, spot.peak);
    }
  }

  /// Adds the most `spots` in a frame, and if there were any, `brightest` and `faintest`.
  void append_since_last_call(Totals& counts) {
    constexpr double kWhite = 255.0;
    const auto level = [](double peak) { return static_cast<std::uint64_t>(peak); };
    counts.emplace_back("spots", spots_);
    if (brightest_ > 0.0) {
      counts.emplace_back("brightest", level(brightest_));
      counts.emplace_back("faintest", level(faintest_));
    }
    spots_ = 0;
    brightest_ = 0.0;
    faintest_ = kWhite;
  }

 private:
  std::size_t spots_ = 0;
  double brightest_ = 0.0;
  double faintest_ = 255.0;
};

/// Delays from a frame's arrival to its spots.
class Delays {
 public:
  void add(Duration delay) { delays_.push_back(delay); }

  /// Median and 99th percentile [us].
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> percentiles_since_last_call() {
    std::vector<Duration> sorted = std::exchange(delays_, {});
    if (sorted.empty()) return {};
    std::ranges::sort(sorted);
    const auto at = [&](std::size_t percent) {
      const Duration delay = sorted[(sorted.size() - 1) * percent / 100];
      return static_cast<std::uint64_t>(delay / std::chrono::microseconds{1});
    };
    return {at(50), at(99)};
  }

 private:
  std::vector<Duration> delays_;
};

void append_exposure(const AutoExposure& exposure, Totals& counts) {
  const std::optional<double> exposure_us = exposure.exposure_us();
  if (!exposure_us) return;
  counts.emplace_back("auto_exposure_us", static_cast<std::uint64_t>(*exposure_us));
  counts.emplace_back("longest_exposure_us", static_cast<std::uint64_t>(exposure.longest_us()));
}

/// What is true without a picture, too.
SensorTotals totals_since_start(const Rejected& rejected, std::uint64_t failures) {
  return {.faults = {{"failures", failures}},
          .counts = {{"hot", rejected.hot},
                     {"huge", rejected.huge},
                     {"faint", rejected.faint},
                     {"surplus", rejected.surplus},
                     {"cut", rejected.cut}}};
}

SensorTotals totals_of(const Detection& found, const Rejected& rejected, std::uint64_t failures,
                       Delays& delays, SpotLevels& levels, const AutoExposure& exposure) {
  const auto [median_us, p99_us] = delays.percentiles_since_last_call();
  SensorTotals totals = totals_since_start(rejected, failures);
  totals.counts.insert(totals.counts.end(),
                       {{"delay_p50_us", median_us},
                        {"delay_p99_us", p99_us},
                        {"threshold", static_cast<std::uint64_t>(found.threshold)},
                        {"background", static_cast<std::uint64_t>(found.background)},
                        {"hot_pixels", found.hot_pixels.size()}});
  levels.append_since_last_call(totals.counts);
  append_exposure(exposure, totals.counts);
  return totals;
}

/// What was published last. It stays for a second without a frame.
struct Published {
  std::string message;
  SensorTotals totals;
  Timestamp last_frame{};
};

}  // namespace

void run_vision(const VisionStage& stage, const StageContext& context,
                const std::stop_token& stop) {
  std::optional<SpotDetector> detector;
  HealthReport health(stage.camera_name + " spots", context, stage.is_calibrated);
  Rejected rejected;
  Delays delays;
  SpotLevels levels;
  AutoExposure exposure{LightSettings{}};
  std::uint64_t failures = 0;
  std::optional<Published> last;
  while (!stop.stop_requested()) {
    context.iterations.add();
    if (const auto settings = stage.settings.receive()) detector.emplace(*settings);
    if (const auto settings = stage.light_settings.receive()) {
      exposure = AutoExposure(*settings);
      // What was chosen by the settings before may still be on its way.
      if (const auto exposure_us = exposure.exposure_us()) stage.light.expose(*exposure_us);
    }
    std::optional<Frame> frame = stage.frames.pop_for(milliseconds{100}, stop);
    if (!frame) {
      constexpr Duration kStale = std::chrono::seconds{1};
      if (!last || !health.is_due()) continue;
      if (context.clock.now() - last->last_frame >= kStale) {
        last->message = calibration_hint(stage.is_calibrated);
        last->totals = totals_since_start(rejected, failures);
      }
      health.publish(last->message, last->totals);
      continue;
    }
    const Detection found =
        detector->detect({frame->data(), frame->width, frame->height, frame->stride()});
    stage.sink(SpotFrame{frame->stamp, frame->camera, {found.spots.begin(), found.spots.end()}});
    delays.add(context.clock.now() - frame->arrival);
    levels.add(found.spots);
    while (const auto seen = stage.boards.try_pop()) exposure.add(seen->bearings);
    const PictureLevels picture{.background = static_cast<double>(found.background),
                                .threshold = static_cast<double>(found.threshold)};
    if (const auto exposure_us = exposure.step(frame->stamp, picture))
      stage.light.expose(*exposure_us);
    health.count(1);
    rejected += found.rejected;
    failures += found.failure.empty() ? 0 : 1;
    if (health.is_due()) {
      last = {.message = std::string(diagnosis_of(found, stage.is_calibrated)),
              .totals = totals_of(found, rejected, failures, delays, levels, exposure)};
      health.publish(last->message, last->totals);
    }
    if (last) last->last_frame = context.clock.now();
    if (stage.tap.requests.try_pop()) stage.tap.pictures.push(picture_of(*frame, found));
    stage.recycled.push(std::move(*frame));
  }
}

}  // namespace crepes
