#include "daemon/ctl/dataset/truth.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "drivers/dataset/csv_file.hpp"

namespace crepes {
namespace {

constexpr std::size_t kTruthColumns = 11;

bool read_sample(const CsvFile& csv, TruthSample& sample, DatasetFaults& faults) {
  std::array<double, kTruthColumns> x{};
  for (std::size_t i = 0; i < kTruthColumns; ++i)
    if (!csv.read(i, x.at(i), faults)) return false;
  sample.t_s = x[0];
  sample.T_W_B = {{x[1], x[2], x[3]}, {x[4], x[5], x[6], x[7]}};
  constexpr double kUnitTolerance = 1e-3;
  if (std::abs(sample.T_W_B.q.norm() - 1.0) > kUnitTolerance) {
    faults.add(csv.path(), csv.line(), "quaternion not of unit length");
    return false;
  }
  sample.T_W_B.q.normalize();
  return true;
}

}  // namespace

Result<Trajectory> Trajectory::load(const std::filesystem::path& file) {
  DatasetFaults faults;
  Result<CsvFile> csv = CsvFile::open(file, kTruthColumns, faults);
  if (!csv) return tl::unexpected(csv.error());
  std::vector<TruthSample> samples;
  while (csv->next(faults)) {
    TruthSample sample;
    if (!read_sample(*csv, sample, faults)) continue;
    if (!samples.empty() && sample.t_s <= samples.back().t_s) {
      faults.add(file, csv->line(), "time does not increase");
    } else {
      samples.push_back(sample);
    }
  }
  if (!faults.empty()) return fail(ErrorCode::kFormat, faults.list().front());
  if (samples.empty()) return fail(ErrorCode::kFormat, file.string() + ": has no rows");
  return Trajectory(std::move(samples));
}

std::optional<Pose> Trajectory::at(double true_s) const {
  if (samples_.empty() || true_s < samples_.front().t_s || true_s > samples_.back().t_s)
    return std::nullopt;
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), true_s,
                       [](const TruthSample& sample, double t) { return sample.t_s < t; });
  if (after == samples_.begin()) return after->T_W_B;
  const auto before = std::prev(after);
  const double part = (true_s - before->t_s) / (after->t_s - before->t_s);
  return Pose{before->T_W_B.p + part * (after->T_W_B.p - before->T_W_B.p),
              before->T_W_B.q.slerp(part, after->T_W_B.q)};
}

Result<SwarmTruth> SwarmTruth::load(const std::filesystem::path& dir,
                                    const SwarmManifest& manifest) {
  std::map<RobotId, Robot> robots;
  for (const SwarmRobot& robot : manifest.robots) {
    Result<Trajectory> path = Trajectory::load(dir / "truth" / (robot.name + ".csv"));
    if (!path) return tl::unexpected(path.error());
    robots.emplace(robot.id, Robot{robot.clock, std::move(*path)});
  }
  return SwarmTruth(std::move(robots));
}

std::optional<Pose> SwarmTruth::pose(RobotId robot, double true_s) const {
  const auto found = robots_.find(robot);
  return found == robots_.end() ? std::nullopt : found->second.path.at(true_s);
}

std::optional<Pose> SwarmTruth::relative(RobotId observer, RobotId neighbor,
                                         Timestamp local) const {
  const auto B = robots_.find(observer);
  if (B == robots_.end()) return std::nullopt;
  const double true_s = B->second.clock.true_s(local);
  const std::optional<Pose> T_W_B = pose(observer, true_s);
  const std::optional<Pose> T_W_N = pose(neighbor, true_s);
  if (!T_W_B || !T_W_N) return std::nullopt;
  return T_W_B->inverse() * *T_W_N;
}

double bearing_error_rad(const Bearing& bearing, const Pose& T_B_N,
                         const Eigen::Vector3d& p_body_led) {
  const Eigen::Vector3d ray = T_B_N * p_body_led - bearing.p_B_C;
  return std::atan2(bearing.u_B.cross(ray).norm(), bearing.u_B.dot(ray));
}

}  // namespace crepes
