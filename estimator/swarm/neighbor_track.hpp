/// A neighbor's filter of either profile, and when it fused or gated which readings.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/paper_filter.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/measurement.hpp"

namespace crepes {

/// A filter that gated all sightings of one kind for so long has diverged.
inline constexpr Duration kDivergenceTime = std::chrono::milliseconds{250};

/// At most 1 m and 20 deg, one sigma, in any direction.
[[nodiscard]] bool is_certain(const Matrix6d& covariance);

/// A filter that starts while only the neighbor sees us works in the neighbor's axes: its errors
/// are those of T_N_B. In our axes, N would be on an arc about us that turns with the open heading,
/// and a Gaussian has the arc's tangent only. Whatever goes in or comes out is in our axes.
///
/// Has value semantics: OutputPredictor works on copies.
class NeighborTrack {
 public:
  NeighborTrack(Timestamp stamp, const RawPose& first, const FilterSettings& settings);
  NeighborTrack(Timestamp stamp, const GraphPose& first, const FilterSettings& settings);
  /// One of the poses of `start`, with the prior of the speed. If they are of all headings, this
  /// one's is held.
  NeighborTrack(Timestamp stamp, const GaussianPose& T_seer_seen, const OneWayInitialization& start,
                const FilterSettings& settings);

  /// The heading is estimated from now on.
  void release_heading();

  /// Sets the process noise.
  void set_noise(const ProcessNoise& noise);

  [[nodiscard]] Timestamp stamp() const;
  /// Propagates the filter to `to` by the IMUs of both robots.
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// Index of the candidate with the smallest NIS. The candidates have the same kind and were taken
  /// at `stamp()`. The first one if they are poses.
  [[nodiscard]] std::size_t most_likely(std::span<const Measurement> candidates,
                                        const PairMounting& mounting) const;
  /// Corrects with a reading taken at `stamp()`.
  Fusion fuse(const Measurement& measurement, const PairMounting& mounting, const Gates& gates);

  /// One track of a split, and its weight.
  struct Part;
  /// NeighborFilter::split; the paper's filter is one part.
  [[nodiscard]] std::vector<Part> split() const;

  [[nodiscard]] RelativeMotion motion() const;
  /// T_B_N, with what an arc is off its tangent.
  [[nodiscard]] GaussianPose pose() const;
  /// Of the velocity, the largest of the axes [m/s]; zero for the paper's filter.
  [[nodiscard]] double speed_sigma() const;
  [[nodiscard]] bool is_certain() const { return crepes::is_certain(pose().covariance); }
  /// The sensor calibration that the tight filter estimates; empty for the paper's filter.
  [[nodiscard]] std::optional<CalibrationRecord> calibration() const;
  /// When a reading of this kind was last used; kNever if never.
  [[nodiscard]] Timestamp last(MeasurementKind kind) const {
    return last_[static_cast<std::size_t>(kind)];
  }
  /// When a bearing or raw pose was last used.
  [[nodiscard]] Timestamp last_sighting() const;
  /// For how long one kind of sighting has been gated without exception, for example because the
  /// filter follows a mirror image. Bearings of the other direction may still fit.
  [[nodiscard]] Duration contradicted_for() const;
  /// True if that is kDivergenceTime or more.
  [[nodiscard]] bool is_diverged() const { return contradicted_for() >= kDivergenceTime; }
  /// True if the latest readings contradict the pose: ranges in a row, three or as many as ever
  /// fitted, or all of a second were gated, or some bearings, after a gap or for kDivergenceTime,
  /// while none of either side was used.
  [[nodiscard]] bool is_contradicted() const;

 private:
  /// Corrects by the reading, in the filter's axes.
  Fusion correct(NeighborFilter& filter, const Measurement& measurement,
                 const PairMounting& mounting, const Gates& gates) const;
  /// The filter has one misalignment a robot: that of the camera in use. Bearings of the robot's
  /// other cameras are skipped until that camera has been silent for a while.
  Fusion fuse_bearing(NeighborFilter& filter, const Measurement& bearing,
                      const PairMounting& mounting, const Gates& gates);
  /// With the errors that ranges may have while the robots do not see each other.
  [[nodiscard]] Measurement doubted(Measurement measurement) const;
  /// Bearings of both directions fit, but all ranges of the last half second were gated, or of the
  /// last seconds where ranges are rare.
  [[nodiscard]] bool is_range_diverged() const;

  /// Successive gated readings of one kind. Ranges that either robot measured are of one kind.
  struct GatedRun {
    Timestamp since = kNever;
    Timestamp latest = kNever;
    int count = 0;
    int used = 0;           ///< readings before, at most kMinContradicting are counted
    double residual = 0.0;  ///< first component of the latest

    [[nodiscard]] Duration length() const { return count > 0 ? latest - since : Duration{0}; }
    void add(Timestamp stamp, const Fusion& fusion);
  };

  std::variant<NeighborFilter, PaperFilter> filter_;
  FilterAxes axes_ = FilterAxes::kOurs;
  Priors priors_;
  std::array<Timestamp, kMeasurementKindCount> last_ = [] {
    std::array<Timestamp, kMeasurementKindCount> never{};
    never.fill(kNever);
    return never;
  }();
  std::array<GatedRun, kMeasurementKindCount> gated_{};  ///< all ranges are under kRange
  /// Positions of the cameras in use.
  std::optional<Eigen::Vector3d> p_B_C_;
  std::optional<Eigen::Vector3d> p_N_C_;
};

/// One track of a split, and its weight.
struct NeighborTrack::Part {
  NeighborTrack track;
  double log_weight = 0.0;  ///< up to a constant
};

}  // namespace crepes
