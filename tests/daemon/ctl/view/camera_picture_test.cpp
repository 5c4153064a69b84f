#include "daemon/ctl/view/camera_picture.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>

namespace crepes::camera_picture_test {
namespace {

using Json = nlohmann::json;

/// A pinhole that looks ahead, and robot 2 with its board 0.2 m above its IMU.
Config config_of_one_camera() {
  Config config;
  CameraConfig camera;
  camera.calibration.name = "cam0";
  camera.calibration.intrinsics = {0, 0, 100, 100, 100, 50};
  camera.calibration.resolution = {201, 101};
  camera.calibration.timeshift_cam_imu = 0.01;
  Eigen::Matrix3d R_B_C;
  R_B_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.calibration.T_cam_imu = Pose{{0, 0, 0}, Eigen::Quaterniond(R_B_C)}.inverse();
  camera.device.light.exposure_us = 500.0;
  config.cameras = {camera};
  MemberConfig member;
  member.id = RobotId{2};
  member.p_body_led = {0, 0, 0.2};
  config.swarm.members = {member};
  config.view.control = true;
  return config;
}

const std::string kHead =
    R"({"camera":0,"t_ns":"1000000000","width":4,"height":2,"scale":2,"background":3,)"
    R"("threshold":20,"saturated":0.1,"hot_pixels":1,"hot":[[1,1]],"spots":[[5,6,7,200]],)"
    R"("robots":[[2,1,0,0.1]]})";

PoseHistory two_metres_ahead() {
  PoseHistory poses;
  NeighborPose pose;
  pose.neighbor = RobotId{2};
  pose.stamp = Timestamp{} + std::chrono::milliseconds{1010};
  pose.T_B_N.pose.p = {2, 0, 0};
  poses.add(pose);
  return poses;
}

TEST(CameraPicture, SaysWhereRobotsAreAndWhereTheyShouldBe) {
  const auto text = picture_json(kHead + "\n" + std::string(8, '\7'), 0, config_of_one_camera(),
                                 two_metres_ahead());
  ASSERT_TRUE(text) << text.error().message;
  const Json json = Json::parse(*text);

  EXPECT_EQ(json["robots"], Json::parse("[[2,100.0,40.0]]"));
  EXPECT_EQ(json["predicted"], Json::parse("[[2,100.0,40.0]]"));
  EXPECT_EQ(json["spots"], Json::parse("[[5,6,7,200]]"));
  EXPECT_EQ(json["jpeg"].get<std::string>().substr(0, 4), "/9j/");  // the start of any JPEG
}

TEST(CameraPicture, RefusesWhatIsNone) {
  const Config config = config_of_one_camera();
  for (const std::string& look :
       {std::string(), std::string("{}\n"), kHead, kHead + "\n" + std::string(7, 'x'),
        std::string("[1]\nx"), std::string("{\"camera\":9}\nx")})
    EXPECT_FALSE(picture_json(look, 0, config, {})) << look;
  const std::string of_camera_0 = kHead + "\n" + std::string(8, '\7');
  EXPECT_TRUE(picture_json(of_camera_0, 0, config, {}));
  EXPECT_FALSE(picture_json(of_camera_0, 1, config, {}));
}

TEST(CameraPicture, ShowsTheLightAndWhoMayChangeIt) {
  Config config = config_of_one_camera();
  const Json json = Json::parse(cameras_json(config, /*control=*/true, ""));
  EXPECT_EQ(json["cameras"][0]["exposure_us"], 500.0);
  EXPECT_FALSE(json["cameras"][0].contains("gain"));
  EXPECT_TRUE(json["control"].get<bool>());
  EXPECT_FALSE(json.contains("reason"));
  EXPECT_FALSE(Json::parse(cameras_json(config, /*control=*/false, ""))["control"].get<bool>());
  config.view.control = false;
  EXPECT_FALSE(Json::parse(cameras_json(config, /*control=*/true, "why"))["control"].get<bool>());
}

}  // namespace
}  // namespace crepes::camera_picture_test
