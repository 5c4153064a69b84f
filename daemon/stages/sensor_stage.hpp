/// The loop around a device: open, read, report what is wrong, open again.
#pragma once

#include <functional>
#include <stop_token>

#include "daemon/devices/sensor.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/stage_context.hpp"

namespace crepes {

/// A sensor whose settings may change while it is read.
struct SensorSource {
  std::function<Sensor()> make;            ///< with the newest settings
  std::function<bool()> has_new_settings;  ///< since the last `make`
};

/// `settings` must outlive the source. `make(settings)` returns a Sensor.
template <class Settings, class Make>
[[nodiscard]] SensorSource sensor_source(LiveSettings<Settings>& settings, const Make& make) {
  return {.make = [&settings, make] { return make(settings.receive().value()); },
          .has_new_settings = [&settings] { return settings.has_update(); }};
}

/// A sensor whose settings never change.
[[nodiscard]] SensorSource fixed_sensor(Sensor sensor);

/// Reads a sensor until `stop`. A device that fails is opened again after 0.1 s; the delay grows to
/// 5 s. New settings reopen it at once. A missing device (kNotFound) is tried every 0.1 s.
void run_sensor(const SensorSource& source, const StageContext& context,
                const std::stop_token& stop);

}  // namespace crepes
