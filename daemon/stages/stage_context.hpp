/// What every stage receives.
#pragma once

#include <functional>

#include "daemon/stages/counters.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/event.hpp"
#include "net/subscription/system_status.hpp"

namespace crepes {

using EventSink = std::function<void(Event)>;
using StatusSink = std::function<void(SensorStatus)>;

/// All must outlive the stage.
struct StageContext {
  const Clock& clock;
  StatusSink report;    ///< thread-safe
  Counter& iterations;  ///< grows at least once in 200 ms
};

}  // namespace crepes
