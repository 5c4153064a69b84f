#include "drivers/imu/witmotion_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/base/sleep.hpp"

namespace crepes {
namespace {

enum Register : std::uint8_t { kSave = 0x00, kOutputs = 0x02, kRate = 0x03 };

constexpr WitMotionCommand kUnlock{0xff, 0xaa, 0x69, 0x88, 0xb5};
constexpr std::uint8_t kAccelerationAndRate = 0x02 | 0x04;
constexpr std::array<std::pair<int, std::uint8_t>, 5> kRates{
    {{10, 0x06}, {20, 0x07}, {50, 0x08}, {100, 0x09}, {200, 0x0b}}};

WitMotionCommand set(Register target, std::uint8_t value) {
  return {0xff, 0xaa, target, value, 0x00};
}

}  // namespace

Result<std::vector<WitMotionCommand>> witmotion_setup(int rate_hz) {
  const auto* const rate = std::ranges::find(kRates, rate_hz, &std::pair<int, std::uint8_t>::first);
  if (rate == kRates.end()) {
    return fail(
        ErrorCode::kUsage,
        fmt::format("the sensor has 10, 20, 50, 100 or 200 samples a second, not {}", rate_hz));
  }
  return std::vector<WitMotionCommand>{kUnlock, set(kOutputs, kAccelerationAndRate),
                                       set(kRate, rate->second), set(kSave, 0)};
}

Result<void> send_commands(SerialPort& port, const std::vector<WitMotionCommand>& commands,
                           std::chrono::milliseconds pause) {
  constexpr std::chrono::milliseconds kWriteTimeout{500};
  for (const WitMotionCommand& command : commands) {
    if (Result<void> sent = port.write_all(command, kWriteTimeout); !sent) return sent;
    sleep_for(pause);
  }
  return {};
}

}  // namespace crepes
