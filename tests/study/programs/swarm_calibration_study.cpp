/// How good poses are before and after `crepesctl calibrate swarm`, against those with the true
/// calibration, on simulated swarms: swarm_calibration_study [SEEDS [FIRST_SEED]]
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "daemon/ctl/calibrate/swarm_recording.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/seeded_noise.hpp"
#include "estimator/calibration/swarm/swarm_batch.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "tests/study/replay_scores.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::study {
namespace {

constexpr double kDuration_s = 40.0;
constexpr double kAfter_s = 5.0;
constexpr std::uint64_t kSpoilKey = 0x73706f69U;
constexpr std::uint64_t kDrawKey = 0x64726177U;

/// Means over the pairs of their RMSE.
struct PoseError {
  double position_m = 0.0;
  double rotation_deg = 0.0;
};

PoseError replayed_error(const Swarm& swarm) {
  PoseError error;
  const auto scores = replay_scores(swarm, {}, kAfter_s);
  if (!scores || scores->empty()) return {std::nan(""), std::nan("")};
  for (const auto& [pair, score] : *scores) {
    error.position_m +=
        statistics_of(score.position_errors_m).rmse / static_cast<double>(scores->size());
    error.rotation_deg += kDegPerRad * statistics_of(score.rotation_errors_rad).rmse /
                          static_cast<double>(scores->size());
  }
  return error;
}

/// What a ruler and a generic lens leave: cameras turned by 2 deg about each axis, levers off by
/// 2 cm, focal length by 0.6 %, the principal point by 1 px, time shifts by 3 ms.
void spoil(Swarm& swarm, int seed) {
  for (RobotRecording& robot : swarm.dataset.robots) {
    const SeededNoise noise{kSpoilKey, static_cast<std::uint64_t>(seed), robot.robot.id.value};
    std::uint64_t next = 0;
    const auto draw = [&](double sigma) { return sigma * noise.gaussian(next++); };
    const auto vector = [&](double sigma) {
      return Eigen::Vector3d(draw(sigma), draw(sigma), draw(sigma));
    };
    CameraCalibration& camera = robot.config.cameras.front().calibration;
    const Eigen::Vector3d p_B_C = camera.T_cam_imu.inverse().p + vector(0.02);
    camera.T_cam_imu.q = camera.T_cam_imu.q * so3_exp(vector(radians(2.0)));
    camera.T_cam_imu.p = -(camera.T_cam_imu.q * p_B_C);
    const double focal = 1.0 + draw(0.006);
    camera.intrinsics.at(2) *= focal;
    camera.intrinsics.at(3) *= focal;
    camera.intrinsics.at(4) += draw(1.0);
    camera.intrinsics.at(5) += draw(1.0);
    camera.timeshift_cam_imu += draw(0.003);
    const Eigen::Vector3d ring = vector(0.02);
    const Eigen::Vector3d antenna = vector(0.02);
    for (RobotRecording& reader : swarm.dataset.robots) {
      for (MemberConfig& member : reader.config.swarm.members) {
        if (member.id != robot.robot.id) continue;
        member.p_body_led += ring;
        member.p_body_uwb += antenna;
      }
    }
  }
}

/// Puts constants in force. The bias that remains in ranges is what `found` leaves.
void apply(const std::vector<RobotConstants>& robots, const SwarmBatchResult& found, Swarm& swarm) {
  for (std::size_t r = 0; r < robots.size(); ++r) {
    const RobotConstants& constants = robots[r];
    CameraCalibration& camera = swarm.dataset.robots[r].config.cameras.front().calibration;
    camera.intrinsics.assign(constants.camera.lens.begin(), constants.camera.lens.end());
    camera.T_cam_imu = constants.camera.T_C_B();
    camera.timeshift_cam_imu = constants.camera.shift_s;
    swarm.dataset.robots[r].config.uwb.noise.bias_sigma_m = remaining_range_bias(found, r);
    for (RobotRecording& reader : swarm.dataset.robots) {
      for (MemberConfig& member : reader.config.swarm.members) {
        if (member.id != swarm.dataset.robots[r].robot.id) continue;
        member.p_body_led = constants.p_B_M;
        member.p_body_uwb = constants.p_B_U;
        member.range_delay_m = constants.range_delay_m;
      }
    }
  }
}

/// The cameras as they truly are in this world; rings and antennas are as configured.
std::vector<RobotConstants> true_constants(const Swarm& swarm, int seed) {
  SimConfig sim;
  sim.scenario = SimScenario::kFour;
  sim.seed = seed;
  const SimWorld world(sim);
  std::vector<RobotConstants> truth;
  for (const RobotRecording& robot : swarm.dataset.robots) {
    RobotConstants& constants = truth.emplace_back(configured_constants(robot.config).value());
    const auto renderer = RingRenderer::make(world, robot.robot.id, robot.config.swarm,
                                             robot.config.cameras.front().calibration, 0);
    const Pose T_C_B = renderer.value().T_C_B();
    constants.camera.q_C_B = T_C_B.q;
    constants.camera.p_B_C = T_C_B.inverse().p;
  }
  return truth;
}

/// NEES by degree of freedom of cameras' rotations and rings.
double nees_of(const SwarmBatchResult& found, const std::vector<RobotConstants>& truth) {
  double sum = 0.0;
  for (std::size_t r = 0; r < truth.size(); ++r) {
    const RobotPriors e = difference(found.robots[r].after, truth[r]);
    for (const int begin : {swarm_constants::kRotation, swarm_constants::kRing}) {
      const auto at = static_cast<Eigen::Index>(r) * swarm_constants::kSize + begin;
      const Eigen::Matrix3d P = found.covariance.block<3, 3>(at, at);
      const Eigen::Vector3d d = e.segment<3>(begin);
      sum += d.dot(P.inverse() * d) / (6.0 * static_cast<double>(truth.size()));
    }
  }
  return sum;
}

std::vector<RobotConstants> found_constants(const SwarmBatchResult& found) {
  std::vector<RobotConstants> robots;
  for (const CalibratedRobot& robot : found.robots) robots.push_back(robot.after);
  return robots;
}

/// The error of poses if constants err as the inverse of the recording's information says, which is
/// the least that any calibration can do: the RMS of a few draws around the truth.
PoseError least_error(const SwarmBatchResult& found, const std::vector<RobotConstants>& truth,
                      const Swarm& swarm, int seed) {
  constexpr int kDraws = 4;
  const Eigen::LLT<Eigen::MatrixXd> P(found.covariance);
  if (P.info() != Eigen::Success) return {std::nan(""), std::nan("")};
  const SeededNoise noise{kDrawKey, static_cast<std::uint64_t>(seed), 0};
  std::uint64_t next = 0;
  PoseError sum;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd white(found.covariance.rows());
    for (double& x : white) x = noise.gaussian(next++);
    const SwarmState state{truth,
                           std::vector<std::vector<CameraKnot>>(truth.size()),
                           std::vector<double>(pair_count(truth.size()), 0.0),
                           {}};
    const TeamArrowSystem::Step step{
        .states = {}, .constants = P.matrixL() * white, .constants_covariance = {}};
    Swarm drawn = swarm;
    apply(moved(state, step).robots, found, drawn);
    const PoseError error = replayed_error(drawn);
    sum.position_m += error.position_m * error.position_m / kDraws;
    sum.rotation_deg += error.rotation_deg * error.rotation_deg / kDraws;
  }
  return {std::sqrt(sum.position_m), std::sqrt(sum.rotation_deg)};
}

void run(int seed) {
  constexpr Scenario kFour{.name = "four", .world = SimScenario::kFour};
  Swarm swarm = simulate_swarm(kFour, seed, kDuration_s);
  const std::vector<RobotConstants> truth = true_constants(swarm, seed);
  std::vector<std::string> names;
  for (const RobotRecording& robot : swarm.dataset.robots) names.push_back(robot.robot.name);
  const PoseError best = replayed_error(swarm);
  spoil(swarm, seed);
  const PoseError before = replayed_error(swarm);
  auto measured = swarm_measurements(swarm.dataset, {});
  if (!measured) {
    std::printf("%4d  %s\n", seed, measured.error().message.c_str());
    return;
  }
  const SwarmBatchResult found =
      calibrate_swarm(std::move(measured->records), measured->guess, measured->start,
                      {.names = names, .on_progress = {}});
  if (!found.refusals.empty()) {
    std::printf("%4d  refused: %s\n", seed, found.refusals.front().c_str());
    return;
  }
  const PoseError least = least_error(found, truth, swarm, seed);
  apply(found_constants(found), found, swarm);
  const PoseError after = replayed_error(swarm);
  std::printf("%4d  %7.4f %6.3f  %7.4f %6.3f  %7.4f %6.3f  %7.4f %6.3f  %5.2f\n", seed,
              before.position_m, before.rotation_deg, after.position_m, after.rotation_deg,
              least.position_m, least.rotation_deg, best.position_m, best.rotation_deg,
              nees_of(found, truth));
  std::fflush(stdout);
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const int seeds = words.empty() ? 5 : std::stoi(words[0]);
  const int first = words.size() > 1 ? std::stoi(words[1]) : 1;
  std::printf(
      "seed  before m    deg    after m    deg    least m    deg     true m    deg   nees\n");
  for (int seed = first; seed < first + seeds; ++seed) crepes::study::run(seed);
}
