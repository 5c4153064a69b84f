#include "drivers/dataset/team_record_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>

#include "drivers/base/number_text.hpp"
#include "drivers/dataset/csv_file.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::string_view kTeamInnovationHeader =
    "t_ns,robot,neighbor,kind,camera,fused,refused,nis,dof,r0,s0,r1,s1";
constexpr std::size_t kTeamInnovationColumns = 13;
constexpr std::string_view kTeamCalibrationHeader =
    "t_ns,robot,quantity,x,sigma_x,y,sigma_y,z,sigma_z";
constexpr std::size_t kTeamCalibrationColumns = 9;

const std::string& name_of_robot(const RobotNames& names, RobotId robot) {
  const auto found = names.find(robot);
  CREPES_EXPECT(found != names.end(), "records of a robot without a name");
  return found->second;
}

void append_team_cell(std::string& text, double value) {
  text += ',';
  append_number(text, value);
}

/// `used` pairs of a value and its sigma, and empty cells for the others.
template <std::size_t kSize>
void append_components(std::string& text, const std::array<double, kSize>& value,
                       const std::array<double, kSize>& sigma, std::size_t used) {
  for (std::size_t i = 0; i < kSize; ++i) {
    if (i < used) {
      append_team_cell(text, value.at(i));
      append_team_cell(text, sigma.at(i));
    } else {
      text += ",,";
    }
  }
  text += '\n';
}

/// The residual has components; that of a gyroscope is a sum.
bool has_components(const TeamResidual& residual) {
  return residual.kind != TeamResidual::Kind::kGyro;
}

bool read_team_row(const CsvFile& csv, TeamInnovationRow& row, DatasetFaults& faults) {
  std::int64_t t_ns = 0;
  TeamResidual& residual = row.residual;
  std::size_t kind = 0;
  while (kind < kTeamResidualKindCount &&
         csv.field(3) != name_of(static_cast<TeamResidual::Kind>(kind)))
    ++kind;
  if (kind == kTeamResidualKindCount) {
    faults.add(csv.path(), csv.line(), "unknown kind", csv.field(3));
    return false;
  }
  residual.kind = static_cast<TeamResidual::Kind>(kind);
  if (!csv.read(0, t_ns, faults) || !csv.read(4, residual.camera, faults) ||
      !csv.read(5, residual.fused, faults) || !csv.read(6, residual.refused, faults) ||
      !csv.read(7, residual.nis, faults) || !csv.read(8, residual.dimension, faults))
    return false;
  row.stamp = Timestamp{Duration{t_ns}};
  row.observer = csv.field(1);
  row.neighbor = csv.field(2);
  if (!has_components(residual)) return true;
  for (std::size_t i = 0; i < 2 && static_cast<int>(i) < residual.dimension; ++i) {
    if (!csv.read(9 + 2 * i, residual.residual.at(i), faults) ||
        !csv.read(10 + 2 * i, residual.sigma.at(i), faults))
      return false;
  }
  return true;
}

bool read_team_row(const CsvFile& csv, TeamCalibrationRow& row, DatasetFaults& faults) {
  std::int64_t t_ns = 0;
  if (!csv.read(0, t_ns, faults)) return false;
  row.stamp = Timestamp{Duration{t_ns}};
  row.robot = csv.field(1);
  row.quantity = csv.field(2);
  for (std::size_t i = 0; i < 3; ++i) {
    if (i > 0 && csv.field(3 + 2 * i).empty()) return true;
    if (!csv.read(3 + 2 * i, row.value.at(i), faults) ||
        !csv.read(4 + 2 * i, row.sigma.at(i), faults))
      return false;
    ++row.dimension;
  }
  return true;
}

template <class Row>
Result<std::vector<Row>> read_team_file(const std::filesystem::path& file, std::size_t columns,
                                        std::string_view header) {
  DatasetFaults faults;
  Result<CsvFile> csv = CsvFile::open(file, columns, faults, CsvFile::Header::kPlain);
  if (!csv) return tl::unexpected(csv.error());
  if (csv->header() != header) faults.add(file, 1, "not the header of such a file");
  std::vector<Row> rows;
  while (csv->next(faults)) {
    Row row;
    if (read_team_row(*csv, row, faults)) rows.push_back(std::move(row));
  }
  if (!faults.empty()) return fail(ErrorCode::kFormat, faults.list().front());
  return rows;
}

/// Rows of one robot at one instant.
class QuantityRows {
 public:
  QuantityRows(std::string& text, Timestamp stamp, std::string_view robot) : text_(text) {
    append_number(head_, to_ns(stamp));
    head_.append(",").append(robot).append(",");
  }
  void add(std::string_view quantity, double value, double sigma) {
    append(quantity, {value}, {sigma}, 1);
  }
  void add(std::string_view quantity, const Eigen::Vector3d& v, const Eigen::Vector3d& s) {
    append(quantity, {v.x(), v.y(), v.z()}, {s.x(), s.y(), s.z()}, 3);
  }

 private:
  void append(std::string_view quantity, const std::array<double, 3>& value,
              const std::array<double, 3>& sigma, std::size_t used) {
    text_.append(head_).append(quantity);
    append_components(text_, value, sigma, used);
  }

  std::string& text_;
  std::string head_;
};

}  // namespace

std::string team_innovation_file_header() { return std::string(kTeamInnovationHeader); }

void append_team_innovation_rows(std::string& text, const TeamRecord& record,
                                 const RobotNames& names) {
  for (const TeamResidual& residual : record.residuals) {
    append_number(text, to_ns(record.stamp));
    text.append(",").append(name_of_robot(names, residual.observer));
    text.append(",").append(name_of_robot(names, residual.neighbor));
    text.append(",").append(name_of(residual.kind));
    for (const int number : {residual.camera, residual.fused, residual.refused}) {
      text += ',';
      append_number(text, number);
    }
    append_team_cell(text, residual.nis);
    text += ',';
    append_number(text, residual.dimension);
    const int used = has_components(residual) ? residual.dimension : 0;
    append_components(text, residual.residual, residual.sigma, static_cast<std::size_t>(used));
  }
}

Result<std::vector<TeamInnovationRow>> read_team_innovation_file(
    const std::filesystem::path& file) {
  return read_team_file<TeamInnovationRow>(file, kTeamInnovationColumns, kTeamInnovationHeader);
}

std::string team_calibration_file_header() { return std::string(kTeamCalibrationHeader); }

void append_team_calibration_rows(std::string& text, const TeamRecord& record,
                                  const RobotNames& names) {
  for (const RobotCalibration& robot : record.calibrations) {
    QuantityRows rows(text, record.stamp, name_of_robot(names, robot.robot));
    rows.add("gyro_bias", robot.imu.gyro_radps, robot.imu.gyro_sigma_radps);
    rows.add("accel_bias", robot.imu.accel_mps2, robot.imu.accel_sigma_mps2);
    for (int column = 0; column < 3; ++column)
      rows.add(fmt::format("gyro_scale{}", column), robot.imu.gyro_scale.col(column),
               robot.imu.gyro_scale_sigma.col(column));
    rows.add("antenna_delay", robot.antenna_delay_m, robot.antenna_delay_sigma_m);
    rows.add("clock", robot.clock_s, robot.clock_sigma_s);
    for (std::size_t i = 0; i < robot.cameras.size(); ++i) {
      const CameraMisalignment& camera = robot.cameras[i];
      rows.add(fmt::format("camera{}", i), camera.rotation,
               camera.covariance.diagonal().cwiseSqrt());
      rows.add(fmt::format("lens{}", i), camera.lens, camera.lens_sigma);
    }
  }
}

Result<std::vector<TeamCalibrationRow>> read_team_calibration_file(
    const std::filesystem::path& file) {
  return read_team_file<TeamCalibrationRow>(file, kTeamCalibrationColumns, kTeamCalibrationHeader);
}

}  // namespace crepes
