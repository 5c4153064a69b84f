#include "estimator/calibration/imu/imu_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/calibration/imu/allan_deviation.hpp"
#include "estimator/calibration/imu/stillness.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::imu_calibration_test {
namespace {

const ImuNoise kNoise;

ImuCalibration calibrated(std::uint64_t seed, const simulated::Protocol& protocol,
                          simulated::ImuErrors* truth = nullptr) {
  const simulated::ImuRecording recording = simulated::imu_protocol(seed, protocol, kNoise);
  if (truth != nullptr) *truth = recording.errors;
  return calibrate_imu(recording.samples, {.noise = kNoise, .gravity_mps2 = 9.81});
}

double rms(const Eigen::Matrix3d& M) { return M.norm() / 3.0; }

bool mentions(const std::vector<std::string>& reasons, const std::string& word) {
  for (const std::string& reason : reasons)
    if (reason.find(word) != std::string::npos) return true;
  return false;
}

TEST(ImuCalibration, FindsBiasesAndMatricesWithinWhatIsAsked) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    simulated::ImuErrors truth;
    const ImuCalibration found = calibrated(seed, {}, &truth);

    ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
    EXPECT_LT((found.accelerometer.bias - truth.accel_bias).norm() / std::sqrt(3.0), 0.0015);
    EXPECT_LT(rms(found.accelerometer.M * truth.S_accel - Eigen::Matrix3d::Identity()), 2e-4);
    EXPECT_LT((found.gyroscope.bias - truth.gyro_bias).norm() / std::sqrt(3.0), 0.0005);
    EXPECT_LT(rms(found.gyroscope.M * truth.S_gyro - Eigen::Matrix3d::Identity()), 3e-4);
  }
}

/// Every eighth turn lacks its middle 0.3 s.
std::vector<ImuSample> without_some_of_turns(const std::vector<ImuSample>& all) {
  const std::vector<Rest> rests = find_rests(all).rests;
  std::vector<ImuSample> kept;
  std::size_t from = 0;
  for (std::size_t k = 0; k + 1 < rests.size(); k += 8) {
    const std::size_t middle = (rests[k].last + rests[k + 1].first) / 2;
    kept.insert(kept.end(), all.begin() + static_cast<std::ptrdiff_t>(from),
                all.begin() + static_cast<std::ptrdiff_t>(middle - 15));
    from = middle + 15;
  }
  kept.insert(kept.end(), all.begin() + static_cast<std::ptrdiff_t>(from), all.end());
  return kept;
}

// How far the sensor turned meanwhile is unknown. All turns together were refused for it.
TEST(ImuCalibration, LeavesOutTurnsInWhichSamplesAreMissing) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const simulated::ImuRecording recording = simulated::imu_protocol(seed, {}, kNoise);
    const ImuCalibration found = calibrate_imu(without_some_of_turns(recording.samples),
                                               {.noise = kNoise, .gravity_mps2 = 9.81});

    ASSERT_TRUE(found.refusals.empty()) << seed << ": " << found.refusals.front();
    EXPECT_TRUE(mentions(found.warnings, "missing in 6 of 44 turns"));
    EXPECT_LT(rms(found.gyroscope.M * recording.errors.S_gyro - Eigen::Matrix3d::Identity()), 3e-4);
    EXPECT_LT(rms(found.gyroscope.M_sigma), 5e-4);
  }
}

TEST(ImuCalibration, KnowsItsErrors) {
  double accel_bias = 0.0;
  double gyro_bias = 0.0;
  double accel_matrix = 0.0;
  double gyro_matrix = 0.0;
  constexpr int kSeeds = 24;
  for (std::uint64_t seed = 101; seed < 101 + kSeeds; ++seed) {
    simulated::ImuErrors truth;
    const ImuCalibration found = calibrated(seed, {}, &truth);
    ASSERT_TRUE(found.refusals.empty());
    const TriadEstimate& a = found.accelerometer;
    const TriadEstimate& g = found.gyroscope;
    const Eigen::Vector3d a_bias = a.bias - truth.accel_bias;
    const Eigen::Vector3d g_bias = g.bias - truth.gyro_bias;
    accel_bias += a_bias.cwiseQuotient(a.bias_sigma).squaredNorm() / (3.0 * kSeeds);
    gyro_bias += g_bias.cwiseQuotient(g.bias_sigma).squaredNorm() / (3.0 * kSeeds);
    const Eigen::Matrix3d a_error = a.M - truth.S_accel.inverse();
    const Eigen::Matrix3d g_error = g.M - truth.S_gyro.inverse();
    gyro_matrix += g_error.cwiseQuotient(g.M_sigma).squaredNorm() / (9.0 * kSeeds);
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j)
        accel_matrix += std::pow(a_error(i, j) / a.M_sigma(i, j), 2) / (6.0 * kSeeds);
  }

  for (const double nees : {accel_bias, gyro_bias, accel_matrix, gyro_matrix}) {
    EXPECT_GT(nees, 0.5);
    EXPECT_LT(nees, 2.0);
  }
}

TEST(ImuCalibration, RefusesFourAttitudesAndSaysHowManyAreMissing) {
  const ImuCalibration found = calibrated(3, {.attitudes = 4});

  EXPECT_TRUE(mentions(found.refusals, "only 4 attitudes"));
  EXPECT_TRUE(mentions(found.refusals, "8 are missing"));
}

TEST(ImuCalibration, RefusesShakyHands) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const ImuCalibration found = calibrated(seed, {.shake_rad = 5e-4});

    EXPECT_TRUE(mentions(found.refusals, "shaky"));
  }
}

TEST(ImuCalibration, RefusesARecordingThatIsNeverAtRest) {
  const ImuCalibration found = calibrated(3, {.first_rest_s = 0.0, .shake_rad = 2e-3});

  EXPECT_TRUE(mentions(found.refusals, "never at rest"));
}

TEST(Rests, AreFoundWithoutTheTurnsBetweenThem) {
  const simulated::ImuRecording recording = simulated::imu_protocol(7, {}, kNoise);
  const RestSearch search = find_rests(recording.samples);

  EXPECT_EQ(search.rests.size(), 45U);
  EXPECT_EQ(search.shaky, 0);
  EXPECT_NEAR(search.rests.front().end_s, 30.0, 0.4);
  EXPECT_NEAR(search.gyro_sigma_radps, kNoise.gyroscope_noise_density * 10.0, 2e-4);
}

/// At 100 Hz.
std::vector<double> at_rest(std::uint64_t seed, double white, double walk, int count) {
  simulated::Dice dice(seed);
  std::vector<double> readings;
  double bias = 0.3;
  for (int i = 0; i < count; ++i) {
    bias += dice.normal(walk * 0.1);
    readings.push_back(bias + dice.normal(white * 10.0));
  }
  return readings;
}

TEST(Allan, FindsWhiteNoiseAndRandomWalkOfAnHour) {
  constexpr double kWhite = 0.0004;
  constexpr double kWalk = 0.0001;

  const auto noise = fit_noise(allan_deviation(at_rest(5, kWhite, kWalk, 360000), 0.01));

  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->white, kWhite, 0.03 * kWhite);
  EXPECT_NEAR(noise->random_walk, kWalk, 0.25 * kWalk);
}

TEST(Allan, KnowsHowFarItIsOff) {
  constexpr double kWhite = 0.0004;
  constexpr double kWalk = 0.0001;
  constexpr int kSeeds = 40;
  double white_z2 = 0.0;
  double walk_z2 = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto noise = fit_noise(allan_deviation(at_rest(seed, kWhite, kWalk, 90000), 0.01));
    ASSERT_TRUE(noise);
    white_z2 += std::pow((noise->white - kWhite) / noise->white_sigma, 2) / kSeeds;
    walk_z2 += std::pow((noise->random_walk - kWalk) / noise->random_walk_sigma, 2) / kSeeds;
  }
  for (const double z2 : {white_z2, walk_z2}) {
    EXPECT_GT(z2, 0.4);
    EXPECT_LT(z2, 2.0);
  }
}

TEST(Stillness, TellsATiltFromAWanderingBias) {
  std::vector<double> readings = at_rest(3, 0.0018, 0.0002, 60000);
  EXPECT_FALSE(first_motion_s(readings, 0.01));

  for (std::size_t i = 30000; i < readings.size(); ++i) readings[i] += 9.81 * 0.005;  // 0.3 deg

  const auto moved_s = first_motion_s(readings, 0.01);
  ASSERT_TRUE(moved_s);
  EXPECT_NEAR(*moved_s, 300.0, 31.0);
  EXPECT_FALSE(first_motion_s(std::vector<double>(60000, 9.81), 0.01));
}

TEST(Allan, HasNothingToSayOfAFewReadings) {
  EXPECT_FALSE(fit_noise(allan_deviation(std::vector<double>(8, 1.0), 0.01)));
}

}  // namespace
}  // namespace crepes::imu_calibration_test
