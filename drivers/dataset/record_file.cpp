#include "drivers/dataset/record_file.hpp"

#include <fmt/core.h>

#include <optional>
#include <tuple>

#include "drivers/base/number_text.hpp"
#include "drivers/dataset/csv_file.hpp"

namespace crepes {
namespace {

constexpr std::size_t kFirstResidual = 5;
constexpr std::size_t kFirstReading = kFirstResidual + 2 * Fusion::kMaxDimension;
constexpr std::size_t kInnovationColumns = kFirstReading + std::tuple_size_v<SensorReading>;
constexpr std::size_t kStates = CalibrationRecord::kNames.size();

void append_cell(std::string& text, double value) {
  text += ',';
  append_number(text, value);
}

/// The enumerator with this name, among the first `count`.
template <class Enum>
std::optional<Enum> named(std::string_view name, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (name == name_of(static_cast<Enum>(i))) return static_cast<Enum>(i);
  return std::nullopt;
}

bool read_stamp(const CsvFile& csv, Timestamp& stamp, DatasetFaults& faults) {
  std::int64_t t_ns = 0;
  if (!csv.read(0, t_ns, faults)) return false;
  stamp = Timestamp{Duration{t_ns}};
  return true;
}

bool read_row(const CsvFile& csv, MeasurementRecord& record, DatasetFaults& faults) {
  const auto kind = named<MeasurementKind>(csv.field(1), kMeasurementKindCount);
  const auto verdict = named<Verdict>(csv.field(2), kVerdictCount);
  if (!kind || !verdict) {
    faults.add(csv.path(), csv.line(), !kind ? "unknown kind" : "unknown verdict",
               csv.field(!kind ? 1 : 2));
    return false;
  }
  record.kind = *kind;
  Fusion& fusion = record.fusion;
  fusion.verdict = *verdict;
  if (!read_stamp(csv, record.stamp, faults) || !csv.read(3, fusion.nis, faults) ||
      !csv.read(4, fusion.dimension, faults))
    return false;
  if (fusion.dimension > Fusion::kMaxDimension) {
    faults.add(csv.path(), csv.line(), "more components than there are", csv.field(4));
    return false;
  }
  for (std::size_t i = 0; i < fusion.dimension; ++i) {
    if (!csv.read(kFirstResidual + 2 * i, fusion.residual.at(i), faults) ||
        !csv.read(kFirstResidual + 2 * i + 1, fusion.sigma.at(i), faults))
      return false;
  }
  for (std::size_t i = 0; i < reading_size(record.kind); ++i)
    if (!csv.read(kFirstReading + i, record.reading.at(i), faults)) return false;
  return true;
}

bool read_row(const CsvFile& csv, CalibrationRecord& record, DatasetFaults& faults) {
  if (!read_stamp(csv, record.stamp, faults)) return false;
  for (std::size_t i = 0; i < kStates; ++i) {
    if (!csv.read(1 + i, record.value.at(i), faults) ||
        !csv.read(1 + kStates + i, record.sigma.at(i), faults))
      return false;
  }
  return true;
}

template <class Record>
Result<std::vector<Record>> read_file(const std::filesystem::path& file, std::size_t columns,
                                      std::string_view header) {
  DatasetFaults faults;
  Result<CsvFile> csv = CsvFile::open(file, columns, faults, CsvFile::Header::kPlain);
  if (!csv) return tl::unexpected(csv.error());
  if (csv->header() != header) faults.add(file, 1, "not the header of such a file");
  std::vector<Record> records;
  while (csv->next(faults)) {
    Record record;
    if (read_row(*csv, record, faults)) records.push_back(record);
  }
  if (!faults.empty()) return fail(ErrorCode::kFormat, faults.list().front());
  return records;
}

}  // namespace

std::string innovation_file_header() {
  std::string header = "t_ns,kind,verdict,nis,dof";
  for (std::size_t i = 0; i < Fusion::kMaxDimension; ++i) header += fmt::format(",r{0},s{0}", i);
  for (std::size_t i = 0; i < std::tuple_size_v<SensorReading>; ++i)
    header += fmt::format(",z{}", i);
  return header;
}

void append_innovation_row(std::string& text, const MeasurementRecord& record) {
  const Fusion& fusion = record.fusion;
  append_number(text, to_ns(record.stamp));
  text.append(",").append(name_of(record.kind)).append(",").append(name_of(fusion.verdict));
  append_cell(text, fusion.nis);
  text += ',';
  append_number(text, fusion.dimension);
  for (std::size_t i = 0; i < Fusion::kMaxDimension; ++i) {
    if (i < fusion.dimension) {
      append_cell(text, fusion.residual.at(i));
      append_cell(text, fusion.sigma.at(i));
    } else {
      text += ",,";
    }
  }
  for (std::size_t i = 0; i < record.reading.size(); ++i) {
    if (i < reading_size(record.kind)) {
      append_cell(text, record.reading.at(i));
    } else {
      text += ',';
    }
  }
  text += '\n';
}

Result<std::vector<MeasurementRecord>> read_innovation_file(const std::filesystem::path& file) {
  return read_file<MeasurementRecord>(file, kInnovationColumns, innovation_file_header());
}

std::string calibration_file_header() {
  std::string header = "t_ns";
  for (const std::string_view name : CalibrationRecord::kNames) header.append(",").append(name);
  for (const std::string_view name : CalibrationRecord::kNames)
    header.append(",").append(name).append("_sigma");
  return header;
}

void append_calibration_row(std::string& text, const CalibrationRecord& record) {
  append_number(text, to_ns(record.stamp));
  for (const double value : record.value) append_cell(text, value);
  for (const double sigma : record.sigma) append_cell(text, sigma);
  text += '\n';
}

Result<std::vector<CalibrationRecord>> read_calibration_file(const std::filesystem::path& file) {
  return read_file<CalibrationRecord>(file, 1 + 2 * kStates, calibration_file_header());
}

}  // namespace crepes
