/// One robot's Estimator among all that it hears of another: both IMUs, a blinking ring before two
/// cameras, ranges, and datagrams between two clocks.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/swarm/estimator.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/id_library.hpp"
#include "net/mesh/peer_link.hpp"
#include "tests/support/simulated_pair.hpp"

namespace crepes::test {

/// What may be wrong.
struct Conditions {
  bool in_view = true;     ///< of each other
  double decoy_rad = 0.0;  ///< our cameras see the neighbor's ring this far to the left instead
  bool is_lamp = false;    ///< that light is a lamp, which does not blink; the ring is hidden
  double ghost_rad = 0.0;  ///< beside it, this far to the left, a foreign board with its code
  double ring_size = 0.0;  ///< of the neighbor's ring in our pictures, as a part of the true one;
                           ///< 0: its LEDs cannot be told apart
  bool has_ranges = true;  ///< of either module
  double peer_turn_rad = 0.0;  ///< the neighbor's bearings of us point this far to the left
  bool peer_is_on = true;
  Duration report_period = std::chrono::milliseconds{20};  ///< of the neighbor; whole frames
  std::function<ImuSample(const ImuSample&)> own_imu{};    ///< what the IMU makes of the truth
  std::function<ImuSample(const ImuSample&)> peer_imu{};
  std::function<void(UwbRange&)> range{};
  std::function<void(const Report&)> own_report{};                  ///< what we send
  std::function<void(Report&)> peer_report{};                       ///< what the neighbor sends
  std::function<void(std::vector<std::uint8_t>&)> peer_datagram{};  ///< as it is on the air
};

class EstimatorPair {
 public:
  static constexpr RobotId kSelf{1};
  static constexpr RobotId kOther{2};
  static constexpr Duration kFrame = std::chrono::milliseconds{5};
  static constexpr Duration kTick = std::chrono::milliseconds{20};

  /// A pose as it came, against the truth.
  struct Found {
    Duration at{};  ///< true time of the tick
    NeighborPose pose;
    Vector6d error = Vector6d::Zero();
    double nees = 0.0;
    double speed_error_mps = 0.0;
  };

  using Alter = std::function<void(EstimatorSettings&)>;

  /// `alter` may change our estimator's settings before it starts.
  explicit EstimatorPair(
      std::uint64_t seed, const Alter& alter = [](EstimatorSettings&) {})
      : pair_(seed, noise()), settings_(settings_of(pair_, alter)), estimator_(settings_) {
    RandomGeometry random(seed + 1'000'000);  // apart from the pair's
    for (const CameraCalibration& camera : settings_.cameras)
      cameras_.push_back({CameraModel::from(camera).value(), camera.T_cam_imu.inverse(),
                          random.vector(noise().priors.misalignment_rad)});
    cameras_.front().misalignment = pair_.truth({}).misalignment_B;
  }

  void run_for(Duration duration, const Conditions& with = {}) {
    for (const Duration end = now_ + duration; now_ < end;) advance(with);
  }

  /// Something hits us, or the neighbor, within the next inertial sample.
  void hit(bool own, const Eigen::Vector3d& v_W) {
    const Timestamp stamp{now_ + std::chrono::milliseconds{3}};
    own ? pair_.hit_B(stamp, v_W) : pair_.hit_N(stamp, v_W);
  }

  /// Before anything is measured: the neighbor, four meters away, is on its way at this velocity.
  void drive_off(const Eigen::Vector3d& v_W) {
    pair_.hit_N(Timestamp{-std::chrono::milliseconds{20}}, v_W);
  }

  /// Our estimator receives what its team's filter found.
  void solve(const TeamSolution& solution) { (void)estimator_.step(solution); }
  /// Our estimator receives what its pose graph found.
  void solve(const GraphSolution& solution) { (void)estimator_.step(solution); }

  /// Our module reports one range more.
  void measure(const UwbRange& range) { (void)estimator_.step(range); }

  /// Our estimator goes on with other settings.
  void reconfigure(const std::function<void(EstimatorSettings&)>& change) {
    change(settings_);
    library_ = IdLibrary::from(settings_.swarm).value();
    estimator_.reconfigure(settings_);
  }

  /// Our clock goes on from elsewhere, or the neighbor starts anew with another clock.
  void jump_own_clock(Duration by) { own_clock_ += by; }
  void reboot_peer(Duration by) {
    peer_clock_ += by;
    peer_link_ = PeerLink(kOther, {kSelf, kOther});
  }

  [[nodiscard]] Duration now() const { return now_; }
  /// Of every tick that gave one.
  [[nodiscard]] const std::vector<Found>& found() const { return found_; }
  /// The pose at the last tick.
  [[nodiscard]] const Found* latest() const {
    return found_.empty() || found_.back().at != last_tick_ ? nullptr : &found_.back();
  }
  [[nodiscard]] NeighborStatus status() const { return estimator_.status().neighbors.at(0); }
  [[nodiscard]] EstimatorStatus estimator_status() const { return estimator_.status(); }
  [[nodiscard]] std::uint64_t count(MeasurementKind kind, Verdict verdict) const {
    return status()
        .measurements.at(static_cast<std::size_t>(kind))
        .at(static_cast<std::size_t>(verdict));
  }
  [[nodiscard]] const EstimatorSettings& settings() const { return settings_; }
  /// From now on all events are also written down.
  void log_to(std::vector<Event>& log) { log_ = &log; }
  [[nodiscard]] Timestamp own_time(Duration t) const { return Timestamp{t + own_clock_}; }
  /// When our cameras last identified the neighbor, true time.
  [[nodiscard]] Duration last_bearing() const { return last_bearing_; }
  /// So many bearings of the neighbor were named in this way.
  [[nodiscard]] int named(Naming how) const { return named_.at(static_cast<std::size_t>(how)); }
  /// So often a light appeared after a second without any; so often it had the neighbor's ID in
  /// its first frame.
  [[nodiscard]] int returns() const { return returns_; }
  [[nodiscard]] int named_returns() const { return named_returns_; }
  /// How often the neighbor went over from one of our cameras to the other.
  [[nodiscard]] int camera_changes() const { return camera_changes_; }

 private:
  struct Camera {
    CameraModel model;
    Pose T_B_C;
    Eigen::Vector3d misalignment;
  };
  struct Datagram {
    Duration arrival{};
    std::vector<std::uint8_t> bytes;
  };

  static PairNoise noise() {
    PairNoise noise;
    noise.bearing = 0.001;
    noise.priors.accel_bias_mps2 = 0.035;
    noise.priors.range_bias_m = 0.05;
    return noise;
  }

  /// A camera ahead and one 6 cm behind it, which see all around between them.
  static EstimatorSettings settings_of(const SimulatedPair& pair, const Alter& alter) {
    EstimatorSettings settings;
    settings.self = kSelf;
    settings.swarm.members.resize(2);
    settings.swarm.members[0].id = kSelf;
    settings.swarm.members[0].pattern = "011111111111111111";
    settings.swarm.members[0].p_body_led = pair.mounting_B.led;
    settings.swarm.members[0].p_body_uwb = pair.mounting_B.antenna;
    settings.swarm.members[1].id = kOther;
    settings.swarm.members[1].pattern = "001001011111111111";
    settings.swarm.members[1].p_body_led = pair.mounting_N.led;
    settings.swarm.members[1].p_body_uwb = pair.mounting_N.antenna;
    Eigen::Matrix3d R_B_C;  // x to the right, y down, z ahead
    R_B_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    for (const double heading : {0.0, std::numbers::pi}) {
      CameraCalibration camera;
      camera.name = heading == 0.0 ? "ahead" : "behind";
      camera.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
      camera.resolution = {1280, 1024};
      const Eigen::Quaterniond q_B_C = so3_exp({0.0, 0.0, heading}) * Eigen::Quaterniond(R_B_C);
      const Eigen::Vector3d p_B_C =
          pair.mounting_B.camera - Eigen::Vector3d(heading == 0.0 ? 0.0 : 0.06, 0.0, 0.0);
      camera.T_cam_imu = Pose{p_B_C, q_B_C}.inverse();
      settings.cameras.push_back(camera);
    }
    const double root_period = std::sqrt(to_seconds(SimulatedPair::kImuPeriod));
    const PairNoise n = noise();
    settings.imu.gyroscope_noise_density = n.gyro * root_period;
    settings.imu.accelerometer_noise_density = n.accel * root_period;
    settings.imu.gyroscope_bias_sigma = n.priors.gyro_bias_radps;
    settings.imu.accelerometer_bias_sigma = n.priors.accel_bias_mps2;
    settings.imu.gyroscope_scale_sigma = n.priors.gyro_scale;
    settings.imu.accelerometer_scale_sigma = n.priors.accel_scale;
    settings.range.noise_m = n.range;
    settings.range.bias_sigma_m = n.priors.range_bias_m;
    settings.vision.bearing_sigma_px = n.bearing * 316.9;
    settings.filters.camera_misalignment_deg = kDegPerRad * n.priors.misalignment_rad;
    settings.solves_graph = true;
    alter(settings);
    return settings;
  }

  void advance(const Conditions& with) {
    now_ += kFrame;
    pair_.sample_imus(Timestamp{now_});
    deliver(with);
    if (now_ % SimulatedPair::kImuPeriod == Duration{}) sample_imus(with);
    if (with.has_ranges && now_ % (2 * kTick) == kFrame) measure_ranges(with);
    look(with);
    if (now_ % kTick == Duration{} && with.in_view && with.peer_is_on) {
      const DirectionReading z = pair_.peer_bearing(Timestamp{now_});
      peer_report_.bearings.push_back({Timestamp{now_ + peer_clock_}, kSelf,
                                       so3_exp({0.0, 0.0, with.peer_turn_rad}) * z.u, z.camera,
                                       z.sigma_rad});
    }
    if (with.peer_is_on && now_ % with.report_period == Duration{}) report_for_peer(with);
    if (now_ % kTick == Duration{}) tick(with);
  }

  void deliver(const Conditions& with) {
    std::vector<Datagram> due;
    std::swap(due, in_flight_to_us_);
    for (const Datagram& datagram : due)
      if (auto received = own_link_.receive(datagram.bytes, own_time(now_)))
        static_cast<void>(step(*received));
    std::swap(due, in_flight_to_peer_);
    for (const Datagram& datagram : due)
      if (with.peer_is_on)
        static_cast<void>(peer_link_.receive(datagram.bytes, Timestamp{now_ + peer_clock_}));
    in_flight_to_peer_.clear();
  }

  void sample_imus(const Conditions& with) {
    const auto sampled = [](const ImuHistory& imu, const auto& fault, Duration clock) {
      ImuSample sample = fault ? fault(imu.newest()) : imu.newest();
      sample.stamp = imu.newest().stamp + clock;
      return sample;
    };
    static_cast<void>(step(sampled(pair_.imu_B, with.own_imu, own_clock_)));
    if (with.peer_is_on)
      peer_report_.imu.push_back(sampled(pair_.imu_N, with.peer_imu, peer_clock_));
  }

  void measure_ranges(const Conditions& with) {
    const auto measured = [&](Duration clock, RobotId neighbor) {
      UwbRange range{Timestamp{now_ + clock}, neighbor, pair_.range(Timestamp{now_}).range_m, -80.0,
                     -79.0};
      if (with.range) with.range(range);
      return range;
    };
    static_cast<void>(step(measured(own_clock_, kOther)));
    if (with.peer_is_on) peer_report_.ranges.push_back(measured(peer_clock_, kSelf));
  }

  void look(const Conditions& with) {
    static constexpr Duration kHandover = std::chrono::milliseconds{100};
    static constexpr Duration kPhase = std::chrono::microseconds{37123};  // of the neighbor's board
    static constexpr Duration kGhostPhase = std::chrono::microseconds{99456};
    const bool is_lit =
        with.is_lamp || (with.in_view && library_.entries()[1].code.is_lit(now_ + kPhase));
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      SpotFrame frame{own_time(now_), static_cast<std::uint8_t>(k), {}};
      const auto& [camera, T_B_C, misalignment] = cameras_[k];
      const Eigen::Vector3d u_B = so3_exp({0.0, 0.0, with.decoy_rad}) *
                                  pair_.bearing(Timestamp{now_}, T_B_C.p, misalignment).u;
      const auto uv = camera.project(T_B_C.q.conjugate() * u_B);
      if (is_lit && uv && camera.contains(*uv))
        frame.spots.push_back(
            {uv->x(), uv->y(), 12.0, 255.0, 1.0, ring_at(*uv, camera, T_B_C.p, with.ring_size)});
      if (with.ghost_rad != 0.0 && library_.entries()[1].code.is_lit(now_ + kGhostPhase)) {
        const auto ghost =
            camera.project(T_B_C.q.conjugate() * (so3_exp({0.0, 0.0, with.ghost_rad}) * u_B));
        if (ghost && camera.contains(*ghost))
          frame.spots.push_back({ghost->x(), ghost->y(), 12.0, 255.0, 1.0});
      }
      const Outputs outputs = step(frame);
      for (const Bearing& bearing : outputs.bearings)
        ++named_.at(static_cast<std::size_t>(bearing.how));
      if (!frame.spots.empty()) {
        const bool is_return = now_ - std::exchange(last_light_, now_) > std::chrono::seconds{1};
        returns_ += is_return ? 1 : 0;
        named_returns_ += is_return && !outputs.bearings.empty() ? 1 : 0;
      }
      if (outputs.bearings.empty()) continue;
      last_bearing_ = now_;
      if (k != seeing_camera_ && now_ - last_seen_ < kHandover) continue;
      if (std::exchange(seeing_camera_, k) != k) ++camera_changes_;
      last_seen_ = now_;
    }
  }

  /// Facing the camera.
  [[nodiscard]] RingEllipse ring_at(const Eigen::Vector2d& uv, const CameraModel& camera,
                                    const Eigen::Vector3d& p_B_C, double size) const {
    const MemberConfig& other = settings_.swarm.members[1];
    if (size == 0.0 || !other.ring_radius_m) return {};
    const Pose T_B_N = pair_.truth(Timestamp{now_}).motion.T_B_N;
    const double tangent = size * *other.ring_radius_m / (T_B_N * other.p_body_led - p_B_C).norm();
    CameraModel::UnprojectionJacobian J;
    EXPECT_TRUE(camera.unproject(uv, &J));
    const Eigen::Matrix2d M = tangent * tangent * (J.transpose() * J).inverse();
    return {.leds = 6, .uu_px2 = M(0, 0), .uv_px2 = M(0, 1), .vv_px2 = M(1, 1), .sigma = 0.01};
  }

  void report_for_peer(const Conditions& with) {
    const Timestamp stamp{now_ + peer_clock_};
    peer_report_.sender = kOther;
    peer_report_.stamp = stamp;
    peer_report_.tilt = {stamp, pair_.sighting(Timestamp{now_}).N.up, 0.01};
    if (with.peer_report) with.peer_report(peer_report_);
    in_flight_to_us_.push_back({now_, peer_link_.compose(peer_report_, stamp)});
    if (with.peer_datagram) with.peer_datagram(in_flight_to_us_.back().bytes);
    peer_report_ = {};
  }

  void tick(const Conditions& with) {
    last_tick_ = now_;
    const Outputs outputs = step(Tick{own_time(now_)});
    if (outputs.report && with.own_report) with.own_report(*outputs.report);
    if (outputs.report)
      in_flight_to_peer_.push_back({now_, own_link_.compose(*outputs.report, own_time(now_))});
    for (const NeighborPose& pose : outputs.poses) {
      const auto truth = pair_.truth(pose.stamp - own_clock_).motion;
      const Vector6d error = pose_difference(pose.T_B_N.pose, truth.T_B_N);
      found_.push_back({now_, pose, error, error.dot(pose.T_B_N.covariance.llt().solve(error)),
                        (pose.v_B_N - truth.v_B_N).norm()});
    }
  }

  Outputs step(const Event& event) {
    if (log_ != nullptr) log_->push_back(event);
    return estimator_.step(event);
  }

  SimulatedPair pair_;
  EstimatorSettings settings_;
  IdLibrary library_ = IdLibrary::from(settings_.swarm).value();
  Estimator estimator_;
  std::vector<Camera> cameras_;
  PeerLink own_link_{kSelf, {kSelf, kOther}};
  PeerLink peer_link_{kOther, {kSelf, kOther}};
  Duration own_clock_ = std::chrono::seconds{100};
  Duration peer_clock_ = std::chrono::seconds{7};
  Duration now_{};
  Duration last_tick_{};
  Duration last_bearing_{};
  std::size_t seeing_camera_ = 0;
  Duration last_seen_{};  ///< by that camera
  int camera_changes_ = 0;
  std::array<int, 2> named_{};
  Duration last_light_{};
  int returns_ = 0;
  int named_returns_ = 0;
  Report peer_report_;
  std::vector<Datagram> in_flight_to_us_;
  std::vector<Datagram> in_flight_to_peer_;
  std::vector<Found> found_;
  std::vector<Event>* log_ = nullptr;
};

}  // namespace crepes::test
