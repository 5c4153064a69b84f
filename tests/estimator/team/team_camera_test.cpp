/// What the errors of a lens do to directions, and how much of that a camera's states explain.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <cstdint>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/belief/team_state.hpp"
#include "estimator/team/team_filter.hpp"
#include "estimator/vision/double_sphere.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_camera_test {
namespace {

constexpr double kFocal = 316.5;  // px

/// Seen by a lens whose principal point or focal length is another than assumed.
Eigen::Vector3d bent(const Eigen::Vector3d& u, const Eigen::Vector2d& point_px, double focal) {
  const DoubleSphere lens(-0.1723, 0.5931);
  const Eigen::Vector2d m = lens.project(u, nullptr).value();
  return lens.unproject((kFocal * focal * m + point_px) / kFocal, nullptr).value().normalized();
}

struct Rms {
  double before = 0.0;
  double after = 0.0;
};

/// RMS of what this does to directions, without and with a rotation, and with `lens` states.
Rms explained(const std::vector<Eigen::Vector3d>& directions, const Eigen::Vector2d& point_px,
              double focal) {
  const auto count = static_cast<Eigen::Index>(directions.size());
  Eigen::MatrixXd J(3 * count, 6);
  Eigen::VectorXd b(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d& u = directions[static_cast<std::size_t>(i)];
    J.block<3, 3>(3 * i, 0) = -hat(u);
    J.block<3, 3>(3 * i, 3) = Eigen::Matrix3d::Identity() - u * u.transpose();
    b.segment<3>(3 * i) = bent(u, point_px, focal) - u;
  }
  const auto rest = [&](Eigen::Index states) {
    const Eigen::MatrixXd used = J.leftCols(states);
    const Eigen::VectorXd x = used.completeOrthogonalDecomposition().solve(b);
    return (b - used * x).norm() / std::sqrt(static_cast<double>(count));
  };
  return {rest(3), rest(6)};
}

/// Of half a circle through the optical axis, and of its surroundings.
std::vector<Eigen::Vector3d> belt(double half_width_deg) {
  std::vector<Eigen::Vector3d> directions;
  for (double a = -92.0; a <= 92.0; a += 4.0) {
    for (double e = -half_width_deg; e <= half_width_deg; e += 5.0) {
      directions.emplace_back(std::sin(radians(a)) * std::cos(radians(e)), std::sin(radians(e)),
                              std::cos(radians(a)) * std::cos(radians(e)));
    }
  }
  return directions;
}

TEST(TeamCamera, ExplainsAPrincipalPointThatIsOff) {
  for (const Eigen::Vector2d& off_px : {Eigen::Vector2d(0.4, 0.0), Eigen::Vector2d(0.0, 0.4)})
    EXPECT_LT(explained(belt(0.0), off_px, 1.0).after, 3e-5);
  // Across the circle a rotation alone leaves most, along it next to nothing.
  EXPECT_GT(explained(belt(0.0), {0.0, 0.4}, 1.0).before, 2e-4);
  const Rms around = explained(belt(30.0), {0.3, 0.3}, 1.0);
  EXPECT_LT(around.after, 0.7 * around.before) << around.before;
}

TEST(TeamCamera, ExplainsMostOfAFocalLengthThatIsOff) {
  const Rms circle = explained(belt(0.0), Eigen::Vector2d::Zero(), 1.001);
  EXPECT_LT(circle.after, 0.35 * circle.before);
}

TEST(TeamCamera, MovesADirectionTowardsItsLensErrorAndNotAlongIt) {
  const TeamCamera camera{.lens = {0.0, 0.0, 1e-3}};
  EXPECT_NEAR(camera.seen(Eigen::Vector3d::UnitX()).z(), 1e-3, 1e-8);
  EXPECT_TRUE(camera.seen(Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitZ()));
}

/// Mean NEES of a team whose lenses err as the priors say, or are believed to be perfect.
double mean_nees(bool are_believed) {
  double nees = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    test::SimulatedTeam team(seed, 6);
    if (are_believed)
      team.damage = [](TeamInterval& interval) { interval.settings.priors.lens_rad = 0.0; };
    TeamFilter filter;
    for (int i = 0; i < 60; ++i) {
      const TeamSolution solution = filter.step(team.next());
      if (i < 40) continue;
      for (const TeamPose& pose : solution.poses) {
        nees += test::nees_of(pose, team.truth(pose.neighbor));
        ++count;
      }
    }
  }
  return nees / count;
}

TEST(TeamCamera, ThatIsBelievedToBePerfectMakesTheTeamTooCertain) {
  const double as_they_are = mean_nees(false);
  EXPECT_LT(as_they_are, 9.0);
  EXPECT_GT(mean_nees(true), 1.5 * as_they_are);
}

}  // namespace
}  // namespace crepes::team_camera_test
