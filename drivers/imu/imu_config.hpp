/// Settings: the inertial sensor.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

#include "estimator/core/pose.hpp"
#include "estimator/core/sensor_noise.hpp"
#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// What an inertial sensor sends.
enum class ImuProtocol : std::uint8_t {
  kAuto,
  kWitMotion,
  kHipnuc,
  kXsens,
  kMavlink,
  kVectorNav,
  kMicroStrain,
  kWitMotionBle,
  kIio
};
inline constexpr std::array kImuProtocols{Choice{"auto", ImuProtocol::kAuto},
                                          Choice{"witmotion", ImuProtocol::kWitMotion},
                                          Choice{"hipnuc", ImuProtocol::kHipnuc},
                                          Choice{"xsens", ImuProtocol::kXsens},
                                          Choice{"mavlink", ImuProtocol::kMavlink},
                                          Choice{"vectornav", ImuProtocol::kVectorNav},
                                          Choice{"microstrain", ImuProtocol::kMicroStrain},
                                          Choice{"witmotion_ble", ImuProtocol::kWitMotionBle},
                                          Choice{"iio", ImuProtocol::kIio}};

/// What makes of a sensor's reading v the true T K (v - b), as imu_tk calibrates it.
struct TriadConfig {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Eigen::Matrix3d misalignment = Eigen::Matrix3d::Identity();

  [[nodiscard]] bool operator==(const TriadConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("bias", bias, "b, subtracted first, in the unit of the readings");
    v.field("scale", scale, Bounds{0.5, 2}, "the diagonal of K");
    v.field("misalignment", misalignment, Bounds{-2, 2}, "T, 3 rows of 3 numbers");
  }
};

/// The device, and how readings become the body's.
struct ImuDeviceConfig {
  std::string port;
  int baud = 115200;
  ImuProtocol protocol = ImuProtocol::kAuto;
  Pose T_body_imu;
  TriadConfig accelerometer;
  TriadConfig gyroscope;

  [[nodiscard]] bool operator==(const ImuDeviceConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field(
        "port", port,
        "serial device, best under /dev/serial/by-id; iio: names of its devices, or omitted: the "
        "only IMU");
    v.field("baud", baud, Bounds{1200, 4000000}, "bits per second");
    v.choice("protocol", protocol, kImuProtocols,
             "protocol of the device; auto: detect it; iio: an IMU that the Linux kernel drives");
    v.field("T_body_imu", T_body_imu,
            "4x4, rotates the sensor's axes to the body's; no translation: the body's origin is "
            "the IMU");
    v.section("accelerometer", accelerometer,
              "correction T K (v - b) in the sensor's axes [m/s^2]");
    v.section("gyroscope", gyroscope, "correction T K (v - b) in the sensor's axes [rad/s]");
  }
};

struct ImuConfig {
  ImuNoise noise;
  ImuDeviceConfig device;

  [[nodiscard]] bool operator==(const ImuConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    noise.visit(v);
    device.visit(v);
  }
};

}  // namespace crepes
