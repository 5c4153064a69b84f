#include "drivers/sim/sim_serial.hpp"

#include <cmath>

#include "estimator/core/contract.hpp"

namespace crepes {

Result<SimSerial> SimSerial::open(Device device, double rate_hz) {
  CREPES_EXPECT(rate_hz > 0.0, "a device has a rate");
  return PseudoTerminal::open().map(
      [&](PseudoTerminal line) { return SimSerial(std::move(line), std::move(device), rate_hz); });
}

void SimSerial::run_until(double now_s) {
  const auto latest = static_cast<std::int64_t>(std::floor(now_s * rate_hz_));
  if (latest < next_) return;
  if (next_ != INT64_MIN) missed_ += static_cast<std::uint64_t>(latest - next_);
  next_ = latest + 1;
  const std::vector<std::uint8_t> bytes = device_(now_s);
  lost_bytes_ += bytes.size() - line_.write(bytes);
}

}  // namespace crepes
