#include "drivers/sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <utility>

#include "drivers/sim/seeded_noise.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNearSide = 0.6;  // m, between two multirotors
constexpr double kLineStep = 4.0;  // m, along the corridor
constexpr double kLineSide = 1.5;  // m, from its middle

/// Draws the sines of one robot: given amplitudes, frequencies within +-20 %, random phases.
class WaveSource {
 public:
  WaveSource(int seed, RobotId robot)
      : noise_{0x6d6f74696f6eU, static_cast<std::uint64_t>(seed), robot.value} {}

  Wave::Sine sine(double amplitude, double frequency_hz) {
    const double stretch = 0.8 + 0.4 * noise_.uniform(next_++);
    return {amplitude, 2.0 * kPi * frequency_hz * stretch, 2.0 * kPi * noise_.uniform(next_++)};
  }

  double within(double around, double spread) {
    return around + spread * (2.0 * noise_.uniform(next_++) - 1.0);
  }

  /// Two sines about `offset`, the second smaller and faster.
  Wave wander(double offset, double amplitude, double frequency_hz) {
    return {.offset = offset,
            .sines = {sine(0.75 * amplitude, frequency_hz),
                      sine(0.25 * amplitude, 2.3 * frequency_hz)}};
  }

 private:
  SeededNoise noise_;
  std::uint64_t next_ = 0;
};

/// A multirotor near a place.
Motion hovering(WaveSource waves, double x, double y, double height, double yaw) {
  return {.rule = AttitudeRule::kThrust,
          .x = waves.wander(x, 0.6, 0.17),
          .y = waves.wander(y, 0.6, 0.17),
          .z = waves.wander(height, 0.35, 0.13),
          .yaw = waves.wander(yaw, radians(20.0), 0.12),
          .pitch = {},
          .roll = {}};
}

/// Around a place at distance `radius` from the center in direction `bearing`, facing inwards.
Motion multirotor(WaveSource waves, double radius, double bearing, double height) {
  return hovering(waves, radius * std::cos(bearing), radius * std::sin(bearing), height,
                  bearing + kPi);
}

/// On level ground; otherwise like a multirotor.
Motion ground_robot(WaveSource waves, double radius, double bearing) {
  return {.rule = AttitudeRule::kEuler,
          .x = waves.wander(radius * std::cos(bearing), 0.5, 0.09),
          .y = waves.wander(radius * std::sin(bearing), 0.5, 0.09),
          .z = {.offset = 0.3},
          .yaw = waves.wander(bearing + kPi, radians(20.0), 0.1),
          .pitch = {},
          .roll = {}};
}

/// Carried around a circle with a diameter of 4 m, facing inwards, rotating about all axes.
Motion hand_held(WaveSource waves, double bearing) {
  constexpr double kRadius = 2.0;
  constexpr double kTurn = 0.5;  // rad/s
  Motion motion{.rule = AttitudeRule::kEuler,
                .x = waves.wander(0.0, 0.15, 0.6),
                .y = waves.wander(0.0, 0.15, 0.6),
                .z = waves.wander(1.4, 0.25, 0.5),
                .yaw = waves.wander(bearing + kPi, radians(45.0), 0.8),
                .pitch = waves.wander(0.0, radians(25.0), 0.9),
                .roll = waves.wander(0.0, radians(35.0), 0.7)};
  motion.x.sines.push_back({kRadius, kTurn, bearing + kPi / 2.0});  // radius cos(bearing + turn t)
  motion.y.sines.push_back({kRadius, kTurn, bearing});
  motion.yaw.slope_ps = kTurn;
  return motion;
}

/// At rest near a place, almost level.
Motion resting(WaveSource waves, double x, double y, double z, double yaw) {
  const auto near = [&waves](double place) { return Wave{.offset = waves.within(place, 0.1)}; };
  const auto askew = [&waves](double angle) {
    return Wave{.offset = waves.within(angle, radians(2.0))};
  };
  return {.rule = AttitudeRule::kEuler,
          .x = near(x),
          .y = near(y),
          .z = near(z),
          .yaw = askew(yaw),
          .pitch = askew(0.0),
          .roll = askew(0.0)};
}

/// A multirotor in a light wind, which follows commands; it begins near a place.
Motion steered(WaveSource waves, double x, double y, double spread, double yaw) {
  const double near_x = waves.within(x, spread);
  const double near_y = waves.within(y, spread);
  return {.rule = AttitudeRule::kThrust,
          .x = waves.wander(near_x, 0.08, 0.1),
          .y = waves.wander(near_y, 0.08, 0.1),
          .z = waves.wander(waves.within(1.4, 0.1), 0.05, 0.1),
          .yaw = waves.wander(yaw, radians(3.0), 0.1),
          .pitch = {},
          .roll = {}};
}

/// 5 m to 27.5 m along x and back within a minute.
Wave excursion() { return {.offset = 16.25, .sines = {{11.25, 2.0 * kPi / 60.0, -kPi / 2.0}}}; }

std::map<RobotId, Motion> motions_of(SimScenario scenario, int seed) {
  const auto waves = [seed](std::uint16_t id) { return WaveSource(seed, RobotId{id}); };
  switch (scenario) {
    case SimScenario::kTwo:
      return {{RobotId{1}, multirotor(waves(1), 2.0, 0.0, 1.4)},
              {RobotId{2}, multirotor(waves(2), 2.0, kPi, 1.4)}};
    case SimScenario::kFour:
      return {{RobotId{1}, multirotor(waves(1), 3.5, 0.0, 1.4)},
              {RobotId{2}, ground_robot(waves(2), 3.5, kPi / 2.0)},
              {RobotId{3}, multirotor(waves(3), 3.5, kPi, 1.4)},
              {RobotId{4}, ground_robot(waves(4), 3.5, -kPi / 2.0)}};
    case SimScenario::kLongRange: {
      Motion far = multirotor(waves(2), 0.0, 0.0, 1.4);
      far.x = excursion();
      return {{RobotId{1}, resting(waves(1), 0.0, 0.0, 1.2, 0.0)}, {RobotId{2}, far}};
    }
    case SimScenario::kAggressive:
      return {{RobotId{1}, hand_held(waves(1), 0.0)}, {RobotId{2}, hand_held(waves(2), kPi)}};
    case SimScenario::kOccluded: {
      std::map<RobotId, Motion> motions;
      for (std::uint16_t id = 1; id <= 5; ++id) {
        const double bearing = 2.0 * kPi * (id - 1) / 5.0;
        motions.emplace(RobotId{id}, id % 2 == 1 ? multirotor(waves(id), 3.5, bearing, 1.4)
                                                 : ground_robot(waves(id), 3.5, bearing));
      }
      return motions;
    }
    case SimScenario::kLine: {
      // On alternating sides of a corridor; each faces across it and sees its two neighbors.
      std::map<RobotId, Motion> motions;
      for (std::uint16_t id = 1; id <= 4; ++id) {
        const double side = id % 2 == 1 ? -1.0 : 1.0;
        motions.emplace(RobotId{id}, hovering(waves(id), kLineStep * (id - 1), kLineSide * side,
                                              1.4, -side * kPi / 2.0));
      }
      return motions;
    }
    case SimScenario::kFormation: {
      // A triangle with the pillar inside, near the first one, who is to lead it around. All face
      // its center; the others begin beside their places.
      std::map<RobotId, Motion> motions;
      for (std::uint16_t id = 1; id <= 3; ++id) {
        const double bearing = kPi - 2.0 * kPi / 3.0 * (id - 1);
        const double radius = kFormationSide / std::sqrt(3.0);
        motions.emplace(RobotId{id},
                        steered(waves(id), 1.4 + radius * std::cos(bearing),
                                radius * std::sin(bearing), id == 1 ? 0.0 : 0.4, bearing + kPi));
      }
      return motions;
    }
    case SimScenario::kNear:
      return {{RobotId{1}, steered(waves(1), 0.0, 0.0, 0.0, 0.0)},
              {RobotId{2}, steered(waves(2), kNearSide, 0.0, 0.0, kPi)}};
    case SimScenario::kStatic:
      return {{RobotId{1}, resting(waves(1), 0.0, 0.0, 1.2, 0.0)},
              {RobotId{2}, resting(waves(2), 5.0, 0.4, 1.0, kPi)}};
  }
  CREPES_EXPECT(false, "every scenario has its motions");
}

std::vector<Pillar> pillars_of(SimScenario scenario) {
  // Adjacent robots on the circle always see past the pillar, the others only at times.
  if (scenario == SimScenario::kOccluded) return {{.radius_m = 1.0}};
  if (scenario == SimScenario::kFormation) return {{.radius_m = 0.25}};
  // Opposite the second and the third: each robot sees only the next one in the line.
  if (scenario == SimScenario::kLine) {
    return {{.center_W = {kLineStep, -kLineSide}, .radius_m = 1.3},
            {.center_W = {2.0 * kLineStep, kLineSide}, .radius_m = 1.3}};
  }
  return {};
}

}  // namespace

SimWorld::SimWorld(const SimConfig& config)
    : seed_(config.seed),
      motions_(motions_of(config.scenario, config.seed)),
      pillars_(pillars_of(config.scenario)) {
  if (config.track.empty()) return;
  Result<MotionTrackReader> track = MotionTrackReader::open(config.track, motions_.size());
  if (track) {
    track_ = std::make_shared<const MotionTrackReader>(std::move(*track));
  } else {
    fault_ = track.error().message;
  }
}

std::vector<RobotId> SimWorld::robots() const {
  std::vector<RobotId> ids;
  for (const auto& [id, motion] : motions_) ids.push_back(id);
  return ids;
}

BodyState SimWorld::state(RobotId robot, double t_s) const {
  const auto it = motions_.find(robot);
  CREPES_EXPECT(it != motions_.end(), "the robot is part of the scenario");
  if (track_ == nullptr) return it->second.at(t_s);
  const auto index = static_cast<std::size_t>(std::distance(motions_.begin(), it));
  return it->second.at(t_s, track_->at(index, t_s).value_or(SteeredState{}));
}

bool SimWorld::has_rotors(RobotId robot) const {
  const auto it = motions_.find(robot);
  CREPES_EXPECT(it != motions_.end(), "the robot is part of the scenario");
  return it->second.rule == AttitudeRule::kThrust;
}

Pose SimWorld::T_B_N(RobotId observer, RobotId neighbor, double t_s) const {
  return T_W_B(observer, t_s).inverse() * T_W_B(neighbor, t_s);
}

bool SimWorld::is_occluded(const Eigen::Vector3d& p_W_from, const Eigen::Vector3d& p_W_to) const {
  const Eigen::Vector2d along = (p_W_to - p_W_from).head<2>();
  const double length_sq = along.squaredNorm();
  return std::any_of(pillars_.begin(), pillars_.end(), [&](const Pillar& pillar) {
    const Eigen::Vector2d start = p_W_from.head<2>() - pillar.center_W;
    const double nearest =
        length_sq > 0.0 ? std::clamp(-start.dot(along) / length_sq, 0.0, 1.0) : 0.0;
    return (start + nearest * along).norm() < pillar.radius_m;
  });
}

}  // namespace crepes
