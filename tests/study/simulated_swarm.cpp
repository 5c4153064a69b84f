#include "tests/study/simulated_swarm.hpp"

#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/sim_imu.hpp"
#include "tests/study/rendered_spots.hpp"
#include "tests/study/simulated_spots.hpp"

namespace crepes::study {
namespace {

constexpr double kPrincipalPointSigma = 0.4;  // px
constexpr std::uint64_t kCalibrationKey = 0x63616c69U;
constexpr std::uint64_t kBoardKey = 0x626f6172U;
constexpr std::uint64_t kRestKey = 0x72657374U;

std::vector<ImuSample> record_imu(const SimWorld& world, const DemoRobot& robot,
                                  double duration_s) {
  // The robot goes by its configuration, the sensor by what it is.
  ImuNoise sensor = robot.config.imu.noise;
  const SensorPriors truth;
  sensor.gyroscope_bias_sigma = truth.gyro_bias_radps;
  sensor.accelerometer_bias_sigma = truth.accel_bias_mps2;
  sensor.gyroscope_random_walk = truth.gyro_walk;
  sensor.accelerometer_random_walk = truth.accel_walk;
  SimImu imu(world, robot.config.robot.id, sensor);
  WitMotionParser parser;
  std::vector<ImuSample> samples;
  const auto keep = [&samples](const ImuSample& sample) { samples.push_back(sample); };
  const double period_s = 1.0 / sensor.update_rate;
  for (int i = 1; i * period_s <= duration_s; ++i) {
    const auto bytes = imu.sample(i * period_s);
    const Timestamp stamp = robot.clock.local(i * period_s);
    parser.parse(bytes, stamp, keep);
  }
  return samples;
}

/// `spots_at(t_s)` are those of the picture at this time.
template <class SpotsAt>
std::vector<SpotFrame> record_spots(const DemoRobot& robot, double duration_s,
                                    const SpotsAt& spots_at) {
  const CameraCalibration& camera = robot.config.cameras.front().calibration;
  std::vector<SpotFrame> frames;
  const double period_s = 1.0 / camera.rate_hz;
  const double phase_s = 0.0007 * robot.config.robot.id.value;
  for (int i = 0; i * period_s + phase_s <= duration_s; ++i) {
    const double t = i * period_s + phase_s;
    frames.push_back({.stamp = robot.clock.local(t), .camera = 0, .spots = spots_at(t)});
  }
  return frames;
}

/// What calibration leaves beside the camera's misalignment, which the renderer has.
void miscalibrate(Config& config, int seed) {
  const SeededNoise noise{kCalibrationKey, static_cast<std::uint64_t>(seed), config.robot.id.value};
  std::vector<double>& intrinsics = config.cameras.front().calibration.intrinsics;
  for (std::size_t i = 4; i < 6; ++i) intrinsics.at(i) += kPrincipalPointSigma * noise.gaussian(i);
}

/// As their builders measured the boards; all robots have the same numbers.
void measure_boards(const LedBoard& board, int seed, Config& config) {
  constexpr double kMeasured = 0.02;  // one sigma, relative
  for (MemberConfig& member : config.swarm.members) {
    const SeededNoise noise{kBoardKey, static_cast<std::uint64_t>(seed), member.id.value};
    member.ring_radius_m = board.radius_m * (1.0 + kMeasured * noise.gaussian(0));
    member.ring_leds = board.leds;
  }
}

Trajectory record_truth(const SimWorld& world, RobotId robot, double duration_s) {
  constexpr double kStep = 0.01;    // s
  constexpr double kMargin = 0.05;  // s, for what is interpolated at the end
  std::vector<TruthSample> samples;
  for (int i = 0; i * kStep <= duration_s + kMargin; ++i)
    samples.push_back({i * kStep, world.T_W_B(robot, i * kStep)});
  return Trajectory(std::move(samples));
}

/// Four robots near the corners of a square. They more or less face its center.
SimWorld world_at_rest(int seed) {
  constexpr double kSide = 3.0;    // m
  constexpr double kAround = 0.7;  // m
  constexpr double kTurn = 0.5;    // rad
  constexpr double kTilt = 0.03;   // rad
  std::map<RobotId, Motion> motions;
  for (std::uint16_t id = 1; id <= 4; ++id) {
    const SeededNoise noise{kRestKey, static_cast<std::uint64_t>(seed), id};
    const auto within = [&noise](int index, double center, double around) {
      const double at = 2.0 * noise.uniform(static_cast<std::uint64_t>(index)) - 1.0;
      return Wave{.offset = center + around * at};
    };
    const double x = id % 2 == 0 ? kSide : 0.0;
    const double y = id > 2 ? kSide : 0.0;
    const double inwards = std::atan2(kSide / 2.0 - y, kSide / 2.0 - x);
    motions.emplace(RobotId{id}, Motion{.x = within(0, x, kAround),
                                        .y = within(1, y, kAround),
                                        .z = within(2, 0.4, 0.25),
                                        .yaw = within(3, inwards, kTurn),
                                        .pitch = within(4, 0.0, kTilt),
                                        .roll = within(5, 0.0, kTilt)});
  }
  return {seed, std::move(motions)};
}

}  // namespace

SensorPriors priors_of(const Scenario& scenario) {
  SensorPriors priors;
  if (scenario.range_bias_m) priors.range_bias_m = *scenario.range_bias_m;
  if (scenario.ranges == RangeModel::kLinkTrack) priors.range_bias_m = kLinkTrackBias;
  return priors;
}

Swarm simulate_swarm(const Scenario& scenario, int seed, double duration_s) {
  SimConfig sim;
  sim.scenario = scenario.world;
  sim.seed = seed;
  const SimWorld world = scenario.rests ? world_at_rest(seed) : SimWorld(sim);
  std::vector<DemoRobot> robots = demo_swarm(sim, world.robots(), 0.0, 40000, 40100);
  for (DemoRobot& robot : robots)
    if (scenario.range_bias_m) robot.config.uwb.noise.bias_sigma_m = *scenario.range_bias_m;
  return simulate_swarm(scenario, world, std::move(robots), duration_s);
}

Swarm simulate_swarm(const Scenario& scenario, const SimWorld& world, std::vector<DemoRobot> robots,
                     double duration_s) {
  const int seed = world.seed();
  const Disturbance disturbance{.interference = scenario.interference,
                                .obstacles = ObstacleField(scenario.obstacles, seed),
                                .hides_images = scenario.hides_images,
                                .dark = scenario.dark,
                                .sight_m = scenario.sight_m};
  const auto spots_of = [&](const DemoRobot& robot) {
    if (robot.config.robot.id == scenario.blind)
      return record_spots(robot, duration_s, [](double) { return std::vector<Spot>{}; });
    if (scenario.pictured) {
      RenderedSpots pictures(world, robot.config, *scenario.pictured);
      return record_spots(robot, duration_s, [&](double t_s) { return pictures.at(t_s); });
    }
    SimulatedSpots projections(world, robot.config, disturbance);
    return record_spots(robot, duration_s, [&](double t_s) { return projections.at(t_s); });
  };
  SwarmDataset dataset;
  dataset.manifest = {.scenario = std::string(scenario.name),
                      .duration_s = duration_s,
                      .network = scenario.network,
                      .robots = {}};
  dataset.manifest.network.seed = static_cast<std::uint64_t>(seed);
  std::map<RobotId, SwarmTruth::Robot> paths;
  for (DemoRobot& robot : robots) {
    const RobotId id = robot.config.robot.id;
    const std::string name = "r" + std::to_string(id.value);
    const SwarmRobot entry{.id = id, .name = name, .dir = name, .clock = robot.clock};
    dataset.manifest.robots.push_back(entry);
    RobotRecording recording;
    recording.robot = entry;
    recording.imu = record_imu(world, robot, duration_s);
    recording.ranges = simulated_ranges(world, robot.config, robot.clock, scenario.ranges,
                                        disturbance.obstacles, duration_s);
    std::erase_if(recording.ranges, [&](const UwbRange& z) {
      return id == scenario.rangeless || z.neighbor == scenario.rangeless;
    });
    recording.cameras.push_back({.spots = spots_of(robot), .images = {}});
    miscalibrate(robot.config, seed);
    if (scenario.are_boards_measured) measure_boards(*scenario.pictured, seed, robot.config);
    recording.config = std::move(robot.config);
    dataset.robots.push_back(std::move(recording));
    paths.emplace(id, SwarmTruth::Robot{entry.clock, record_truth(world, id, duration_s)});
  }
  return {std::move(dataset), SwarmTruth(std::move(paths))};
}

}  // namespace crepes::study
