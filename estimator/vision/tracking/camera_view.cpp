#include "estimator/vision/tracking/camera_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace crepes {
namespace {

/// Radius over distance. A ring of radius r at distance d appears as the pixels A q about its
/// center, |q| = 1, to first order of r / d. Across the line of sight that is J A q, and the
/// longest of these vectors is that of the diameter which is not foreshortened: r / d.
double ring_tan(const RingEllipse& ring, const CameraModel::UnprojectionJacobian& J) {
  if (!ring.is_known()) return 0.0;
  Eigen::Matrix2d M;
  M << ring.uu_px2, ring.uv_px2, ring.uv_px2, ring.vv_px2;
  const Eigen::Matrix2d G = J.transpose() * J;
  // The eigenvalues of J M J^T that are not 0 are those of M G.
  const double half_trace = 0.5 * (M * G).trace();
  const double determinant = M.determinant() * G.determinant();
  const double largest =
      half_trace + std::sqrt(std::max(0.0, half_trace * half_trace - determinant));
  return std::isfinite(largest) ? std::sqrt(largest) : 0.0;
}

}  // namespace

CameraView::CameraView(const CameraCalibration& camera, CameraModel model)
    : model_(std::move(model)),
      T_B_C_(camera.T_cam_imu.inverse()),
      T_C_B_(camera.T_cam_imu),
      timeshift_(from_seconds(camera.timeshift_cam_imu)),
      row_delay_s_(1e-6 * camera.rolling_shutter_us_per_row) {}

/// The middle of the exposure of a row. The stamp is that of the middle row.
Timestamp CameraView::row_exposure(double v_px, Timestamp stamp) const {
  return stamp + from_seconds(row_delay_s_ * (v_px - 0.5 * (model_.height() - 1)));
}

std::optional<Eigen::Vector2d> CameraView::pixel_of(const Eigen::Vector3d& u_B) const {
  const auto uv = model_.project(T_C_B_.q * u_B);
  return uv && model_.contains(*uv) ? uv : std::nullopt;
}

Timestamp CameraView::exposure_of(const Eigen::Vector3d& u_B, Timestamp stamp) const {
  if (row_delay_s_ == 0.0) return stamp;
  const auto uv = pixel_of(u_B);
  return uv ? row_exposure(uv->y(), stamp) : stamp;
}

/// u = R_B(stamp)_B(exposed) u_B(exposed).
std::size_t CameraView::unproject(const SpotFrame& frame, Timestamp stamp, const ImuHistory& imu,
                                  std::size_t most, std::vector<LightSighting>& sightings) const {
  std::size_t refused = 0;
  sightings.clear();
  for (const Spot& spot : frame.spots) {
    CameraModel::UnprojectionJacobian J;
    const auto u_C = model_.unproject({spot.u_px, spot.v_px}, &J);
    if (!u_C || !(spot.area_px2 >= 0.0) || !std::isfinite(spot.area_px2) ||
        sightings.size() >= most) {
      ++refused;
      continue;
    }
    const double px_rad = std::sqrt(0.5 * J.squaredNorm());
    const double tangent = ring_tan(spot.ring, J);
    sightings.push_back({.u_B = T_B_C_.q * *u_C,
                         .radius_rad = std::sqrt(spot.area_px2 / std::numbers::pi) * px_rad,
                         .px_rad = px_rad,
                         .peak = spot.peak,
                         .ring_leds = tangent > 0.0 ? spot.ring.leds : 0,
                         .ring_tan = tangent,
                         .ring_sigma = spot.ring.sigma,
                         .exposed = row_exposure(spot.v_px, stamp)});
    LightSighting& sighting = sightings.back();
    if (row_delay_s_ != 0.0 && !imu.empty())
      sighting.u_B = imu.rotation(stamp, sighting.exposed) * sighting.u_B;
  }
  // Not the order of the file but of the world: ties are broken alike for every order of spots.
  std::sort(sightings.begin(), sightings.end(), [](const LightSighting& a, const LightSighting& b) {
    return std::lexicographical_compare(a.u_B.begin(), a.u_B.end(), b.u_B.begin(), b.u_B.end());
  });
  return refused;
}

}  // namespace crepes
