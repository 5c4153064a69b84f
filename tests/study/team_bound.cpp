#include "tests/study/team_bound.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "daemon/ctl/score/pair_score.hpp"
#include "tests/study/imu_noise.hpp"
#include "tests/study/true_motion.hpp"

// Like that of a pair, the model is written out apart from the filter's: a bound that shares the
// filter's Jacobians would share their mistakes.
namespace crepes::study {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kMotionStep = 0.01;    // s
constexpr double kUpdatePeriod = 0.02;  // s; of published poses and of updates
// Nothing is known of the relative motion at first.
constexpr double kFirstPosition = 10.0;  // m
constexpr double kFirstSpeed = 2.0;      // m/s
constexpr double kFirstAttitude = 1.0;   // rad

double square(double x) { return x * x; }

// Within a robot's motion; R_true = R Exp(theta), everything else additive.
constexpr Index kP = 0;
constexpr Index kV = 3;
constexpr Index kTheta = 6;
constexpr Index kMotion = 9;
// Within a robot's constants.
constexpr Index kMisalign = 0;
constexpr Index kGyro = 3;
constexpr Index kAccel = 6;
constexpr Index kGyroScale = 9;  // by columns, as the following
constexpr Index kAccelScale = 18;

/// Where each state is. Robots are numbered from 0; robot 0 is the reference and has no motion.
struct Layout {
  Index robots;
  Index constants;  ///< of each robot

  [[nodiscard]] Index motions() const { return kMotion * (robots - 1); }
  [[nodiscard]] Index motion(Index robot) const { return kMotion * (robot - 1); }
  [[nodiscard]] Index constant(Index robot) const { return motions() + constants * robot; }
  [[nodiscard]] Index range_bias(Index a, Index b) const {
    const auto [low, high] = std::minmax(a, b);
    return motions() + constants * robots + high * (high - 1) / 2 + low;
  }
  [[nodiscard]] Index size() const {
    return motions() + constants * robots + robots * (robots - 1) / 2;
  }
};

Layout layout_of(const Swarm& swarm, const SensorPriors& priors) {
  const bool scaled = priors.gyro_scale > 0.0 || priors.accel_scale > 0.0;
  return {.robots = static_cast<Index>(swarm.dataset.robots.size()), .constants = scaled ? 27 : 9};
}

MatrixXd prior(const Layout& layout, const SensorPriors& s) {
  MatrixXd P = MatrixXd::Zero(layout.size(), layout.size());
  const auto set = [&P](Index at, Index count, double sigma) {
    P.diagonal().segment(at, count).setConstant(square(sigma));
  };
  for (Index i = 1; i < layout.robots; ++i) {
    set(layout.motion(i) + kP, 3, kFirstPosition);
    set(layout.motion(i) + kV, 3, kFirstSpeed);
    set(layout.motion(i) + kTheta, 3, kFirstAttitude);
  }
  for (Index i = 0; i < layout.robots; ++i) {
    const Index at = layout.constant(i);
    set(at + kMisalign, 3, s.misalignment_rad);
    set(at + kGyro, 3, s.gyro_bias_radps);
    set(at + kAccel, 3, s.accel_bias_mps2);
    if (layout.constants == kGyroScale) continue;
    set(at + kGyroScale, 9, s.gyro_scale);
    set(at + kAccelScale, 9, s.accel_scale);
  }
  set(layout.range_bias(0, 1), layout.size() - layout.range_bias(0, 1), s.range_bias_m);
  return P;
}

/// The true motion of a robot, relative to the reference R.
struct Truth {
  Pose T_R_N;
  Vector3d v_R_N = Vector3d::Zero();  ///< R_W_R^T (v_W_N - v_W_R)
  MotionSample ideal;                 ///< what its IMU would sense without errors
};

/// A part of a measurement's Jacobian: the columns of the states from `at` on; none if negative.
struct Part {
  Index at;
  MatrixXd H;
};

/// The covariance of all states of a team along the true motion, as the readings correct it.
class TeamCovariance {
 public:
  TeamCovariance(const Swarm& swarm, const SensorPriors& priors)
      : swarm_(swarm),
        priors_(priors),
        layout_(layout_of(swarm, priors)),
        P_(prior(layout_, priors)),
        information_(MatrixXd::Zero(layout_.size(), layout_.size())) {
    for (const RobotRecording& robot : swarm.dataset.robots) {
      members_.push_back(member_of(swarm.dataset, robot.robot.id));
      motions_.emplace_back(swarm.truth, robot.robot.id, swarm.dataset.manifest.duration_s);
      noises_.push_back(imu_noise(robot, motions_.back()));
    }
  }

  /// From `t` to `t + dt`.
  void propagate(double t, double dt);
  /// What was measured since the last update, as if at `t`.
  void add_sighting(Index observer, Index seen, const Sighting& z, double sigma_px, double t);
  void add_range(Index a, Index b, double sigma_m, double t);
  void update();

  struct Variance {
    double position = 0.0;
    double rotation = 0.0;
  };
  /// Traces of both blocks of the covariance of T_B_N at `t`.
  [[nodiscard]] Variance variance(Index observer, Index neighbor, double t) const;

 private:
  [[nodiscard]] Truth truth(Index robot, double t) const;
  void add(const std::array<Part, 5>& parts, const MatrixXd& weight);

  const Swarm& swarm_;
  SensorPriors priors_;
  Layout layout_;
  std::vector<MemberConfig> members_;
  std::vector<TrueMotion> motions_;
  std::vector<MeasuredImuNoise> noises_;
  MatrixXd P_;
  MatrixXd information_;  ///< of what was measured since the last update
};

Truth TeamCovariance::truth(Index robot, double t) const {
  const auto& robots = swarm_.dataset.robots;
  const Pose T_W_R = swarm_.truth.pose(robots.front().robot.id, t).value();
  const auto k = static_cast<std::size_t>(robot);
  const Pose T_W_N = swarm_.truth.pose(robots[k].robot.id, t).value();
  const MotionSample ideal = motions_[k].at(t);
  return {T_W_R.inverse() * T_W_N,
          T_W_R.q.conjugate() * (ideal.v_W_B - motions_.front().at(t).v_W_B), ideal};
}

using Driven = Eigen::Matrix<double, kMotion, 6>;  // by gyro and specific force
using MotionMatrix = Eigen::Matrix<double, kMotion, kMotion>;

/// How a robot's motion depends on its constants, given how it depends on its IMU: a bias is
/// subtracted from what was measured; a scale error is a bias in proportion to each component.
MatrixXd by_constants(const Driven& G, const MotionSample& ideal, Index constants) {
  MatrixXd A = MatrixXd::Zero(kMotion, constants);
  A.middleCols<6>(kGyro) = -G;
  if (constants == kGyroScale) return A;
  for (Index k = 0; k < 3; ++k) {
    A.middleCols<3>(kGyroScale + 3 * k) = -ideal.w_B(k) * G.leftCols<3>();
    A.middleCols<3>(kAccelScale + 3 * k) = -ideal.f_B(k) * G.rightCols<3>();
  }
  return A;
}

/// One step of the motion of a robot N: by its own motion, the constants of the reference R and its
/// own. All robots share the noise of R's IMU.
struct Transition {
  MotionMatrix by_motion;
  MatrixXd by_reference;
  MatrixXd by_own;
  MotionMatrix Q;      ///< of N's IMU
  Driven G_reference;  ///< by R's IMU
};

Eigen::Matrix<double, 6, 1> variances(const MeasuredImuNoise& noise) {
  Eigen::Matrix<double, 6, 1> density;
  density << Vector3d::Constant(noise.gyro_density), Vector3d::Constant(noise.accel_density);
  return density.cwiseAbs2();
}

/// Euler's step in the frame that turns with the reference R:
///   p' = v - w_R x p,  v' = R f_N - f_R - w_R x v,  theta' = w_N - R^T w_R - w_N x theta
Transition transition_of(const Truth& x, const MotionSample& reference,
                         const MeasuredImuNoise& noise, double dt, Index constants) {
  const Matrix3d R = x.T_R_N.R();
  MotionMatrix A = MotionMatrix::Zero();
  A.block<3, 3>(kP, kP) = -hat(reference.w_B);
  A.block<3, 3>(kP, kV).setIdentity();
  A.block<3, 3>(kV, kV) = -hat(reference.w_B);
  A.block<3, 3>(kV, kTheta) = -R * hat(x.ideal.f_B);
  A.block<3, 3>(kTheta, kTheta) = -hat(x.ideal.w_B);
  Driven G_reference = Driven::Zero();
  G_reference.block<3, 3>(kP, 0) = hat(x.T_R_N.p);
  G_reference.block<3, 3>(kV, 0) = hat(x.v_R_N);
  G_reference.block<3, 3>(kTheta, 0) = -R.transpose();
  G_reference.block<3, 3>(kV, 3) = -Matrix3d::Identity();
  Driven G_own = Driven::Zero();
  G_own.block<3, 3>(kTheta, 0).setIdentity();
  G_own.block<3, 3>(kV, 3) = R;

  // F = I + dt A + dt^2/2 A A
  const MotionMatrix half = dt * MotionMatrix::Identity() + 0.5 * dt * dt * A;
  return {.by_motion = MotionMatrix::Identity() + half * A,
          .by_reference = half * by_constants(G_reference, reference, constants),
          .by_own = half * by_constants(G_own, x.ideal, constants),
          .Q = dt * G_own * variances(noise).asDiagonal() * G_own.transpose(),
          .G_reference = G_reference};
}

void TeamCovariance::propagate(double t, double dt) {
  const Index n = layout_.motions();
  const Index constants = layout_.constants;
  const Index reference = layout_.constant(0);
  const MotionSample reference_motion = motions_.front().at(t + 0.5 * dt);
  std::vector<Transition> transitions;
  MatrixXd shared(n, 6);
  MatrixXd FP(n, layout_.size());
  for (Index i = 1; i < layout_.robots; ++i) {
    const Transition& F = transitions.emplace_back(
        transition_of(truth(i, t + 0.5 * dt), reference_motion,
                      noises_[static_cast<std::size_t>(i)], dt, constants));
    shared.middleRows<kMotion>(layout_.motion(i)) = F.G_reference;
    FP.middleRows<kMotion>(layout_.motion(i)) =
        F.by_motion * P_.middleRows<kMotion>(layout_.motion(i)) +
        F.by_reference * P_.middleRows(reference, constants) +
        F.by_own * P_.middleRows(layout_.constant(i), constants);
  }
  P_.topRows(n) = FP;
  P_.leftCols(n) = FP.transpose();
  for (Index i = 1; i < layout_.robots; ++i) {
    const Transition& F = transitions[static_cast<std::size_t>(i - 1)];
    const Index at = layout_.motion(i);
    P_.block(0, at, n, kMotion) =
        FP.middleCols<kMotion>(at) * F.by_motion.transpose() +
        FP.middleCols(reference, constants) * F.by_reference.transpose() +
        FP.middleCols(layout_.constant(i), constants) * F.by_own.transpose();
    P_.block<kMotion, kMotion>(at, at) += F.Q;
  }
  P_.topLeftCorner(n, n) +=
      dt * shared * variances(noises_.front()).asDiagonal() * shared.transpose();
  for (Index i = 0; i < layout_.robots; ++i) {
    auto constant = P_.diagonal().segment(layout_.constant(i), constants);
    constant.segment<3>(kGyro).array() += dt * square(priors_.gyro_walk);
    constant.segment<3>(kAccel).array() += dt * square(priors_.accel_walk);
  }
}

/// u = Exp(m) d / |d| in the observer's body O, d = R_R_O^T (p_R_N + R_R_N l - p_R_O) - p_camera.
void TeamCovariance::add_sighting(Index observer, Index seen, const Sighting& z, double sigma_px,
                                  double t) {
  const Truth from = truth(observer, t);
  const Truth to = truth(seen, t);
  const Vector3d& p_led = members_[static_cast<std::size_t>(seen)].p_body_led;
  const Matrix3d R_O_R = from.T_R_N.R().transpose();
  const Vector3d at = R_O_R * (to.T_R_N * p_led - from.T_R_N.p);
  const Vector3d d = at - z.p_body_camera;
  const Vector3d u = d.normalized();
  const Eigen::Matrix<double, 2, 3> across = tangent_basis(u).transpose();
  const Eigen::Matrix<double, 2, 3> by_d = across / d.norm();
  const Eigen::Matrix2d by_px = across * z.u_by_px * sigma_px;

  const Index robot_o = layout_.motion(observer);
  const Index robot_n = layout_.motion(seen);
  const auto skipped = [&](Index robot, Index at_state) { return robot == 0 ? -1 : at_state; };
  add({{{skipped(seen, robot_n + kP), by_d * R_O_R},
        {skipped(seen, robot_n + kTheta), -by_d * R_O_R * to.T_R_N.R() * hat(p_led)},
        {skipped(observer, robot_o + kP), -by_d * R_O_R},
        {skipped(observer, robot_o + kTheta), by_d * hat(at)},
        {layout_.constant(observer) + kMisalign, -across * hat(u)}}},
      Eigen::Matrix2d(by_px * by_px.transpose()).inverse());
}

void TeamCovariance::add_range(Index a, Index b, double sigma_m, double t) {
  const Truth from = truth(a, t);
  const Truth to = truth(b, t);
  const Vector3d& p_from = members_[static_cast<std::size_t>(a)].p_body_uwb;
  const Vector3d& p_to = members_[static_cast<std::size_t>(b)].p_body_uwb;
  const Eigen::RowVector3d along = (to.T_R_N * p_to - from.T_R_N * p_from).normalized().transpose();
  const auto skipped = [&](Index robot, Index at_state) {
    return robot == 0 ? -1 : layout_.motion(robot) + at_state;
  };
  add({{{skipped(b, kP), along},
        {skipped(b, kTheta), -along * to.T_R_N.R() * hat(p_to)},
        {skipped(a, kP), -along},
        {skipped(a, kTheta), along * from.T_R_N.R() * hat(p_from)},
        {layout_.range_bias(a, b), MatrixXd::Ones(1, 1)}}},
      MatrixXd::Constant(1, 1, 1.0 / square(sigma_m)));
}

void TeamCovariance::add(const std::array<Part, 5>& parts, const MatrixXd& weight) {
  for (const Part& a : parts) {
    if (a.at < 0) continue;  // the reference's own motion is no state
    for (const Part& b : parts) {
      if (b.at < 0) continue;
      information_.block(a.at, b.at, a.H.cols(), b.H.cols()) += a.H.transpose() * weight * b.H;
    }
  }
}

/// P+ = (I + P L)^-1 P with the information L: exact also where P is singular.
void TeamCovariance::update() {
  MatrixXd I_PL = P_ * information_;
  I_PL.diagonal().array() += 1.0;
  const MatrixXd updated = I_PL.partialPivLu().solve(P_);
  P_ = 0.5 * (updated + updated.transpose());
  information_.setZero();
}

///   p_O_N = R_O^T (p_N - p_O),  R_O_N = R_O^T R_N
TeamCovariance::Variance TeamCovariance::variance(Index observer, Index neighbor, double t) const {
  const Matrix3d R_O_R = truth(observer, t).T_R_N.R().transpose();
  const Pose T_O_N = truth(observer, t).T_R_N.inverse() * truth(neighbor, t).T_R_N;
  // By p and theta of the observer, then of the neighbor.
  Eigen::Matrix<double, 6, 12> J = Eigen::Matrix<double, 6, 12>::Zero();
  J.block<3, 3>(0, 0) = -R_O_R;
  J.block<3, 3>(0, 3) = hat(T_O_N.p);
  J.block<3, 3>(3, 3) = -T_O_N.R().transpose();
  J.block<3, 3>(0, 6) = R_O_R;
  J.block<3, 3>(3, 9).setIdentity();
  const auto at = [&](Index robot, Index state) {
    return robot == 0 ? -1 : layout_.motion(robot) + state;
  };
  const std::array<Index, 4> states{at(observer, kP), at(observer, kTheta), at(neighbor, kP),
                                    at(neighbor, kTheta)};
  Eigen::Matrix<double, 12, 12> P = Eigen::Matrix<double, 12, 12>::Zero();
  for (std::size_t a = 0; a < states.size(); ++a) {
    for (std::size_t b = 0; b < states.size(); ++b) {
      if (states.at(a) < 0 || states.at(b) < 0) continue;
      P.block<3, 3>(static_cast<Index>(3 * a), static_cast<Index>(3 * b)) =
          P_.block<3, 3>(states.at(a), states.at(b));
    }
  }
  const Eigen::Matrix<double, 6, 6> joint = J * P * J.transpose();
  return {joint.topLeftCorner<3, 3>().trace(), joint.bottomRightCorner<3, 3>().trace()};
}

struct Due {
  double true_s;
  Index from;
  Index to;
  double sigma;              // [px] or [m]
  const Sighting* sighting;  // none: a range
};

/// Everything that was measured, in order of time. `ways` holds the readings.
std::vector<Due> schedule(const Swarm& swarm, std::vector<OneWay>& ways) {
  const auto& robots = swarm.dataset.robots;
  std::vector<Due> due;
  ways.reserve(robots.size() * robots.size());
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (std::size_t j = 0; j < robots.size(); ++j) {
      if (i == j) continue;
      const OneWay& way =
          ways.emplace_back(true_sightings(swarm, robots[i].robot.id, robots[j].robot.id));
      const auto from = static_cast<Index>(i);
      const auto to = static_cast<Index>(j);
      const double sigma_px = bearing_sigma_px(way.sightings);
      const double sigma_m = range_sigma_m(way.ranges);
      for (const Sighting& s : way.sightings) due.push_back({s.true_s, from, to, sigma_px, &s});
      for (const Ranging& r : way.ranges) due.push_back({r.true_s, from, to, sigma_m, nullptr});
    }
  }
  std::erase_if(due, [&](const Due& d) {
    return d.true_s < 0.0 || d.true_s > swarm.dataset.manifest.duration_s || !(d.sigma > 0.0);
  });
  std::stable_sort(due.begin(), due.end(),
                   [](const Due& a, const Due& b) { return a.true_s < b.true_s; });
  return due;
}

/// The roots of the variances of one pair, over time.
struct Roots {
  std::vector<double> position;
  std::vector<double> rotation;
};

}  // namespace

TeamBound team_bound(const Swarm& swarm, const SensorPriors& priors, double after_s) {
  std::vector<OneWay> ways;
  const std::vector<Due> readings = schedule(swarm, ways);
  const auto& robots = swarm.dataset.robots;
  const auto n = static_cast<Index>(robots.size());
  TeamCovariance team(swarm, priors);
  std::map<std::pair<RobotId, RobotId>, Roots> roots;
  auto next = readings.begin();
  for (int i = 0; (i + 1) * kUpdatePeriod < swarm.dataset.manifest.duration_s; ++i) {
    const double end = (i + 1) * kUpdatePeriod;
    team.propagate(i * kUpdatePeriod, kMotionStep);
    team.propagate(i * kUpdatePeriod + kMotionStep, kMotionStep);
    for (; next != readings.end() && next->true_s <= end; ++next) {
      if (next->sighting != nullptr) {
        team.add_sighting(next->from, next->to, *next->sighting, next->sigma, end);
      } else {
        team.add_range(next->from, next->to, next->sigma, end);
      }
    }
    team.update();
    if (end < after_s) continue;
    for (Index a = 0; a < n; ++a) {
      for (Index b = 0; b < n; ++b) {
        if (a == b) continue;
        const auto variance = team.variance(a, b, end);
        Roots& pair = roots[{robots[static_cast<std::size_t>(a)].robot.id,
                             robots[static_cast<std::size_t>(b)].robot.id}];
        pair.position.push_back(std::sqrt(variance.position));
        pair.rotation.push_back(std::sqrt(variance.rotation));
      }
    }
  }
  TeamBound bound;
  for (const auto& [pair, of] : roots) {
    const ErrorStatistics p = statistics_of(of.position);
    const ErrorStatistics r = statistics_of(of.rotation);
    bound[pair] = {p.rmse, p.median, r.rmse, r.median};
  }
  return bound;
}

PairBound pooled(const TeamBound& bound) {
  const auto n = static_cast<double>(bound.size());
  PairBound all;
  for (const auto& [pair, one] : bound) {
    all.position_rms_m += one.position_rms_m * one.position_rms_m / n;
    all.rotation_rms_rad += one.rotation_rms_rad * one.rotation_rms_rad / n;
    all.position_median_m += one.position_median_m / n;
    all.rotation_median_rad += one.rotation_median_rad / n;
  }
  all.position_rms_m = std::sqrt(all.position_rms_m);
  all.rotation_rms_rad = std::sqrt(all.rotation_rms_rad);
  return all;
}

}  // namespace crepes::study
