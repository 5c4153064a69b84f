#include "estimator/vision/ring_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/vision/arc_joiner.hpp"

namespace crepes::ring_model_test {
namespace {

/// A board as a lens without distortion shows it.
struct Seen {
  Eigen::Vector2d center;
  std::vector<Eigen::Vector2d> leds;
};

Seen view_of(const RingShape& shape, double radius_m, double range_m, double tilt_rad,
             double around_rad) {
  constexpr double kFocalLength_px = 320.0;
  const auto at = [&](const Eigen::Vector2d& place) {
    const Eigen::Vector2d q = radius_m * (Eigen::Rotation2Dd(around_rad) * place);
    const Eigen::Vector3d p(q.x() * std::cos(tilt_rad) + 0.1, q.y() - 0.05,
                            range_m + q.x() * std::sin(tilt_rad));
    return Eigen::Vector2d(kFocalLength_px * p.head<2>() / p.z());
  };
  Seen seen{at(Eigen::Vector2d::Zero()), {}};
  for (const Eigen::Vector2d& place : shape.places) seen.leds.push_back(at(place));
  return seen;
}

TEST(RingShape, HasItsLedsAtEqualStepsAndTheFirstOfASquareInACorner) {
  EXPECT_TRUE(RingShape::round(12).places[3].isApprox(Eigen::Vector2d(0.0, 1.0)));
  const RingShape square = RingShape::square(12);
  for (std::size_t led = 0; led < 12; ++led) {
    const Eigen::Vector2d step = square.places[(led + 1) % 12] - square.places[led];
    EXPECT_NEAR(step.norm(), 2.0 / 3.0, 1e-12);
    EXPECT_NEAR(square.places[led].cwiseAbs().maxCoeff(), 1.0, 1e-12);
  }
  EXPECT_NEAR(square.places[0].norm(), std::sqrt(2.0), 1e-12);
}

TEST(RingModel, FindsTheCenterBehindPerspective) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (const bool is_square : {false, true}) {
    for (int leds = is_square ? 8 : 5; leds <= kMaxRingLeds; leds += is_square ? 4 : 1) {
      const RingShape shape = is_square ? RingShape::square(leds) : RingShape::round(leds);
      for (int i = 0; i < 30; ++i) {
        const Seen seen = view_of(shape, 0.06, 0.4 + part(random), 1.22 * part(random),
                                  2.0 * std::numbers::pi * part(random));
        const auto from_afar = fit_from_afar(seen.leds, shape.places);
        ASSERT_TRUE(from_afar);

        const auto view = fit_perspective(*from_afar, seen.leds, shape.places);

        ASSERT_TRUE(view);
        EXPECT_LT(view->rms(seen.leds, shape.places), 0.06);
        EXPECT_LT((view->center - seen.center).norm(), 0.2) << leds;
      }
    }
  }
}

TEST(RingModel, IsAsSureOfTheCenterAsItsLedsAllow) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.1);
  const RingShape shape = RingShape::round(8);
  double squares = 0.0;
  constexpr int kViews = 200;
  for (int i = 0; i < kViews; ++i) {
    Seen seen = view_of(shape, 0.03, 1.0, 0.6, 0.1 * i);
    for (Eigen::Vector2d& led : seen.leds) led += Eigen::Vector2d(noise(random), noise(random));
    const RingView from_afar = fit_from_afar(seen.leds, shape.places).value();
    const RingView view = fit_perspective(from_afar, seen.leds, shape.places).value();
    squares += (view.center - seen.center).squaredNorm();
  }
  // Of the mean of eight: 0.1 px times the root of two over eight.
  EXPECT_LT(std::sqrt(squares / kViews), 2.0 * 0.05);
}

TEST(RingModel, RefusesPlacesOnALine) {
  const std::vector<Eigen::Vector2d> line{{0, 0}, {1, 1}, {2, 2}};
  EXPECT_FALSE(fit_from_afar(line, line));
}

TEST(FitEllipse, FindsTheEllipseOfABandOfPixels) {
  for (const double around : {0.0, 0.4, 1.1, 2.5}) {
    Eigen::Matrix2d axes;
    axes = Eigen::Rotation2Dd(around) * Eigen::Vector2d(18.0, 7.0).asDiagonal();
    const Eigen::Vector2d center(420.3, 77.8);
    std::vector<Eigen::Vector2d> pixels;
    for (int v = 50; v < 110; ++v)
      for (int u = 390; u < 450; ++u) {
        const Eigen::Vector2d q = axes.inverse() * (Eigen::Vector2d(u, v) - center);
        if (std::abs(q.norm() - 1.0) < 0.15) pixels.emplace_back(u, v);
      }

    const auto view = fit_ellipse(pixels);

    ASSERT_TRUE(view);
    EXPECT_LT((view->center - center).norm(), 0.15);
    EXPECT_NEAR(view->radius(), 18.0, 0.8);  // the band is thicker there
    EXPECT_NEAR(view->roundness(), 7.0 / 18.0, 0.03);
  }
}

TEST(FitEllipse, RefusesHyperbolas) {
  std::vector<Eigen::Vector2d> points;
  for (int k = -10; k <= 10; ++k)
    for (const double side : {-1.0, 1.0})
      points.emplace_back(side * 10.0 * std::cosh(0.1 * k), 10.0 * std::sinh(0.1 * k));
  EXPECT_FALSE(fit_ellipse(points));
}

}  // namespace
}  // namespace crepes::ring_model_test
