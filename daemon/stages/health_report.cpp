#include "daemon/stages/health_report.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/service/logging.hpp"

namespace crepes {
namespace {

constexpr Duration kHealthPeriod = std::chrono::seconds{1};

}  // namespace

HealthReport::HealthReport(std::string name, const StageContext& context, bool is_calibrated)
    : name_(std::move(name)),
      context_(context),
      is_calibrated_(is_calibrated),
      period_start_(context.clock.now()) {}

bool HealthReport::is_due() const { return context_.clock.now() - period_start_ >= kHealthPeriod; }

void HealthReport::publish(const std::string& message, SensorTotals totals) {
  const Timestamp now = context_.clock.now();
  const double elapsed_s = std::max(to_seconds(now - period_start_), 1e-3);
  SensorStatus status;
  status.name = name_;
  status.rate_hz = static_cast<double>(measurements_) / elapsed_s;
  status.ok = message.empty();
  status.is_calibrated = is_calibrated_;
  status.message = message;
  status.totals = std::move(totals);
  context_.report(std::move(status));
  period_start_ = now;
  measurements_ = 0;

  if (message == logged_) return;
  if (message.empty()) {
    log_message(LogLevel::kInfo, name_ + ": works again");
  } else {
    log_message(LogLevel::kWarning, name_ + ": " + message);
  }
  logged_ = message;
}

}  // namespace crepes
