#include "estimator/vision/square_outline.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "estimator/vision/arc_joiner.hpp"

namespace crepes::square_outline_test {
namespace {

using Points = std::vector<Eigen::Vector2d>;

/// `of_first` points on two edges that are opposite, `of_second` on the others.
Points outline(const RingView& view, int of_first, int of_second, double noise_px,
               std::mt19937& dice) {
  std::normal_distribution<double> noise(0.0, 1.0);
  const auto error = [&]() -> Eigen::Vector2d {
    const double u = noise_px * noise(dice);
    return {u, noise_px * noise(dice)};
  };
  Points points;
  for (int i = 0; i < of_first; ++i)
    for (const double side : {-1.0, 1.0})
      points.push_back(view.at({side, -1.0 + 2.0 * (i + 0.5) / of_first}) + error());
  for (int i = 0; i < of_second; ++i)
    for (const double side : {-1.0, 1.0})
      points.push_back(view.at({-1.0 + 2.0 * (i + 0.5) / of_second, side}) + error());
  return points;
}

RingView drawn_view(std::mt19937& dice) {
  std::uniform_real_distribution<double> part(0.0, 1.0);
  RingView view;
  view.center = {300.0 + 9.0 * part(dice), 200.0};
  const Eigen::Rotation2Dd first(2.0 * std::numbers::pi * part(dice));
  const Eigen::Rotation2Dd second(2.0 * std::numbers::pi * part(dice));
  const double radius = 8.0 + 20.0 * part(dice);
  const Eigen::Vector2d stretch(radius, radius * (0.35 + 0.6 * part(dice)));
  view.axes = first * stretch.asDiagonal() * second;
  return view;
}

TEST(SquareOutline, IsFoundWhereverItsPointsAreDense) {
  std::mt19937 dice(1);
  for (int k = 0; k < 200; ++k) {
    const RingView view = drawn_view(dice);
    const Points points = outline(view, 40, 12, 0.3, dice);
    const auto ellipse = fit_ellipse(points);
    ASSERT_TRUE(ellipse) << k;

    const auto found = fit_square(points, *ellipse);

    ASSERT_TRUE(found) << k;
    EXPECT_LT((found->view().center - view.center).norm(), 0.35) << k;
    for (const Eigen::Vector2d& uv : points) EXPECT_LT(found->distance_from(uv), 1.6) << k;
    EXPECT_GT(share_covered(*found, points), 0.9) << k;
  }
}

TEST(SquareOutline, MeasuresDistanceInsideAndOutside) {
  SquareOutline square;
  square.pairs[0] = {.normal = Eigen::Vector2d::UnitX(), .middle = 10.0, .half = 5.0};
  square.pairs[1] = {.normal = Eigen::Vector2d::UnitY(), .middle = 20.0, .half = 4.0};

  EXPECT_DOUBLE_EQ(square.distance_from({10.0, 20.0}), 4.0);
  EXPECT_DOUBLE_EQ(square.distance_from({15.0, 21.0}), 0.0);
  EXPECT_DOUBLE_EQ(square.distance_from({17.0, 21.0}), 2.0);
  EXPECT_DOUBLE_EQ(square.distance_from({10.0, 13.0}), 3.0);
  EXPECT_NEAR((square.view().center - Eigen::Vector2d(10.0, 20.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(square.view().radius(), 5.0, 1e-12);
  EXPECT_NEAR(square.view().roundness(), 0.8, 1e-12);
}

TEST(SquareOutline, IsHalfCoveredByTwoEdges) {
  std::mt19937 dice(2);
  const RingView view{.center = {50.0, 50.0}, .axes = 10.0 * Eigen::Matrix2d::Identity()};
  const auto ellipse = fit_ellipse(outline(view, 30, 30, 0.0, dice));
  const auto found = fit_square(outline(view, 30, 30, 0.0, dice), *ellipse);

  ASSERT_TRUE(found);
  EXPECT_NEAR(share_covered(*found, outline(view, 30, 0, 0.0, dice)), 0.5, 0.05);
}

TEST(SquareOutline, NeedsPointsOnEveryEdge) {
  const RingView view{.center = {50.0, 50.0}, .axes = 10.0 * Eigen::Matrix2d::Identity()};
  EXPECT_FALSE(fit_square(Points{}, view));
  EXPECT_FALSE(fit_square(Points{{40.0, 40.0}, {60.0, 60.0}, {40.0, 60.0}}, view));
}

}  // namespace
}  // namespace crepes::square_outline_test
