#include "daemon/devices/iio_sensor.hpp"

#include <utility>
#include <vector>

#include "daemon/devices/imu_preprocessing.hpp"
#include "drivers/iio/iio_imu.hpp"

namespace crepes {
namespace {

class IioSensorDevice final : public Device {
 public:
  IioSensorDevice(IioImu imu, const ImuSensorSettings& settings, EventSink sink)
      : imu_(std::move(imu)), preprocessing_(settings), sink_(std::move(sink)) {}

  [[nodiscard]] Result<std::size_t> read_once(std::chrono::milliseconds timeout) override {
    received_.clear();
    const Result<void> read =
        imu_.read_once(timeout, [this](const ImuSample& sample) { received_.push_back(sample); });
    if (!read) return tl::unexpected(read.error());
    preprocessing_.apply(received_);
    for (const ImuSample& sample : received_) sink_(Event(sample));
    return received_.size();
  }

  [[nodiscard]] SensorTotals counters() const override {
    const IioImu::Counts counts = imu_.counts();
    SensorTotals totals = totals_of(counts.samples);
    for (auto& fault : preprocessing_.faults()) totals.faults.push_back(std::move(fault));
    for (auto& count : preprocessing_.counts()) totals.counts.push_back(std::move(count));
    totals.faults.emplace_back("unpaired", counts.unpaired);
    totals.faults.emplace_back("stamps_refused", counts.stamps_refused);
    return totals;
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    std::optional<std::string> fault = imu_.diagnosis();
    return fault ? fault : preprocessing_.diagnosis();
  }

 private:
  IioImu imu_;
  ImuPreprocessing preprocessing_;
  EventSink sink_;
  std::vector<ImuSample> received_;
};

}  // namespace

Sensor iio_sensor(const ImuSensorSettings& settings, const Clock& clock, const EventSink& sink,
                  const IioPaths& paths) {
  Sensor sensor;
  sensor.name = "imu";
  sensor.silence_hint = "the kernel delivers no scans: are the sensor's interrupts connected?";
  sensor.open = [=, &clock]() -> Result<std::unique_ptr<Device>> {
    return IioImu::open(paths, settings.device.port, settings.rate_hz, clock)
        .map([&](IioImu&& imu) -> std::unique_ptr<Device> {
          return std::make_unique<IioSensorDevice>(std::move(imu), settings, sink);
        });
  };
  return sensor;
}

}  // namespace crepes
