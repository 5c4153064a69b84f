/// imu_fault_study: damages single inertial samples of recordings, and prints how much worse the
/// poses become in the two seconds after each.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"
#include "tests/study/pair_sightings.hpp"

namespace crepes::study {
namespace {

constexpr double kSettled = 6.0;  // s; poses before are not used
constexpr double kWindow = 2.0;   // s after a damaged sample
constexpr double kSpacing = 3.0;  // s between damaged samples of a replay

/// What happens to one sample of a sensor; `axis` varies from instant to instant.
struct Damage {
  const char* name;
  bool gyro;
  Eigen::Vector3d (*apply)(const Eigen::Vector3d& value, int axis);
};

template <int kThousandths>
Eigen::Vector3d spiked(const Eigen::Vector3d& value, int axis) {
  Eigen::Vector3d read = value;
  read(axis) = 1e-3 * kThousandths;
  return read;
}

Eigen::Vector3d in_degrees(const Eigen::Vector3d& value, int) { return kDegPerRad * value; }
Eigen::Vector3d in_g(const Eigen::Vector3d& value, int) { return value / kGravityMps2; }
Eigen::Vector3d swapped(const Eigen::Vector3d& value, int axis) {
  return axis % 2 == 0 ? Eigen::Vector3d(value.y(), value.z(), value.x())
                       : Eigen::Vector3d(value.z(), value.x(), value.y());
}

constexpr std::array kDamages{
    Damage{"gyro, end of range", true, spiked<34'907>},
    Damage{"gyro, deg/s", true, in_degrees},
    Damage{"gyro, 5 rad/s", true, spiked<5'000>},
    Damage{"gyro, axes swapped", true, swapped},
    Damage{"accel, end of range", false, spiked<156'906>},
    Damage{"accel, g", false, in_g},
    Damage{"accel, axes swapped", false, swapped},
};

/// One pose against the truth.
struct Outcome {
  Timestamp stamp{};
  double error_m = 0.0;
  double error_rad = 0.0;
  bool beyond_5_sigma = false;  ///< position; Mahalanobis^2 > 35
};

/// Poses by observer, neighbor and the instant of publication.
using Outcomes = std::map<std::tuple<RobotId, RobotId, Timestamp>, Outcome>;

Result<Outcomes> replay(const Swarm& swarm, const SwarmDataset& dataset, bool graph) {
  Outcomes outcomes;
  ReplayOptions options;
  options.graph = graph;
  ReplaySinks sinks;
  sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
    const auto truth = swarm.truth.relative(observer, pose.neighbor, pose.stamp);
    if (!truth) return;
    const Vector6d error = pose_difference(pose.T_B_N.pose, *truth);
    const Eigen::Vector3d p = error.head<3>();
    const Eigen::Matrix3d P = pose.T_B_N.covariance.topLeftCorner<3, 3>();
    outcomes[{observer, pose.neighbor, pose.published}] = {
        .stamp = pose.stamp,
        .error_m = p.norm(),
        .error_rad = error.tail<3>().norm(),
        .beyond_5_sigma = !(p.dot(P.llt().solve(p)) <= 35.0)};
  };
  const auto report = replay_dataset(dataset, std::nullopt, options, sinks);
  if (!report) return tl::unexpected(report.error());
  return outcomes;
}

/// A damaged sample: whose, and when in true time.
struct Instant {
  RobotId robot{};
  double true_s = 0.0;
};

/// Sums over instants.
struct Tally {
  int instants = 0;
  double square_m = 0.0;  ///< summed over poses
  double square_rad = 0.0;
  double reference_square_m = 0.0;
  double reference_square_rad = 0.0;
  std::size_t poses = 0;
  std::size_t reference_poses = 0;
  std::size_t beyond = 0;   ///< poses beyond 5 sigma that were not without the damage
  std::size_t missing = 0;  ///< poses that there were without the damage
  int lost = 0;             ///< instants after which there was no pose at the end of the window
  double worst_m = 0.0;
  double worst_ratio = 0.0;  ///< of an instant's RMSE
};

void add(const Instant& instant, const Swarm& swarm, const Outcomes& reference,
         const Outcomes& damaged, Tally& tally) {
  ++tally.instants;
  double square = 0.0;
  double reference_square = 0.0;
  std::size_t poses = 0;
  std::size_t reference_poses = 0;
  for (const auto& [key, before] : reference) {
    const auto& [observer, neighbor, published] = key;
    if (observer != instant.robot && neighbor != instant.robot) continue;
    const RobotClock& clock = recording_of(swarm.dataset, observer).robot.clock;
    const Timestamp begin = clock.local(instant.true_s - 0.02);
    const Timestamp end = clock.local(instant.true_s + kWindow);
    if (published < begin || published > end) continue;
    ++reference_poses;
    reference_square += before.error_m * before.error_m;
    tally.reference_square_rad += before.error_rad * before.error_rad;
    const auto found = damaged.find(key);
    if (found == damaged.end()) {
      ++tally.missing;
      if (end - published < std::chrono::milliseconds{30}) ++tally.lost;
      continue;
    }
    const Outcome& after = found->second;
    ++poses;
    square += after.error_m * after.error_m;
    tally.square_rad += after.error_rad * after.error_rad;
    tally.beyond += after.beyond_5_sigma && !before.beyond_5_sigma ? 1 : 0;
    tally.worst_m = std::max(tally.worst_m, after.error_m);
  }
  tally.square_m += square;
  tally.reference_square_m += reference_square;
  tally.poses += poses;
  tally.reference_poses += reference_poses;
  if (poses > 0 && reference_square > 0.0)
    tally.worst_ratio = std::max(
        tally.worst_ratio, std::sqrt(square / static_cast<double>(poses) /
                                     (reference_square / static_cast<double>(reference_poses))));
}

double root_mean(double square, std::size_t n) {
  return std::sqrt(square / static_cast<double>(std::max<std::size_t>(n, 1)));
}

std::vector<std::string> row_of(const std::string& name, const Tally& t) {
  const double rmse_m = root_mean(t.square_m, t.poses);
  const double rmse_rad = root_mean(t.square_rad, t.poses);
  const double reference_m = root_mean(t.reference_square_m, t.reference_poses);
  const double reference_rad = root_mean(t.reference_square_rad, t.reference_poses);
  return {name,
          std::to_string(t.instants),
          fixed(reference_m, 4),
          fixed(rmse_m, 4),
          fixed(rmse_m / reference_m, 2),
          fixed(rmse_rad / reference_rad, 2),
          fixed(t.worst_ratio, 2),
          fixed(t.worst_m, 2),
          std::to_string(t.beyond),
          std::to_string(t.missing),
          std::to_string(t.lost)};
}

struct Options {
  std::vector<std::string> sets;
  int instants = 100;
  bool graph = true;
};

Result<Swarm> load(const std::string& dir) {
  auto dataset = load_swarm(dir);
  if (!dataset) return tl::unexpected(dataset.error());
  auto truth = SwarmTruth::load(dir, dataset->manifest);
  if (!truth) return tl::unexpected(truth.error());
  return Swarm{std::move(*dataset), std::move(*truth)};
}

/// Damages the robot's first sample after each instant.
SwarmDataset damaged(const SwarmDataset& dataset, const std::vector<Instant>& instants,
                     const Damage& damage, int first_axis) {
  SwarmDataset result = dataset;
  int axis = first_axis;
  for (const Instant& instant : instants) {
    for (RobotRecording& robot : result.robots) {
      if (robot.robot.id != instant.robot) continue;
      const Timestamp stamp = robot.robot.clock.local(instant.true_s);
      const auto sample = std::ranges::lower_bound(robot.imu, stamp, {}, &ImuSample::stamp);
      if (sample == robot.imu.end()) continue;
      Eigen::Vector3d& value = damage.gyro ? sample->gyro_radps : sample->accel_mps2;
      value = damage.apply(value, axis++ % 3);
    }
  }
  return result;
}

/// As many as fit into one replay, the robots in turn; `part` of `parts` shifts them.
std::vector<Instant> instants_of(const SwarmDataset& dataset, int part, int parts) {
  std::vector<Instant> instants;
  const auto& robots = dataset.manifest.robots;
  auto robot = static_cast<std::size_t>(part);
  for (double t = kSettled + kSpacing * part / parts; t + kWindow < dataset.manifest.duration_s;
       t += kSpacing)
    instants.push_back({robots[robot++ % robots.size()].id, t});
  return instants;
}

Result<std::string> study(const std::string& dir, const Options& options) {
  const auto swarm = load(dir);
  if (!swarm) return tl::unexpected(swarm.error());
  const auto reference = replay(*swarm, swarm->dataset, options.graph);
  if (!reference) return tl::unexpected(reference.error());
  const auto in_one = static_cast<int>(instants_of(swarm->dataset, 0, 1).size());
  const int parts = (options.instants + in_one - 1) / std::max(in_one, 1);
  std::vector<std::vector<std::string>> rows{{"damage", "instants", "without m", "with m",
                                              "ratio m", "ratio deg", "worst ratio", "worst m",
                                              "beyond 5 sigma", "missing", "lost"}};
  for (const Damage& damage : kDamages) {
    Tally tally;
    for (int part = 0; part < parts; ++part) {
      const std::vector<Instant> instants = instants_of(swarm->dataset, part, parts);
      const auto outcomes =
          replay(*swarm, damaged(swarm->dataset, instants, damage, part), options.graph);
      if (!outcomes) return tl::unexpected(outcomes.error());
      for (const Instant& instant : instants)
        if (tally.instants < options.instants) add(instant, *swarm, *reference, *outcomes, tally);
    }
    rows.push_back(row_of(damage.name, tally));
    std::fprintf(stderr, "%s: %s\n", dir.c_str(), damage.name);
  }
  return dir + "\n" + text_table(rows);
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  crepes::study::Options options;
  CLI::App app("imu_fault_study: what one damaged inertial sample costs");
  app.add_option("SWARM_DIR", options.sets, "recordings with truth and spots")->required();
  app.add_option("--instants", options.instants, "damaged samples of each kind")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  app.add_flag("!--no-graph", options.graph, "without the pose graph");
  CLI11_PARSE(app, argc, argv);
  for (const std::string& dir : options.sets) {
    const auto table = crepes::study::study(dir, options);
    if (!table) {
      std::fprintf(stderr, "imu_fault_study: %s\n", table.error().message.c_str());
      return 1;
    }
    std::printf("%s\n", table->c_str());
    std::fflush(stdout);
  }
  return 0;
}
