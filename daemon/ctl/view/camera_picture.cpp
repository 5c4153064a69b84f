#include "daemon/ctl/view/camera_picture.hpp"

#include <sodium.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

#include "daemon/ctl/view/field_of_view.hpp"
#include "drivers/base/number_text.hpp"
#include "estimator/vision/camera_model.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kQuality = 80;  // of the JPEG, percent

Error no_picture() { return {ErrorCode::kFormat, "the daemon's picture is none"}; }

Result<std::string> jpeg_of(const std::string& grey, int width, int height) {
  // OpenCV only reads it.
  const cv::Mat image(height, width, CV_8UC1, const_cast<char*>(grey.data()));  // NOLINT
  std::vector<std::uint8_t> jpeg;
  try {
    cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::kIo, std::string("JPEG: ") + e.what());
  }
  constexpr int kVariant = sodium_base64_VARIANT_ORIGINAL;
  std::string text(sodium_base64_encoded_len(jpeg.size(), kVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), jpeg.data(), jpeg.size(), kVariant);
  text.resize(text.size() - 1);  // the zero at its end
  return text;
}

Json row_of(const Json& id, const Eigen::Vector2d& uv) {
  const auto tenth = [](double px) { return std::round(10.0 * px) / 10.0; };
  return Json::array({id, tenth(uv.x()), tenth(uv.y())});
}

/// From directions in the body to pixels.
Json pixels_of(const Json& robots, const CameraModel& model, const Pose& T_C_B) {
  Json rows = Json::array();
  for (const Json& robot : robots) {
    if (robot.size() != 4) continue;
    const Eigen::Vector3d u_B(robot[1].get<double>(), robot[2].get<double>(),
                              robot[3].get<double>());
    if (const auto uv = model.project(T_C_B.q * u_B)) rows.push_back(row_of(robot[0], *uv));
  }
  return rows;
}

Json predicted_places(const Config& config, const CameraModel& model,
                      const CameraCalibration& camera, Timestamp stamp, const PoseHistory& poses) {
  Json rows = Json::array();
  for (const MemberConfig& member : config.swarm.members) {
    const auto T_B_N = poses.at(member.id, stamp + from_seconds(camera.timeshift_cam_imu));
    if (!T_B_N) continue;
    const Eigen::Vector3d p_C = camera.T_cam_imu * (*T_B_N * member.p_body_led);
    const auto uv = model.project(p_C);
    if (uv && model.contains(*uv)) rows.push_back(row_of(member.id.value, *uv));
  }
  return rows;
}

Result<std::string> with_picture(Json head, const std::string& grey, std::size_t index,
                                 const Config& config, const PoseHistory& poses) {
  const int width = head.at("width").get<int>();
  const int height = head.at("height").get<int>();
  std::int64_t t_ns = 0;
  if (!parse_number(head.at("t_ns").get<std::string>(), t_ns).empty() || width <= 0 ||
      height <= 0 ||
      grey.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) ||
      head.at("camera").get<std::size_t>() != index || index >= config.cameras.size())
    return tl::unexpected(no_picture());
  const CameraCalibration& camera = config.cameras[index].calibration;
  const auto model = CameraModel::from(camera);
  if (!model) return tl::unexpected(model.error());
  head["robots"] = pixels_of(head.at("robots"), *model, camera.T_cam_imu);
  head["predicted"] = predicted_places(config, *model, camera, Timestamp{Duration{t_ns}}, poses);
  auto jpeg = jpeg_of(grey, width, height);
  if (!jpeg) return tl::unexpected(jpeg.error());
  head["jpeg"] = std::move(*jpeg);
  return dump(head);
}

}  // namespace

Result<std::string> picture_json(const std::string& look, std::size_t camera, const Config& config,
                                 const PoseHistory& poses) {
  const std::size_t end = look.find('\n');
  if (end == std::string::npos) return tl::unexpected(no_picture());
  try {
    return with_picture(Json::parse(look.substr(0, end)), look.substr(end + 1), camera, config,
                        poses);
  } catch (const nlohmann::json::exception&) {
    return tl::unexpected(no_picture());
  }
}

std::string cameras_json(const Config& config, bool control, const std::string& reason) {
  Json json{{"cameras", Json::array()},
            {"threshold", config.vision.threshold},
            {"control", control && config.view.control}};
  if (!reason.empty()) json["reason"] = reason;
  for (const CameraConfig& camera : config.cameras) {
    Json one{{"name", camera.calibration.name}};
    const CameraLight& light = camera.device.light;
    if (light.exposure_us) one["exposure_us"] = *light.exposure_us;
    if (light.gain) one["gain"] = *light.gain;
    one["field"] = Json::parse(field_of_view_json(camera.calibration));
    json["cameras"].push_back(std::move(one));
  }
  return dump(json);
}

}  // namespace crepes
