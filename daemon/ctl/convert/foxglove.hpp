/// The messages of a converted recording: Foxglove's schemas where there is one, our own otherwise,
/// all as JSON. Times are nanoseconds from the recording's start.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/outputs.hpp"

namespace crepes {

/// A kind of message: its name, and what it looks like as JSON Schema.
struct MessageKind {
  std::string name;
  std::string json_schema;
};

[[nodiscard]] MessageKind transform_kind();    ///< foxglove.FrameTransform
[[nodiscard]] MessageKind pose_kind();         ///< foxglove.PoseInFrame
[[nodiscard]] MessageKind annotations_kind();  ///< foxglove.ImageAnnotations
[[nodiscard]] MessageKind picture_kind();      ///< foxglove.CompressedImage
[[nodiscard]] MessageKind estimate_kind();     ///< crepes.Estimate
[[nodiscard]] MessageKind innovation_kind();   ///< crepes.Innovation
[[nodiscard]] MessageKind imu_kind();          ///< crepes.Imu
[[nodiscard]] MessageKind range_kind();        ///< crepes.Range

/// Where the axes of `child` are in those of `parent`.
[[nodiscard]] std::string transform_json(std::int64_t time_ns, std::string_view parent,
                                         std::string_view child, const Pose& T_parent_child);
[[nodiscard]] std::string pose_json(std::int64_t time_ns, std::string_view frame, const Pose& pose);
/// A circle around each spot, as large as the spot and two pixels more.
[[nodiscard]] std::string annotations_json(std::int64_t time_ns, const std::vector<Spot>& spots);
/// `file` has the bytes of a PNG file.
[[nodiscard]] std::string picture_json(std::int64_t time_ns, std::string_view frame,
                                       std::string_view file);
/// What can be drawn over time: mode, angles, sigmas, age; with `truth` also the errors. Covariance
/// as in the replay's files.
[[nodiscard]] std::string estimate_json(std::int64_t time_ns, const NeighborPose& pose,
                                        const Pose* truth);
[[nodiscard]] std::string innovation_json(std::int64_t time_ns, const MeasurementRecord& record);
[[nodiscard]] std::string imu_json(std::int64_t time_ns, const ImuSample& sample);
[[nodiscard]] std::string range_json(std::int64_t time_ns, const UwbRange& range);

}  // namespace crepes
