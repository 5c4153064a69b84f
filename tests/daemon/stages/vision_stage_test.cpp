#include "daemon/stages/vision_stage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include "daemon/service/logging.hpp"
#include "daemon/stages/worker.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::vision_stage_test {
namespace {

using std::chrono::milliseconds;

/// Half a second later at each look, so that a report is soon due. For the stage's thread only.
class HastyClock final : public Clock {
 public:
  [[nodiscard]] Timestamp now() const override { return now_ += milliseconds{500}; }

 private:
  mutable Timestamp now_{};
};

TEST(VisionStage, PublishesARateOfZeroWhenNoMoreFramesCome) {
  const LogSession log(LogLevel::kError);
  const HastyClock clock;
  Counter iterations;
  LiveSettings<VisionConfig> settings{VisionConfig{}};
  LiveSettings<LightSettings> light_settings{LightSettings{}};
  LiveLight light{LightSettings{}};
  PictureRobotsQueue boards{1, Overflow::kDropOldest};
  FrameQueue frames{1, Overflow::kDropOldest};
  FrameQueue recycled{1, Overflow::kDropOldest};
  PictureTap tap;
  BoundedQueue<SensorStatus> reports{16, Overflow::kDropNewest};
  const StageContext context{clock, [&](SensorStatus status) { reports.push(std::move(status)); },
                             iterations};
  const VisionStage stage{.camera_name = "cam0",
                          .is_calibrated = true,
                          .settings = settings,
                          .light_settings = light_settings,
                          .light = light,
                          .boards = boards,
                          .frames = frames,
                          .recycled = recycled,
                          .tap = tap,
                          .sink = [](const Event&) {}};
  frames.push(
      Frame{.width = 64, .height = 48, .pixels = std::vector<std::uint8_t>(std::size_t{64} * 48)});

  const Worker vision("vision",
                      [&](const std::stop_token& stop) { run_vision(stage, context, stop); });
  const auto with_a_frame = reports.pop_for(kPatience, {});
  const auto without = reports.pop_for(kPatience, {});

  ASSERT_TRUE(with_a_frame && without);
  EXPECT_GT(with_a_frame->rate_hz, 0.0);
  EXPECT_EQ(without->rate_hz, 0.0);
  EXPECT_EQ(without->name, "cam0 spots");
  EXPECT_EQ(without->message, with_a_frame->message);
  const auto has = [](const SensorStatus& status, const char* name) {
    return std::ranges::count(status.totals.counts, name, &Totals::value_type::first) > 0;
  };
  EXPECT_TRUE(has(*with_a_frame, "background"));
  EXPECT_FALSE(has(*without, "background")) << "of a picture that is gone";
  EXPECT_TRUE(has(*without, "hot"));
}

}  // namespace
}  // namespace crepes::vision_stage_test
