#include "daemon/ctl/view/field_of_view.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/ctl/view/view_json.hpp"
#include "estimator/vision/camera_model.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

constexpr int kStepsPerSide = 10;

/// Pixels around the picture, clockwise from the upper left corner.
std::vector<Eigen::Vector2d> border_of(const CameraModel& model) {
  const std::vector<Eigen::Vector2d> corners{{0.0, 0.0},
                                             {model.width() - 1.0, 0.0},
                                             {model.width() - 1.0, model.height() - 1.0},
                                             {0.0, model.height() - 1.0}};
  std::vector<Eigen::Vector2d> border;
  for (std::size_t side = 0; side < corners.size(); ++side) {
    const Eigen::Vector2d& from = corners[side];
    const Eigen::Vector2d& to = corners[(side + 1) % corners.size()];
    for (int i = 0; i < kStepsPerSide; ++i)
      border.emplace_back(from + (to - from) * i / double{kStepsPerSide});
  }
  return border;
}

/// The direction of the last pixel from the middle of the picture to `uv` that the lens can see.
Eigen::Vector3d outermost(const CameraModel& model, const Eigen::Vector2d& uv) {
  if (const auto u_C = model.unproject(uv)) return *u_C;
  const Eigen::Vector2d middle{0.5 * model.width(), 0.5 * model.height()};
  Eigen::Vector3d seen = Eigen::Vector3d::UnitZ();
  double inside = 0.0;
  double outside = 1.0;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const double share = 0.5 * (inside + outside);
    const auto u_C = model.unproject(middle + share * (uv - middle));
    (u_C ? inside : outside) = share;
    if (u_C) seen = *u_C;
  }
  return seen;
}

}  // namespace

std::string field_of_view_json(const CameraCalibration& camera) {
  const auto model = CameraModel::from(camera);
  if (!model) return "null";
  const Pose T_B_C = camera.T_cam_imu.inverse();
  std::string border;
  for (const Eigen::Vector2d& uv : border_of(*model))
    border += (border.empty() ? "" : ",") + vector_row(T_B_C.q * outermost(*model, uv));
  return fmt::format(R"({{"name":{},"p":{},"border":[{}]}})", dump(OrderedJson(camera.name)),
                     vector_row(T_B_C.p), border);
}

}  // namespace crepes
