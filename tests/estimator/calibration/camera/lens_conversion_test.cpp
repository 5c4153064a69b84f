#include "estimator/calibration/camera/lens_conversion.hpp"

#include <gtest/gtest.h>

#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/camera_model.hpp"

namespace crepes::lens_conversion_test {
namespace {

CameraModel kannala_brandt(const KannalaBrandtFit& fit) {
  CameraCalibration config;
  config.name = "cam0";
  config.camera_model = CameraModelKind::kPinhole;
  config.distortion_model = DistortionModel::kEquidistant;
  config.intrinsics.assign(fit.pinhole.begin(), fit.pinhole.end());
  config.distortion_coeffs.assign(fit.k.begin(), fit.k.end());
  config.resolution = {1280, 1024};
  return CameraModel::from(config).value();
}

TEST(LensConversion, SeesTheSameDirectionsAsTheDoubleSphereWithinWhatItSays) {
  LensVector lens;
  lens << -0.151, 0.599, 321.5, 321.6, 627.6, 504.2;

  const KannalaBrandtFit fit = to_kannala_brandt(lens, 1280, 1024);

  EXPECT_LT(fit.rms_px, 0.1);
  const CameraModel model = kannala_brandt(fit);
  for (double u = 2.0; u < 1280.0; u += 91.0) {
    for (double v = 2.0; v < 1024.0; v += 73.0) {
      const auto u_C = direction_of(lens, {u, v});
      if (!u_C) continue;
      const auto seen = model.project(*u_C);
      ASSERT_TRUE(seen) << u << " " << v;
      EXPECT_LT((*seen - Eigen::Vector2d(u, v)).norm(), 1.02 * fit.max_px + 1e-9) << u << " " << v;
    }
  }
}

TEST(LensConversion, KeepsTheCenterAndTheShapeOfPixels) {
  const LensVector lens = generic_lens(1280, 1024, radians(185.0));

  const KannalaBrandtFit fit = to_kannala_brandt(lens, 1280, 1024);

  EXPECT_EQ(fit.pinhole[2], lens[4]);
  EXPECT_EQ(fit.pinhole[3], lens[5]);
  EXPECT_NEAR(fit.pinhole[0], fit.pinhole[1], 1e-12);
  EXPECT_GE(fit.max_px, fit.rms_px);
}

}  // namespace
}  // namespace crepes::lens_conversion_test
