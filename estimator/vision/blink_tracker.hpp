/// Turns the spots of successive frames of one camera into bearings of identified robots.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/vision/assignment.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/expected_board.hpp"
#include "estimator/vision/hidden_lights.hpp"
#include "estimator/vision/id_decoder.hpp"
#include "estimator/vision/id_library.hpp"
#include "estimator/vision/light_direction.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

/// State and counters of a tracker, for STATUS.
struct TrackerStatus {
  std::size_t tracks = 0;
  std::size_t identified = 0;
  std::uint64_t refused_frames = 0;          ///< stamp not after the one before
  std::uint64_t refused_spots = 0;           ///< not finite, outside the image circle, too many
  std::uint64_t refused_imu = 0;             ///< not plausible, stamp there already or too old
  std::uint64_t merged_spots = 0;            ///< two boards in one spot: no bearing
  std::map<RobotId, std::uint64_t> decodes;  ///< tracks that were given this ID
  std::uint64_t lost_ids = 0;                ///< tracks that stopped blinking as their ID should
  PredictedIds predicted_ids;
};

/// Follows spots as directions in the body frame, turned by the gyro between frames, and reads
/// what they blink. Directions seen by a rolling shutter are turned by the gyro from the exposure
/// of their row to the frame's stamp, and blinks are read at that exposure. The same ID seen twice
/// gives two bearings: which is the mirror image is for the estimator to decide.
///
/// A light that appears alone where a board is expected, by the gyro or by the pose of a robot, and
/// in the phase in which that board blinks, has its ID from the first frame on. Such bearings are
/// marked `predicted`, for 0.3 s at most; then the ID has been read, or there is none.
class BlinkTracker {
 public:
  /// `own`: the robot that carries the camera. It sees itself in mirrors only; never reported.
  BlinkTracker(const CameraCalibration& camera, CameraModel model, const VisionConfig& config,
               const IdLibrary& library, std::optional<RobotId> own = std::nullopt);

  void add_imu(const ImuSample& sample);
  /// The identified robots that are lit in `frame`, ordered by ID; stamps are body time.
  /// `expected`: the boards of robots with a pose, which must not rest on predicted bearings.
  [[nodiscard]] std::vector<Bearing> step(const SpotFrame& frame,
                                          std::span<const ExpectedBoard> expected = {});
  /// Bearings of earlier frames that were predicted, and whose light the last frame has read. They
  /// are marked as read.
  [[nodiscard]] const std::vector<Bearing>& confirmed() const { return confirmed_; }
  [[nodiscard]] TrackerStatus status() const;

 private:
  /// A spot as a direction.
  struct Sighting {
    Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
    double radius_rad = 0.0;  ///< of the blob
    double px_rad = 0.0;      ///< what a pixel subtends here
    double peak = 0.0;        ///< gray levels
    Timestamp exposed{};      ///< middle of its row's exposure, body time
  };
  struct Track {
    LightDirection light;
    Eigen::Vector3d seen_B = Eigen::Vector3d::UnitX();   ///< where it was last, turned since
    Eigen::Vector3d steady_B = Eigen::Vector3d::Zero();  ///< its rate over some 50 ms, less noisy
    Timestamp exposed{};                                 ///< of its row in the frame at hand
    Sighting seen;                                       ///< the latest
    Timestamp last_seen{};
    Duration unseen{};          ///< in frames since; those that were lost do not count
    bool is_ambiguous = false;  ///< since then it may have been in a spot with another
    int hits = 0;
    BlinkEvidence evidence;
    std::vector<Bearing> predicted;  ///< until its blinking is read
  };
  /// The sighting of each track, for those that have one.
  using Pairing = std::vector<std::optional<std::size_t>>;

  void unproject(const SpotFrame& frame, Timestamp stamp);
  [[nodiscard]] Timestamp exposure_of(double v_px, Timestamp stamp) const;
  [[nodiscard]] Timestamp exposure_of(const Track& track, Timestamp stamp) const;
  void predict(Timestamp stamp);
  [[nodiscard]] bool is_in_sight(std::size_t code) const;
  void expect(std::span<const ExpectedBoard> boards, Timestamp stamp);
  [[nodiscard]] const ExpectedLight* expected_of(const Track& track) const;
  [[nodiscard]] bool is_alone(const Sighting& sighting, const Eigen::Vector3d& u_B,
                              double reach_rad) const;
  void name(Track& track, Timestamp stamp, std::vector<Bearing>& bearings);
  [[nodiscard]] double gate_of(const Track& track) const;
  [[nodiscard]] const Pairing& assign();
  [[nodiscard]] bool is_established(const Track& track) const;
  [[nodiscard]] bool hides_another(std::size_t track, const Pairing& sighting_of) const;
  [[nodiscard]] bool is_hidden(const Track& track) const;
  void observe(Track& track, const Sighting& sighting, Timestamp stamp);
  [[nodiscard]] bool is_another(const Track& track, const Sighting& sighting,
                                Timestamp stamp) const;
  void observe_absence(Track& track) const;
  void retire(Timestamp stamp);
  void keep_or_forget(Track& track);
  void begin(const Sighting& sighting, Timestamp stamp, std::vector<Bearing>& bearings);
  void resume(Track& track, const Sighting& sighting, Timestamp stamp);

  VisionConfig config_;
  CameraModel model_;
  Pose T_B_C_;
  Pose T_C_B_;
  Duration timeshift_{};
  Duration timeout_{};
  Duration period_{};         ///< of frames
  double row_delay_s_ = 0.0;  ///< of a rolling shutter
  IdDecoder decoder_;
  ImuHistory imu_;
  PhaseMemory phases_;
  std::vector<Track> tracks_;
  HiddenLights hidden_;
  std::optional<Timestamp> now_;
  TrackerStatus counts_;

  // Of the frame at hand; kept for their memory.
  Assignment assignment_;
  std::vector<PairBenefit> pairs_;
  std::vector<Sighting> sightings_;
  std::vector<bool> is_taken_;  ///< sightings that have a track
  std::vector<bool> is_known_;  ///< sightings of tracks with an ID
  std::vector<ExpectedLight> expected_;
  std::vector<Bearing> confirmed_;
  std::vector<std::size_t> unclear_;    ///< sightings of two boards at once
  std::vector<BlinkEvidence> retired_;  ///< for tracks to come
};

}  // namespace crepes
