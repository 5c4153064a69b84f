#include "daemon/stages/sensor_stage.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/health_report.hpp"
#include "daemon/stages/worker.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kFirstRetry = milliseconds{100};
constexpr Duration kLastRetry = seconds{5};
constexpr Duration kDiagnosisPeriod = milliseconds{250};
constexpr Duration kHealthyAfter =
    seconds{1};  // a device that stayed open for so long resets the backoff
constexpr Duration kSilence = milliseconds{1500};
constexpr milliseconds kReadTimeout{50};

/// Runs work that may take seconds on its own thread, so that the loop keeps iterating for the
/// watchdog.
template <class Work>
auto run_on_own_thread(const StageContext& context, const std::string& name, const Work& work) {
  BoundedQueue<decltype(work())> done{1, Overflow::kDropOldest};
  const Worker worker(name, [&](const std::stop_token& /*stop*/) { done.push(work()); });
  auto result = done.try_pop();
  for (; !result; result = done.pop_for(milliseconds{100}, {})) context.iterations.add();
  return std::move(*result);
}

/// Reads until the device fails (returns the error), or until `stop` or new settings (no error). A
/// fault is published within two seconds.
Result<void> read_device(Device& device, const Sensor& sensor, const SensorSource& source,
                         const StageContext& context, HealthReport& health,
                         const std::stop_token& stop) {
  Timestamp last_heard = context.clock.now();
  Timestamp last_look = last_heard;
  while (!stop.stop_requested() && !source.has_new_settings()) {
    context.iterations.add();
    if (device.has_new_settings()) {
      run_on_own_thread(context, sensor.name + " set", [&device] {
        device.apply_settings();
        return true;
      });
    }
    const Result<std::size_t> count = device.read_once(kReadTimeout);
    if (!count) return tl::unexpected(count.error());
    health.count(*count);
    const Timestamp now = context.clock.now();
    if (*count > 0) last_heard = now;
    if (now - last_look < kDiagnosisPeriod) continue;
    last_look = now;
    std::string message = device.diagnosis().value_or("");
    if (message.empty() && now - last_heard > kSilence) message = sensor.silence_hint;
    if (health.is_due() || health.is_new_fault(message)) health.publish(message, device.counters());
  }
  return {};
}

/// Waits in small steps, so that the loop keeps iterating for the watchdog.
void back_off(Duration wait, const SensorSource& source, const StageContext& context,
              const std::stop_token& stop) {
  const Timestamp end = context.clock.now() + wait;
  while (!stop.stop_requested() && !source.has_new_settings() && context.clock.now() < end) {
    context.iterations.add();
    wait_for(milliseconds{100}, stop);
  }
}

}  // namespace

SensorSource fixed_sensor(Sensor sensor) {
  return {.make = [sensor = std::move(sensor)] { return sensor; },
          .has_new_settings = [] { return false; }};
}

void run_sensor(const SensorSource& source, const StageContext& context,
                const std::stop_token& stop) {
  Sensor sensor = source.make();
  HealthReport health(sensor.name, context);
  Duration retry = kFirstRetry;
  while (!stop.stop_requested()) {
    context.iterations.add();
    if (source.has_new_settings()) {
      sensor = source.make();
      retry = kFirstRetry;
    }
    Result<std::unique_ptr<Device>> device =
        run_on_own_thread(context, sensor.name + " open", sensor.open);
    if (device) {
      const Timestamp opened = context.clock.now();
      const Result<void> read = read_device(**device, sensor, source, context, health, stop);
      if (!read) health.publish(read.error().message, (*device)->counters());
      run_on_own_thread(context, sensor.name + " close", [&] {
        device->reset();
        return true;
      });
      if (context.clock.now() - opened > kHealthyAfter) retry = kFirstRetry;
    } else {
      health.publish(device.error().message, {});
      if (device.error().code == ErrorCode::kNotFound) retry = kFirstRetry;
    }
    back_off(retry, source, context, stop);
    retry = std::min(2 * retry, kLastRetry);
  }
}

}  // namespace crepes
