#include "net/subscription/fault_text.hpp"

#include <fmt/core.h>

#include <cmath>

#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kSystematic = 0.1;  // m; less is no reason to refuse ranges

}  // namespace

std::string text_of(const TeamFault& fault) {
  switch (fault.kind) {
    case TeamFault::Kind::kCameraTurned:
      return fmt::format(
          "its camera is turned by {:.2f} +- {:.2f} deg against its calibration; calibrate it "
          "again",
          kDegPerRad * fault.size, kDegPerRad * fault.sigma);
    case TeamFault::Kind::kCameraRefused:
      return "its camera contradicts what the others see and is left out; check its calibration "
             "and its clock";
    case TeamFault::Kind::kRanges:
      if (std::abs(fault.size) < kSystematic)
        return "its ranges contradict the others' and are left out; check uwb_id in swarm.members";
      return fmt::format(
          "its ranges are {:.2f} m too {} and are left out; check its antenna delay, and uwb_id in "
          "swarm.members",
          std::abs(fault.size), fault.size > 0.0 ? "long" : "short");
    case TeamFault::Kind::kClock:
      return fmt::format(
          "its clock is {:.0f} +- {:.0f} ms {} of the others'; check what stamps its sensors",
          1e3 * std::abs(fault.size), 1e3 * fault.sigma, fault.size > 0.0 ? "ahead" : "behind");
    case TeamFault::Kind::kGyro:
      return fmt::format(
          "its gyroscope reads rates {:.1f} deg/s off what its camera shows; check the IMU's "
          "range and unit",
          kDegPerRad * fault.size);
    case TeamFault::Kind::kEstimates:
      return fmt::format(
          "the poses that it broadcasts are {:.2f} m off and are not used; look at its status",
          fault.size);
    case TeamFault::Kind::kModule:
      return fmt::format(
          "its UWB module measures the distance to the module of its own id, {:.2f} m, which "
          "another robot carries; ranges to it are not used; set the module's id, or uwb_id in "
          "swarm.members",
          fault.size);
    case TeamFault::Kind::kMounting:
      return fmt::format(
          "its IMU is turned by about {:.0f} deg against its cameras and is not used; correct "
          "imu.T_body_imu, or T_cam_imu of its cameras, and restart it",
          kDegPerRad * fault.size);
  }
  return {};
}

}  // namespace crepes
