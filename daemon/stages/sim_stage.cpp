#include "daemon/stages/sim_stage.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "daemon/stages/bounded_queue.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/sim_camera.hpp"
#include "drivers/sim/sim_imu.hpp"
#include "drivers/sim/sim_uwb.hpp"

namespace crepes {
namespace {

constexpr double kUwbRateHz = 50.0;     ///< of a LinkTrack pair
constexpr double kMaxRenderWait = 0.1;  ///< s

}  // namespace

Result<SimSerial> open_sim_imu(const SimWorld& world, const Config& config) {
  const RobotId self = config.robot.id;
  if (!world.contains(self))
    return fail(ErrorCode::kConfig, fmt::format("sim.scenario has no robot {}", self.value));
  if (!world.fault().empty()) return fail(ErrorCode::kConfig, "sim.track: " + world.fault());
  SimImu imu(world, self, config.imu.noise);
  return SimSerial::open([imu](double t_s) mutable { return imu.sample(t_s); },
                         config.imu.noise.update_rate);
}

Result<SimSerial> open_sim_uwb(const SimWorld& world, const Config& config) {
  return SimUwb::make(world, config.robot.id, config.swarm, config.uwb.noise)
      .and_then([](const SimUwb& uwb) {
        return SimSerial::open([uwb](double t_s) { return uwb.sample(t_s); }, kUwbRateHz);
      });
}

OpenCamera sim_camera(const SimWorld& world, const Config& config, std::size_t index,
                      const SimClock& clock) {
  const CameraCalibration camera = config.cameras[index].calibration;
  return [&world, &clock, camera, index, robot = config.robot.id,
          swarm = config.swarm](const CameraLight& light) -> Result<std::unique_ptr<Camera>> {
    Result<RingRenderer> renderer =
        RingRenderer::make(world, robot, swarm, camera, static_cast<std::uint8_t>(index));
    if (!renderer) return tl::unexpected(renderer.error());
    auto opened = std::make_unique<SimCamera>(std::move(*renderer), camera, clock);
    return opened->set_light(light).map([&] { return std::unique_ptr<Camera>(std::move(opened)); });
  };
}

void run_sim_serial(SimSerial& device, const SimClock& clock, Counter& iterations,
                    const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    iterations.add();
    device.run_until(clock.world_s());
    const double wait_s = device.next_due_s() - clock.world_s();
    if (wait_s > 0) wait_for(from_seconds(std::min(wait_s, kMaxRenderWait)), stop);
  }
}

}  // namespace crepes
