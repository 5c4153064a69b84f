#include "tests/study/pair_sightings.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/contract.hpp"
#include "estimator/vision/camera_model.hpp"

namespace crepes::study {
namespace {

constexpr double kNearest = 6.0;        // px; calibration errors are a pixel or two
constexpr double kFarthestRange = 0.4;  // m; a range further off is an outlier

/// The true T_from_to at an instant of true time.
std::optional<Pose> relative(const SwarmTruth& truth, RobotId from, RobotId to, double true_s) {
  const auto T_W_from = truth.pose(from, true_s);
  const auto T_W_to = truth.pose(to, true_s);
  if (!T_W_from || !T_W_to) return std::nullopt;
  return T_W_from->inverse() * *T_W_to;
}

void add_sightings(const Swarm& swarm, const RobotRecording& observer, RobotId to,
                   std::size_t camera, std::vector<Sighting>& sightings) {
  const CameraCalibration& config = observer.config.cameras.at(camera).calibration;
  const CameraModel model = CameraModel::from(config).value();
  const Pose T_B_C = config.T_cam_imu.inverse();
  const Eigen::Vector3d& p_to_led = member_of(swarm.dataset, to).p_body_led;
  for (const SpotFrame& frame : observer.cameras.at(camera).spots) {
    const double true_s =
        observer.robot.clock.true_s(frame.stamp + from_seconds(config.timeshift_cam_imu));
    const auto T_B_N = relative(swarm.truth, observer.robot.id, to, true_s);
    if (!T_B_N) continue;
    const auto expected = model.project(config.T_cam_imu * (*T_B_N * p_to_led));
    if (!expected || frame.spots.empty()) continue;
    const auto offset = [&](const Spot& spot) {
      return Eigen::Vector2d(Eigen::Vector2d(spot.u_px, spot.v_px) - *expected);
    };
    const auto nearest = std::min_element(
        frame.spots.begin(), frame.spots.end(),
        [&](const Spot& a, const Spot& b) { return offset(a).norm() < offset(b).norm(); });
    if (offset(*nearest).norm() > kNearest) continue;
    Sighting sighting{
        .true_s = true_s, .u_by_px = {}, .p_body_camera = T_B_C.p, .residual_px = offset(*nearest)};
    CameraModel::UnprojectionJacobian u_by_px;
    if (!model.unproject({nearest->u_px, nearest->v_px}, &u_by_px)) continue;
    sighting.u_by_px = T_B_C.R() * u_by_px;
    sightings.push_back(sighting);
  }
}

}  // namespace

const RobotRecording& recording_of(const SwarmDataset& dataset, RobotId robot) {
  const auto found = std::find_if(dataset.robots.begin(), dataset.robots.end(),
                                  [&](const RobotRecording& r) { return r.robot.id == robot; });
  CREPES_EXPECT(found != dataset.robots.end(), "no such robot in the data set");
  return *found;
}

const MemberConfig& member_of(const SwarmDataset& dataset, RobotId robot) {
  const auto& members = dataset.robots.front().config.swarm.members;
  const auto found = std::find_if(members.begin(), members.end(),
                                  [&](const MemberConfig& m) { return m.id == robot; });
  CREPES_EXPECT(found != members.end(), "no such member of the swarm");
  return *found;
}

double bearing_sigma_px(const std::vector<Sighting>& sightings) {
  double sum = 0.0;
  for (std::size_t i = 1; i < sightings.size(); ++i)
    sum += (sightings[i].residual_px - sightings[i - 1].residual_px).squaredNorm();
  return std::sqrt(sum /
                   (4.0 * std::max<double>(1.0, static_cast<double>(sightings.size()) - 1.0)));
}

double range_sigma_m(const std::vector<Ranging>& ranges) {
  double sum = 0.0;
  for (std::size_t i = 1; i < ranges.size(); ++i)
    sum += std::pow(ranges[i].residual_m - ranges[i - 1].residual_m, 2);
  return std::sqrt(sum / (2.0 * std::max<double>(1.0, static_cast<double>(ranges.size()) - 1.0)));
}

OneWay true_sightings(const Swarm& swarm, RobotId from, RobotId to) {
  const RobotRecording& observer = recording_of(swarm.dataset, from);
  OneWay all;
  for (std::size_t k = 0; k < observer.cameras.size(); ++k)
    add_sightings(swarm, observer, to, k, all.sightings);
  std::stable_sort(all.sightings.begin(), all.sightings.end(),
                   [](const Sighting& a, const Sighting& b) { return a.true_s < b.true_s; });

  const double late_path_db = observer.config.uwb.noise.late_path_db;
  for (const UwbRange& range : observer.ranges) {
    if (range.neighbor != to || range.received_dbm - range.first_path_dbm > late_path_db) continue;
    const double true_s = observer.robot.clock.true_s(range.stamp);
    const auto T_B_N = relative(swarm.truth, from, to, true_s);
    if (!T_B_N) continue;
    const double distance = (*T_B_N * member_of(swarm.dataset, to).p_body_uwb -
                             member_of(swarm.dataset, from).p_body_uwb)
                                .norm();
    if (std::abs(range.range_m - distance) > kFarthestRange) continue;
    all.ranges.push_back({true_s, range.range_m - distance});
  }
  return all;
}

}  // namespace crepes::study
