#include "tests/study/pair_bound.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "daemon/ctl/score/pair_score.hpp"
#include "estimator/relative/small_product.hpp"
#include "tests/study/imu_noise.hpp"
#include "tests/study/true_motion.hpp"

// The model is written out here once more, apart from the filter's: a bound that shares the
// filter's Jacobians would share their mistakes.
namespace crepes::study {
namespace {

// Layout of the error; R_true = R Exp(theta), everything else additive.
enum Index : int {
  kP = 0,
  kV = 3,
  kTheta = 6,
  kGyroB = 9,
  kAccelB = 12,
  kGyroN = 15,
  kAccelN = 18,
  kMisalignB = 21,
  kMisalignN = 24,
  kRangeBias = 27,
  kGyroScaleB = 28,  // by columns, as the following
  kAccelScaleB = 37,
  kGyroScaleN = 46,
  kAccelScaleN = 55,
  kSize = 64,
};
constexpr int kMotion = 9;
using Covariance = Eigen::Matrix<double, kSize, kSize>;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMaxStep = 0.01;  // s
constexpr double kPeriod = 0.02;   // s; of published poses
// Nothing is known of the relative motion at first.
constexpr double kFirstPosition = 10.0;  // m
constexpr double kFirstSpeed = 2.0;      // m/s
constexpr double kFirstAttitude = 1.0;   // rad

double square(double x) { return x * x; }

Covariance prior(const SensorPriors& s) {
  Covariance P = Covariance::Zero();
  const auto set = [&P](int index, double sigma) {
    P.diagonal().segment<3>(index).setConstant(square(sigma));
  };
  set(kP, kFirstPosition);
  set(kV, kFirstSpeed);
  set(kTheta, kFirstAttitude);
  set(kGyroB, s.gyro_bias_radps);
  set(kGyroN, s.gyro_bias_radps);
  set(kAccelB, s.accel_bias_mps2);
  set(kAccelN, s.accel_bias_mps2);
  set(kMisalignB, s.misalignment_rad);
  set(kMisalignN, s.misalignment_rad);
  P(kRangeBias, kRangeBias) = square(s.range_bias_m);
  for (const int gyro : {kGyroScaleB, kGyroScaleN})
    P.diagonal().segment<9>(gyro).setConstant(square(s.gyro_scale));
  for (const int accel : {kAccelScaleB, kAccelScaleN})
    P.diagonal().segment<9>(accel).setConstant(square(s.accel_scale));
  return P;
}

/// The true relative motion at an instant.
struct Truth {
  Pose T_B_N;
  Vector3d v_B_N;
  MotionSample body;
  MotionSample neighbor;
};

class Recursion {
 public:
  Recursion(const Swarm& swarm, RobotId observer, RobotId neighbor, const SensorPriors& priors)
      : swarm_(swarm),
        observer_(observer),
        neighbor_(neighbor),
        body_(swarm.truth, observer, swarm.dataset.manifest.duration_s),
        other_(swarm.truth, neighbor, swarm.dataset.manifest.duration_s),
        own_(member_of(swarm.dataset, observer)),
        their_(member_of(swarm.dataset, neighbor)),
        priors_(priors),
        P_(prior(priors)) {
    const MeasuredImuNoise body = imu_noise(recording_of(swarm.dataset, observer), body_);
    const MeasuredImuNoise other = imu_noise(recording_of(swarm.dataset, neighbor), other_);
    density_ << Vector3d::Constant(body.gyro_density), Vector3d::Constant(body.accel_density),
        Vector3d::Constant(other.gyro_density), Vector3d::Constant(other.accel_density);
  }

  void advance_to(double true_s) {
    while (t_ < true_s) {
      const double next = std::min(true_s, t_ + kMaxStep);
      step(truth(0.5 * (t_ + next)), next - t_);
      t_ = next;
    }
  }

  void see(const Sighting& z, double sigma_px) {
    const Truth x = truth(t_);
    const Vector3d at = x.T_B_N * their_.p_body_led;
    see(z, at - z.p_body_camera, Matrix3d::Identity(), -x.T_B_N.R() * hat(their_.p_body_led),
        kMisalignB, sigma_px);
  }

  void be_seen(const Sighting& z, double sigma_px) {
    const Truth x = truth(t_);
    const Matrix3d R_N_B = x.T_B_N.R().transpose();
    const Vector3d at = R_N_B * (own_.p_body_led - x.T_B_N.p);
    see(z, at - z.p_body_camera, -R_N_B, hat(at), kMisalignN, sigma_px);
  }

  void range(double sigma_m) {
    const Truth x = truth(t_);
    const Eigen::RowVector3d along =
        (x.T_B_N * their_.p_body_uwb - own_.p_body_uwb).normalized().transpose();
    Eigen::Matrix<double, 1, kSize> H = Eigen::Matrix<double, 1, kSize>::Zero();
    H.segment<3>(kP) = along;
    H.segment<3>(kTheta) = -along * x.T_B_N.R() * hat(their_.p_body_uwb);
    H(kRangeBias) = 1.0;
    update<1>(H, Eigen::Matrix<double, 1, 1>(square(sigma_m)));
  }

  [[nodiscard]] double position_variance() const { return P_.block<3, 3>(kP, kP).trace(); }
  [[nodiscard]] double rotation_variance() const { return P_.block<3, 3>(kTheta, kTheta).trace(); }

 private:
  [[nodiscard]] Truth truth(double true_s) const {
    const Pose T_W_B = swarm_.truth.pose(observer_, true_s).value();
    const Pose T_W_N = swarm_.truth.pose(neighbor_, true_s).value();
    const MotionSample& body = body_.at(true_s);
    const MotionSample& other = other_.at(true_s);
    return {T_W_B.inverse() * T_W_N, T_W_B.q.conjugate() * (other.v_W_B - body.v_W_B), body, other};
  }

  /// Euler's step about the middle of the interval, in the frame that turns with the observer:
  ///   p' = v - w_B x p,  v' = R f_N - f_B - w_B x v,  theta' = w_N - R^T w_B - w_N x theta
  void step(const Truth& x, double dt) {
    const Matrix3d R = x.T_B_N.R();
    Eigen::Matrix<double, kMotion, kSize> A = Eigen::Matrix<double, kMotion, kSize>::Zero();
    A.block<3, 3>(kP, kP) = -hat(x.body.w_B);
    A.block<3, 3>(kP, kV) = Matrix3d::Identity();
    A.block<3, 3>(kV, kV) = -hat(x.body.w_B);
    A.block<3, 3>(kV, kTheta) = -R * hat(x.neighbor.f_B);
    A.block<3, 3>(kTheta, kTheta) = -hat(x.neighbor.w_B);
    // By the rates; a bias is subtracted from what was measured.
    Eigen::Matrix<double, kMotion, 12> G = Eigen::Matrix<double, kMotion, 12>::Zero();
    G.block<3, 3>(kP, 0) = hat(x.T_B_N.p);
    G.block<3, 3>(kV, 0) = hat(x.v_B_N);
    G.block<3, 3>(kTheta, 0) = -R.transpose();
    G.block<3, 3>(kV, 3) = -Matrix3d::Identity();
    G.block<3, 3>(kTheta, 6) = Matrix3d::Identity();
    G.block<3, 3>(kV, 9) = R;
    A.middleCols<12>(kGyroB) = -G;
    // A scale error is a bias in proportion to each component of the rate.
    const auto scale = [&](int index, int rate, const Vector3d& size) {
      for (int k = 0; k < 3; ++k) A.middleCols<3>(index + 3 * k) = -size(k) * G.middleCols<3>(rate);
    };
    scale(kGyroScaleB, 0, x.body.w_B);
    scale(kAccelScaleB, 3, x.body.f_B);
    scale(kGyroScaleN, 6, x.neighbor.w_B);
    scale(kAccelScaleN, 9, x.neighbor.f_B);

    // Only the motion changes: F = [I + dt A + dt^2/2 A A; 0 I].
    Eigen::Matrix<double, kMotion, kSize> F = dt * A + 0.5 * dt * dt * A.leftCols<kMotion>() * A;
    F.leftCols<kMotion>() += Eigen::Matrix<double, kMotion, kMotion>::Identity();
    Eigen::Matrix<double, kSize, kMotion> PFt = Eigen::Matrix<double, kSize, kMotion>::Zero();
    add_product(P_, F, PFt);
    P_.leftCols<kMotion>() = PFt;
    P_.topRows<kMotion>() = PFt.transpose();
    P_.topLeftCorner<kMotion, kMotion>() = F * PFt;
    P_.topLeftCorner<kMotion, kMotion>() +=
        dt * G * density_.cwiseAbs2().asDiagonal() * G.transpose();
    for (const int gyro : {kGyroB, kGyroN})
      P_.diagonal().segment<3>(gyro).array() += dt * square(priors_.gyro_walk);
    for (const int accel : {kAccelB, kAccelN})
      P_.diagonal().segment<3>(accel).array() += dt * square(priors_.accel_walk);
  }

  /// u = Exp(m) d / |d|, in the plane across u.
  void see(const Sighting& z, const Vector3d& d, const Matrix3d& d_by_p, const Matrix3d& d_by_theta,
           int misalignment, double sigma_px) {
    const Vector3d u = d.normalized();
    const Eigen::Matrix<double, 2, 3> across = tangent_basis(u).transpose();
    Eigen::Matrix<double, 2, kSize> H = Eigen::Matrix<double, 2, kSize>::Zero();
    H.middleCols<3>(kP) = across * d_by_p / d.norm();
    H.middleCols<3>(kTheta) = across * d_by_theta / d.norm();
    H.middleCols<3>(misalignment) = -across * hat(u);
    const Eigen::Matrix2d by_px = across * z.u_by_px * sigma_px;
    update<2>(H, by_px * by_px.transpose());
  }

  template <int M>
  void update(const Eigen::Matrix<double, M, kSize>& H, const Eigen::Matrix<double, M, M>& V) {
    Eigen::Matrix<double, kSize, M> PHt = Eigen::Matrix<double, kSize, M>::Zero();
    add_product(P_, H, PHt);
    const Eigen::LLT<Eigen::Matrix<double, M, M>> C(H * PHt + V);
    const Eigen::Matrix<double, kSize, M> G = C.matrixL().solve(PHt.transpose()).transpose();
    subtract_product(G, G, P_);
  }

  const Swarm& swarm_;
  RobotId observer_;
  RobotId neighbor_;
  TrueMotion body_;
  TrueMotion other_;
  MemberConfig own_;
  MemberConfig their_;
  SensorPriors priors_;
  Eigen::Matrix<double, 12, 1> density_;  // of the noise of w_B, f_B, w_N, f_N
  Covariance P_;
  double t_ = 0.0;
};

struct Due {
  double true_s;
  enum class Kind { kSee, kBeSeen, kRange, kPublish } kind;
  double sigma;              // of the measurement [px] or [m]
  const Sighting* sighting;  // kSee, kBeSeen
};

std::vector<Due> schedule(const OneWay& there, const OneWay& back, double duration_s) {
  std::vector<Due> due;
  for (const OneWay* way : {&there, &back}) {
    const auto kind = way == &there ? Due::Kind::kSee : Due::Kind::kBeSeen;
    const double sigma_px = bearing_sigma_px(way->sightings);
    const double sigma_m = range_sigma_m(way->ranges);
    for (const Sighting& s : way->sightings) due.push_back({s.true_s, kind, sigma_px, &s});
    for (const Ranging& r : way->ranges)
      due.push_back({r.true_s, Due::Kind::kRange, sigma_m, nullptr});
  }
  for (int i = 1; i * kPeriod < duration_s; ++i)
    due.push_back({i * kPeriod, Due::Kind::kPublish, 0.0, nullptr});
  std::erase_if(due, [&](const Due& d) { return d.true_s < 0.0 || d.true_s > duration_s; });
  std::stable_sort(due.begin(), due.end(),
                   [](const Due& a, const Due& b) { return a.true_s < b.true_s; });
  return due;
}

}  // namespace

PairBound pair_bound(const Swarm& swarm, RobotId observer, RobotId neighbor,
                     const SensorPriors& priors, double after_s) {
  const OneWay there = true_sightings(swarm, observer, neighbor);
  const OneWay back = true_sightings(swarm, neighbor, observer);
  Recursion recursion(swarm, observer, neighbor, priors);
  std::vector<double> position;
  std::vector<double> rotation;
  for (const Due& due : schedule(there, back, swarm.dataset.manifest.duration_s)) {
    recursion.advance_to(due.true_s);
    switch (due.kind) {
      case Due::Kind::kSee:
        recursion.see(*due.sighting, due.sigma);
        break;
      case Due::Kind::kBeSeen:
        recursion.be_seen(*due.sighting, due.sigma);
        break;
      case Due::Kind::kRange:
        recursion.range(due.sigma);
        break;
      case Due::Kind::kPublish:
        if (due.true_s < after_s) break;
        position.push_back(std::sqrt(recursion.position_variance()));
        rotation.push_back(std::sqrt(recursion.rotation_variance()));
    }
  }
  const ErrorStatistics p = statistics_of(position);
  const ErrorStatistics r = statistics_of(rotation);
  return {p.rmse, p.median, r.rmse, r.median};
}

}  // namespace crepes::study
