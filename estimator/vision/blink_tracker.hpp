/// Turns the spots of successive frames of one camera into bearings of identified robots.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/decoding/phase_memory.hpp"
#include "estimator/vision/expected_board.hpp"
#include "estimator/vision/hidden_lights.hpp"
#include "estimator/vision/id_decoder.hpp"
#include "estimator/vision/id_library.hpp"
#include "estimator/vision/tracking/camera_view.hpp"
#include "estimator/vision/tracking/expected_light.hpp"
#include "estimator/vision/tracking/light_sighting.hpp"
#include "estimator/vision/tracking/light_track.hpp"
#include "estimator/vision/tracking/track_pairing.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

/// State and counters of a tracker.
struct TrackerStatus {
  std::size_t tracks = 0;
  std::size_t identified = 0;
  std::uint64_t refused_frames = 0;          ///< stamp not after the one before
  std::uint64_t refused_spots = 0;           ///< not finite, outside the image circle, too many
  std::uint64_t refused_imu = 0;             ///< not plausible, stamp there already or too old
  std::uint64_t merged_spots = 0;            ///< two boards in one spot: no bearing
  std::map<RobotId, std::uint64_t> decodes;  ///< tracks that were given this ID
  std::uint64_t lost_ids = 0;                ///< tracks that stopped blinking as their ID should
  std::uint64_t foreign_boards = 0;          ///< tracks that blink nearly as one of ours
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
///
/// If the radius of a board is known, the size of its ring in the picture gives the distance, too.
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
  void expect(std::span<const ExpectedBoard> boards, Timestamp stamp);
  [[nodiscard]] bool is_in_sight(std::size_t code) const;
  void predict(Timestamp stamp);
  [[nodiscard]] const ExpectedLight* expected_of(const LightTrack& track) const;
  void mark_known(const TrackPairing::Pairs& sighting_of);
  void observe_seen(const TrackPairing::Pairs& sighting_of, Timestamp stamp,
                    std::vector<Bearing>& bearings);
  void observe(LightTrack& track, const LightSighting& sighting, Timestamp stamp);
  [[nodiscard]] bool is_alone(const LightSighting& sighting, const Eigen::Vector3d& u_B,
                              double reach_rad) const;
  void name(LightTrack& track, Timestamp stamp, std::vector<Bearing>& bearings);
  void settle_predicted(LightTrack& track, std::optional<RobotId> read);
  void observe_unseen(const TrackPairing::Pairs& sighting_of, Duration looked);
  [[nodiscard]] bool is_hidden(const LightTrack& track) const;
  void retire(Timestamp stamp);
  void keep_or_forget(LightTrack& track);
  void begin(const LightSighting& sighting, Timestamp stamp, std::vector<Bearing>& bearings);
  [[nodiscard]] BlinkEvidence new_evidence();
  [[nodiscard]] bool resume(LightTrack& track, const LightSighting& sighting, Timestamp stamp);

  VisionConfig config_;
  CameraView view_;
  Duration timeout_{};
  Duration period_{};  ///< of frames
  IdDecoder decoder_;
  std::map<RobotId, IdLibrary::BoardSize> sizes_;  ///< of boards, as far as they are known
  ImuHistory imu_;
  PhaseMemory phases_;
  std::vector<LightTrack> tracks_;
  HiddenLights hidden_;
  std::optional<Timestamp> now_;
  TrackerStatus counts_;

  // Of the frame at hand; kept for their memory.
  TrackPairing pairing_;
  std::vector<LightSighting> sightings_;
  std::vector<bool> is_taken_;  ///< sightings that have a track
  std::vector<bool> is_known_;  ///< sightings of tracks with an ID
  std::vector<ExpectedLight> expected_;
  std::vector<Bearing> confirmed_;
  std::vector<std::size_t> unclear_;    ///< sightings of two boards at once
  std::vector<BlinkEvidence> retired_;  ///< for tracks to come
};

}  // namespace crepes
