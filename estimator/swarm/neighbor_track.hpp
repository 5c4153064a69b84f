/// A neighbor's filter of either profile, with a memory of what it was fed.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/paper_filter.hpp"
#include "estimator/swarm/event_sequencer.hpp"
#include "estimator/swarm/filter_settings.hpp"

namespace crepes {

/// The lever arms that readings refer to.
struct PairMounting {
  Eigen::Vector3d p_B_M;  ///< our LED ring
  Eigen::Vector3d p_B_U;  ///< our antenna
  Eigen::Vector3d p_N_M;
  Eigen::Vector3d p_N_Q;
};

/// Long before any stamp, yet safe to subtract from one.
inline constexpr Timestamp kNever{Duration{std::numeric_limits<std::int64_t>::min() / 4}};

/// A filter whose sightings were all refused for so long is wrong, not unlucky.
inline constexpr Duration kPatience = std::chrono::milliseconds{250};

/// At most 1 m and 20 deg, one sigma, in any direction.
[[nodiscard]] bool is_certain(const Matrix6d& covariance);

/// A value: copies are used to look ahead over readings that still wait for late ones.
class NeighborTrack {
 public:
  NeighborTrack(Timestamp stamp, const RawPose& first, const FilterSettings& settings);
  NeighborTrack(Timestamp stamp, const GraphPose& first, const FilterSettings& settings);
  /// At rest or at any speed.
  NeighborTrack(Timestamp stamp, const GaussianPose& T_B_N, const FilterSettings& settings);

  void set_noise(const ProcessNoise& noise);

  [[nodiscard]] Timestamp stamp() const;
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// The one of some readings of the same kind, taken at `stamp()`, that is nearest to what this
  /// filter expects. Of poses the first.
  [[nodiscard]] std::size_t likeliest(std::span<const Measurement> candidates,
                                      const PairMounting& mounting) const;
  /// Corrects with a reading taken at `stamp()`.
  Fusion fuse(const Measurement& measurement, const PairMounting& mounting, const Gates& gates);

  struct Part;
  /// NeighborFilter::split; the paper's filter is one part.
  [[nodiscard]] std::vector<Part> split() const;

  [[nodiscard]] RelativeMotion motion() const;
  [[nodiscard]] GaussianPose pose() const;
  [[nodiscard]] bool is_certain() const { return crepes::is_certain(pose().covariance); }
  /// What the tight filter believes of the sensors; nothing of the paper's.
  [[nodiscard]] std::optional<CalibrationRecord> calibration() const;
  /// When a reading of this kind was last used; kNever if never.
  [[nodiscard]] Timestamp last(MeasurementKind kind) const {
    return last_[static_cast<std::size_t>(kind)];
  }
  /// When anything that shows the neighbor itself (not the graph) was last used.
  [[nodiscard]] Timestamp last_sighting() const;
  /// Of either direction, all sightings of the last quarter second were refused: a filter that was
  /// led astray, by a mirror image for example. The other direction alone may still agree with it.
  [[nodiscard]] bool has_lost_its_way() const;

 private:
  /// The filter has one misalignment a robot, that of the camera which spoke last. Another one that
  /// sees the same meanwhile is not heard.
  Fusion fuse_bearing(NeighborFilter& filter, const Measurement& bearing,
                      const PairMounting& mounting, const Gates& gates);
  /// Both directions fit, and for half a second no range did.
  [[nodiscard]] bool has_lost_its_distance(MeasurementKind kind) const;

  /// Readings of one kind, gated one after the other.
  struct Refusals {
    Timestamp since = kNever;
    Timestamp latest = kNever;
    int count = 0;
  };

  std::variant<NeighborFilter, PaperFilter> filter_;
  Priors priors_;
  std::array<Timestamp, kMeasurementKindCount> last_ = [] {
    std::array<Timestamp, kMeasurementKindCount> never{};
    never.fill(kNever);
    return never;
  }();
  std::array<Refusals, kMeasurementKindCount> refused_{};
  /// Where the cameras are whose bearings were used last.
  std::optional<Eigen::Vector3d> p_B_C_;
  std::optional<Eigen::Vector3d> p_N_C_;
};

struct NeighborTrack::Part {
  NeighborTrack track;
  double log_weight = 0.0;  ///< up to a constant
};

}  // namespace crepes
