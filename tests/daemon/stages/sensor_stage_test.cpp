#include "daemon/stages/sensor_stage.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <stop_token>

#include "daemon/service/logging.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/sleep.hpp"

namespace crepes::sensor_stage_test {
namespace {

using namespace std::chrono_literals;

/// Answers a change of its settings only once the loop has iterated further, or after long.
class SlowDevice final : public Device {
 public:
  SlowDevice(const Counter& iterations, std::stop_source& stop, bool& has_iterated)
      : iterations_(iterations), stop_(stop), has_iterated_(has_iterated) {}

  [[nodiscard]] Result<std::size_t> read_once(std::chrono::milliseconds /*timeout*/) override {
    return 0;
  }
  [[nodiscard]] bool has_new_settings() const override { return !is_set_; }
  void apply_settings() override {
    const MonotonicClock clock;
    const Timestamp end = clock.now() + 10s;
    const std::uint64_t before = iterations_.value();
    while (iterations_.value() < before + 2 && clock.now() < end) sleep_for(1ms);
    has_iterated_ = iterations_.value() >= before + 2;
    is_set_ = true;
    stop_.request_stop();
  }
  [[nodiscard]] SensorTotals counters() const override { return {}; }
  [[nodiscard]] std::optional<std::string> diagnosis() const override { return std::nullopt; }

 private:
  const Counter& iterations_;
  std::stop_source& stop_;
  bool& has_iterated_;
  bool is_set_ = false;
};

TEST(SensorStageSettings, AreAppliedWhileTheLoopGoesOnForTheWatchdog) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock clock;
  std::stop_source stop;
  Counter iterations;
  bool has_iterated = false;
  const Sensor sensor{.name = "cam0",
                      .open = [&]() -> Result<std::unique_ptr<Device>> {
                        return std::make_unique<SlowDevice>(iterations, stop, has_iterated);
                      },
                      .silence_hint = ""};

  run_sensor(fixed_sensor(sensor),
             {.clock = clock, .report = [](SensorStatus) {}, .iterations = iterations},
             stop.get_token());

  EXPECT_TRUE(has_iterated);
}

}  // namespace
}  // namespace crepes::sensor_stage_test
