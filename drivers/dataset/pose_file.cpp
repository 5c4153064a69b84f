#include "drivers/dataset/pose_file.hpp"

#include <array>
#include <cmath>
#include <optional>

#include "drivers/base/number_text.hpp"
#include "drivers/dataset/csv_file.hpp"

namespace crepes {
namespace {

constexpr std::string_view kHeader =
    "t_ns,t_pub_ns,mode,px,py,pz,qw,qx,qy,qz,"
    "c0,c1,c2,c3,c4,c5,c6,c7,c8,c9,c10,c11,c12,c13,c14,c15,c16,c17,c18,c19,c20";
constexpr std::size_t kFirstNumber = 3;
constexpr std::size_t kFirstCovariance = 10;
constexpr std::size_t kPoseColumns = 31;

/// Seconds with nine decimals, computed in integers.
void append_seconds(std::string& text, std::int64_t t_ns) {
  constexpr std::uint64_t kNsPerS = 1'000'000'000;
  const bool negative = t_ns < 0;
  const auto magnitude =
      negative ? ~static_cast<std::uint64_t>(t_ns) + 1 : static_cast<std::uint64_t>(t_ns);
  if (negative) text += '-';
  append_number(text, magnitude / kNsPerS);
  const std::string fraction = std::to_string(kNsPerS + magnitude % kNsPerS);  // "1" + nine digits
  text.append(".").append(fraction, 1);
}

std::optional<PoseMode> mode_from(std::string_view name) {
  for (const PoseMode mode : {PoseMode::kDirect, PoseMode::kGraph, PoseMode::kPredicted})
    if (name == name_of(mode)) return mode;
  return std::nullopt;
}

/// Reads the current row; false, and a fault, if it is bad.
bool read_row(const CsvFile& csv, NeighborPose& pose, DatasetFaults& faults) {
  std::int64_t t_ns = 0;
  std::int64_t t_pub_ns = 0;
  if (!csv.read(0, t_ns, faults) || !csv.read(1, t_pub_ns, faults)) return false;
  const std::optional<PoseMode> mode = mode_from(csv.field(2));
  if (!mode) {
    faults.add(csv.path(), csv.line(), "unknown mode", csv.field(2));
    return false;
  }
  std::array<double, kPoseColumns> x{};
  for (std::size_t i = kFirstNumber; i < kPoseColumns; ++i)
    if (!csv.read(i, x.at(i), faults)) return false;
  pose.stamp = Timestamp{Duration{t_ns}};
  pose.published = Timestamp{Duration{t_pub_ns}};
  pose.mode = *mode;
  pose.T_B_N.pose = {{x[3], x[4], x[5]}, {x[6], x[7], x[8], x[9]}};
  constexpr double kUnitTolerance = 1e-3;
  if (std::abs(pose.T_B_N.pose.q.norm() - 1.0) > kUnitTolerance) {
    faults.add(csv.path(), csv.line(), "quaternion not of unit length");
    return false;
  }
  std::size_t next = kFirstCovariance;
  Matrix6d& P = pose.T_B_N.covariance;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = i; j < 6; ++j) P(i, j) = P(j, i) = x.at(next++);
  }
  return true;
}

}  // namespace

std::string_view pose_file_header() { return kHeader; }

void append_pose_row(std::string& text, const NeighborPose& pose) {
  const auto number = [&text](double value) {
    text += ',';
    append_number(text, value);
  };
  append_number(text, to_ns(pose.stamp));
  text += ',';
  append_number(text, to_ns(pose.published));
  text.append(",").append(name_of(pose.mode));
  const Pose& T_B_N = pose.T_B_N.pose;
  for (const double p : T_B_N.p) number(p);
  for (const double q : {T_B_N.q.w(), T_B_N.q.x(), T_B_N.q.y(), T_B_N.q.z()}) number(q);
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column)
      number(pose.T_B_N.covariance(row, column));
  }
  text += '\n';
}

void append_tum_row(std::string& text, const NeighborPose& pose) {
  append_seconds(text, to_ns(pose.stamp));
  const Pose& T_B_N = pose.T_B_N.pose;
  for (const double x : {T_B_N.p.x(), T_B_N.p.y(), T_B_N.p.z(), T_B_N.q.x(), T_B_N.q.y(),
                         T_B_N.q.z(), T_B_N.q.w()}) {
    text += ' ';
    append_number(text, x);
  }
  text += '\n';
}

Result<std::vector<NeighborPose>> read_pose_file(const std::filesystem::path& file,
                                                 RobotId neighbor) {
  DatasetFaults faults;
  Result<CsvFile> csv = CsvFile::open(file, kPoseColumns, faults, CsvFile::Header::kPlain);
  if (!csv) return tl::unexpected(csv.error());
  if (csv->header() != kHeader) faults.add(file, 1, "not the header of a pose file");
  std::vector<NeighborPose> poses;
  while (csv->next(faults)) {
    NeighborPose pose;
    pose.neighbor = neighbor;
    if (!read_row(*csv, pose, faults)) continue;
    if (!poses.empty() && pose.stamp <= poses.back().stamp) {
      faults.add(file, csv->line(), "stamp does not increase");
    } else {
      poses.push_back(pose);
    }
  }
  if (!faults.empty()) return fail(ErrorCode::kFormat, faults.list().front());
  return poses;
}

}  // namespace crepes
