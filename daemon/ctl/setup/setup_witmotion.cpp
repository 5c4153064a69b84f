#include "daemon/ctl/setup/setup_witmotion.hpp"

#include <fmt/core.h>

#include <cmath>
#include <cstddef>
#include <utility>

#include "drivers/base/monotonic_clock.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/imu/witmotion_setup.hpp"
#include "drivers/serial/serial_reader.hpp"

namespace crepes {
namespace {

/// Samples per second; an error if there are none.
Result<double> measure_rate(SerialPort port, std::chrono::milliseconds duration) {
  constexpr std::chrono::milliseconds kReadTimeout{50};
  const MonotonicClock clock;
  const std::string path = port.path();
  std::size_t samples = 0;
  SerialReader<WitMotionParser> reader(std::move(port), {}, clock,
                                       [&](const ImuSample&) { ++samples; });
  // Discards the samples from before.
  if (const Result<void> read = reader.read_once(std::chrono::milliseconds{0}); !read)
    return tl::unexpected(read.error());
  samples = 0;
  const Timestamp begin = clock.now();
  while (clock.now() - begin < duration) {
    if (const Result<void> read = reader.read_once(kReadTimeout); !read)
      return tl::unexpected(read.error());
  }
  if (samples > 0) return static_cast<double>(samples) / to_seconds(clock.now() - begin);
  return fail(ErrorCode::kIo,
              reader.diagnosis().value_or(path + ": no sample; is --baud the sensor's rate?"));
}

}  // namespace

Result<double> set_up_witmotion(const WitMotionSetup& setup) {
  constexpr double kWithin = 0.25;  // the sensor's rates are at least a factor of two apart
  const auto commands = witmotion_setup(setup.rate_hz);
  if (!commands) return tl::unexpected(commands.error());
  Result<SerialPort> port = SerialPort::open(setup.port, setup.baud);
  if (!port) return tl::unexpected(port.error());
  if (const auto sent = send_commands(*port, *commands, setup.pause); !sent)
    return tl::unexpected(sent.error());
  const Result<double> rate_hz = measure_rate(std::move(*port), setup.listen);
  if (!rate_hz) return tl::unexpected(rate_hz.error());
  if (std::abs(*rate_hz - setup.rate_hz) <= kWithin * setup.rate_hz) return *rate_hz;
  return fail(ErrorCode::kIo, fmt::format("{}: {} samples a second, not as asked", setup.port,
                                          std::lround(*rate_hz)));
}

}  // namespace crepes
