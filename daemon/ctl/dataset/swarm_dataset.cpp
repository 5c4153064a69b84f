#include "daemon/ctl/dataset/swarm_dataset.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "config/reading/config_file.hpp"
#include "drivers/dataset/csv_file.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// A row of a file, and where it stood.
template <class Value>
struct DatasetRow {
  std::size_t line = 0;
  Timestamp stamp{};
  Value value;
};

/// The context in which all files of one robot are read.
struct Context {
  Timestamp first;
  Timestamp last;
  std::vector<RobotId> members;
  DatasetFaults& faults;
};

bool read_stamp(const CsvFile& csv, Timestamp& stamp, const Context& context) {
  std::int64_t t_ns = 0;
  if (!csv.read(0, t_ns, context.faults)) return false;
  stamp = Timestamp{Duration{t_ns}};
  if (stamp >= context.first && stamp <= context.last) return true;
  context.faults.add(csv.path(), csv.line(), "stamp outside the recording", csv.field(0));
  return false;
}

/// For each row, whether it belongs to a longest subsequence with non-decreasing stamps. Patience
/// sorting from the end: of two contradicting rows the earlier one is kept.
template <class Value>
std::vector<bool> in_order(const std::vector<DatasetRow<Value>>& rows) {
  constexpr std::size_t kNone = SIZE_MAX;
  std::vector<std::size_t> ends;  // ends[k]: where the best descent of k + 1 rows from the end ends
  std::vector<std::size_t> next(rows.size(), kNone);
  const auto later = [&rows](Timestamp t, std::size_t row) { return t > rows[row].stamp; };
  for (std::size_t i = rows.size(); i-- > 0;) {
    const Timestamp stamp = rows[i].stamp;
    auto place = ends.end();
    if (!ends.empty() && stamp > rows[ends.back()].stamp)
      place = std::upper_bound(ends.begin(), ends.end(), stamp, later);
    if (place != ends.begin()) next[i] = *(place - 1);
    if (place == ends.end()) {
      ends.push_back(i);
    } else {
      *place = i;
    }
  }
  std::vector<bool> kept(rows.size(), false);
  for (std::size_t i = ends.empty() ? kNone : ends.back(); i != kNone; i = next[i]) kept[i] = true;
  return kept;
}

/// Reads all good rows of `file` with `parse(csv, row) -> bool`. A file without one is an error.
template <class Value, class Parse>
Result<std::vector<DatasetRow<Value>>> read_rows(const fs::path& file, std::size_t columns,
                                                 const Context& context, const Parse& parse) {
  Result<CsvFile> csv = CsvFile::open(file, columns, context.faults);
  if (!csv) return tl::unexpected(csv.error());
  const std::uint64_t faults_before = context.faults.total();
  std::vector<DatasetRow<Value>> rows;
  while (csv->next(context.faults)) {
    DatasetRow<Value> row;
    row.line = csv->line();
    if (read_stamp(*csv, row.stamp, context) && parse(*csv, row)) rows.push_back(std::move(row));
  }
  const std::uint64_t refused = context.faults.total() - faults_before;
  if (rows.empty() && refused > 0) {
    return fail(ErrorCode::kFormat, fmt::format("{}: none of {} rows is good; the last: {}",
                                                file.string(), refused, context.faults.last()));
  }
  const std::vector<bool> kept = in_order(rows);
  std::size_t count = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!kept[i]) {
      context.faults.add(file, rows[i].line, "stamp out of order");
    } else if (count++ != i) {
      rows[count - 1] = std::move(rows[i]);
    }
  }
  rows.resize(count);
  return rows;
}

template <class Value>
std::vector<Value> values_of(std::vector<DatasetRow<Value>>&& rows) {
  std::vector<Value> values;
  values.reserve(rows.size());
  for (DatasetRow<Value>& row : rows) values.push_back(std::move(row.value));
  return values;
}

Result<std::vector<ImuSample>> read_imu(const fs::path& file, const Context& context) {
  return read_rows<ImuSample>(
             file, 7, context,
             [&](const CsvFile& csv, DatasetRow<ImuSample>& row) {
               row.value.stamp = row.stamp;
               for (int i = 0; i < 3; ++i) {
                 const auto column = static_cast<std::size_t>(i);
                 if (!csv.read(column + 1, row.value.gyro_radps[i], context.faults) ||
                     !csv.read(column + 4, row.value.accel_mps2[i], context.faults))
                   return false;
               }
               return true;
             })
      .map([&](std::vector<DatasetRow<ImuSample>>&& rows) {
        // A sample is a mean since the one before.
        std::vector<ImuSample> samples;
        samples.reserve(rows.size());
        for (const DatasetRow<ImuSample>& row : rows) {
          if (!samples.empty() && samples.back().stamp == row.stamp) {
            context.faults.add(file, row.line, "the stamp repeats");
          } else {
            samples.push_back(row.value);
          }
        }
        return samples;
      });
}

Result<std::vector<UwbRange>> read_ranges(const fs::path& file, const Context& context) {
  const auto parse = [&](const CsvFile& csv, DatasetRow<UwbRange>& row) {
    UwbRange& range = row.value;
    range.stamp = row.stamp;
    std::int64_t neighbor = 0;
    if (!csv.read(1, neighbor, context.faults) || !csv.read(2, range.range_m, context.faults) ||
        !csv.read(3, range.first_path_dbm, context.faults) ||
        !csv.read(4, range.received_dbm, context.faults))
      return false;
    // A range to itself tells that another robot carries its module.
    const auto known = std::ranges::find(context.members, neighbor, &RobotId::value);
    if (known == context.members.end()) {
      context.faults.add(csv.path(), csv.line(), "unknown peer", csv.field(1));
      return false;
    }
    range.neighbor = *known;
    return true;
  };
  return read_rows<UwbRange>(file, 5, context, parse).map(values_of<UwbRange>);
}

/// Rows with the same stamp are one frame; a row `t_ns,,,,` is a frame without spots.
Result<std::vector<SpotFrame>> read_spots(const fs::path& file, std::uint8_t camera,
                                          const Context& context) {
  struct MaybeSpot {
    Spot spot;
    bool is_spot = false;
  };
  const auto parse = [&](const CsvFile& csv, DatasetRow<MaybeSpot>& row) {
    Spot& spot = row.value.spot;
    for (std::size_t i = 1; i < 5; ++i)
      row.value.is_spot = row.value.is_spot || !csv.field(i).empty();
    return !row.value.is_spot ||
           (csv.read(1, spot.u_px, context.faults) && csv.read(2, spot.v_px, context.faults) &&
            csv.read(3, spot.area_px2, context.faults) && csv.read(4, spot.peak, context.faults));
  };
  Result<std::vector<DatasetRow<MaybeSpot>>> rows = read_rows<MaybeSpot>(file, 5, context, parse);
  if (!rows) return tl::unexpected(rows.error());
  std::vector<SpotFrame> frames;
  for (const DatasetRow<MaybeSpot>& row : *rows) {
    if (frames.empty() || frames.back().stamp != row.stamp)
      frames.push_back({.stamp = row.stamp, .camera = camera, .spots = {}});
    if (row.value.is_spot) frames.back().spots.push_back(row.value.spot);
  }
  return frames;
}

Result<std::vector<RecordedPicture>> read_images(const fs::path& file, const Context& context) {
  const fs::path pictures = file.parent_path() / "data";
  const auto parse = [&](const CsvFile& csv, DatasetRow<RecordedPicture>& row) {
    const fs::path name = csv.field(1);
    std::error_code status;
    row.value = {.stamp = row.stamp, .file = pictures / name};
    if (name == name.filename() && fs::is_regular_file(row.value.file, status)) return true;
    context.faults.add(csv.path(), csv.line(), "no such picture", csv.field(1));
    return false;
  };
  return read_rows<RecordedPicture>(file, 2, context, parse).map(values_of<RecordedPicture>);
}

Result<CameraRecording> read_camera(const fs::path& dir, std::uint8_t index,
                                    const Context& context) {
  const fs::path spots_file = dir / "spots.csv";
  const fs::path images_file = dir / "data.csv";
  std::error_code status;
  const bool has_spots = fs::exists(spots_file, status);
  const bool has_images = fs::exists(images_file, status);
  if (!has_spots && !has_images)
    return fail(ErrorCode::kNotFound, dir.string() + ": neither spots.csv nor data.csv");
  CameraRecording camera;
  if (has_spots) {
    auto spots = read_spots(spots_file, index, context);
    if (!spots) return tl::unexpected(spots.error());
    camera.spots = std::move(*spots);
  }
  if (has_images) {
    auto images = read_images(images_file, context);
    if (!images && !has_spots) return tl::unexpected(images.error());
    if (images) camera.images = std::move(*images);  // else spots suffice
  }
  return camera;
}

Result<Config> read_config(const fs::path& file, const SwarmRobot& robot) {
  Result<Config> config = load_config(file);
  if (config && config->robot.id != robot.id) {
    return fail(ErrorCode::kConfig,
                fmt::format("{}: robot.id: {}, but swarm.yaml says {}", file.string(),
                            config->robot.id.value, robot.id.value));
  }
  return config;
}

std::vector<RobotId> members_of(const Config& config) {
  std::vector<RobotId> members;
  for (const MemberConfig& member : config.swarm.members) members.push_back(member.id);
  return members;
}

/// Reads the robot's files into `recording`, whose configuration has been read.
Result<void> read_sensors(const fs::path& dir, const RecordedSensors& sensors,
                          const Context& context, RobotRecording& recording) {
  if (sensors.imu) {
    auto imu = read_imu(dir / "imu0" / "data.csv", context);
    if (!imu) return tl::unexpected(imu.error());
    recording.imu = std::move(*imu);
  }
  if (sensors.ranges) {
    auto ranges = read_ranges(dir / "uwb0" / "data.csv", context);
    if (!ranges) return tl::unexpected(ranges.error());
    recording.ranges = std::move(*ranges);
  }
  if (!sensors.cameras) return {};
  const std::size_t cameras = recording.config.cameras.size();
  for (std::size_t k = 0; k < cameras; ++k) {
    auto camera =
        read_camera(dir / (fmt::format("cam{}", k)), static_cast<std::uint8_t>(k), context);
    if (!camera) return tl::unexpected(camera.error());
    recording.cameras.push_back(std::move(*camera));
  }
  const fs::path surplus = dir / (fmt::format("cam{}", cameras));
  std::error_code status;
  if (fs::exists(surplus, status)) {
    context.faults.add(surplus, 0, "camera without calibration",
                       "not in " + recording.config_file.string());
  }
  return {};
}

Result<RobotRecording> load_swarm_robot(const fs::path& root, const SwarmRobot& robot,
                                        double duration_s, DatasetFaults& faults) {
  constexpr double kMargin = 2.0;  // s; sensors start a little before and stop a little after
  const fs::path dir = root / robot.dir;
  RobotRecording recording;
  recording.robot = robot;
  recording.config_file = dir / "crepesd.yaml";
  Result<Config> config = read_config(recording.config_file, robot);
  if (!config) return tl::unexpected(config.error());
  recording.config = std::move(*config);
  const Context context{robot.clock.local(-kMargin), robot.clock.local(duration_s + kMargin),
                        members_of(recording.config), faults};
  if (auto read = read_sensors(dir, {}, context, recording); !read)
    return tl::unexpected(read.error());
  return recording;
}

}  // namespace

Result<SwarmDataset> load_swarm(const fs::path& dir) {
  Result<SwarmManifest> manifest = load_manifest(dir);
  if (!manifest) return tl::unexpected(manifest.error());
  SwarmDataset swarm;
  swarm.manifest = std::move(*manifest);
  for (const SwarmRobot& robot : swarm.manifest.robots) {
    auto recording = load_swarm_robot(dir, robot, swarm.manifest.duration_s, swarm.faults);
    if (!recording) return tl::unexpected(recording.error());
    swarm.robots.push_back(std::move(*recording));
  }
  return swarm;
}

Result<void> check_modules(const SwarmDataset& swarm) {
  constexpr std::ptrdiff_t kByMistake = 2;
  for (const RobotRecording& robot : swarm.robots) {
    const auto to_itself = std::ranges::count(robot.ranges, robot.robot.id, &UwbRange::neighbor);
    if (to_itself <= kByMistake) continue;
    return fail(ErrorCode::kFormat,
                fmt::format("{}: {} of its {} ranges are to itself, so another robot carried its "
                            "UWB module; record again with each module on its robot",
                            robot.robot.name, to_itself, robot.ranges.size()));
  }
  return {};
}

Result<RobotRecording> load_robot(const fs::path& dir, const RecordedSensors& sensors,
                                  DatasetFaults& faults) {
  std::error_code status;
  if (!fs::exists(dir / "crepesd.yaml", status) && fs::exists(dir / "swarm.yaml", status)) {
    const Result<SwarmManifest> manifest = load_manifest(dir);
    if (!manifest) return tl::unexpected(manifest.error());
    if (manifest->robots.size() != 1) {
      return fail(ErrorCode::kUsage,
                  dir.string() + ": holds several robots; name the folder of one");
    }
    return load_robot(dir / manifest->robots.front().dir, sensors, faults);
  }
  RobotRecording recording;
  recording.config_file = dir / "crepesd.yaml";
  Result<Config> config = load_config(recording.config_file);
  if (!config) return tl::unexpected(config.error());
  recording.config = std::move(*config);
  recording.robot.id = recording.config.robot.id;
  const Context context{Timestamp::min(), Timestamp::max(), members_of(recording.config), faults};
  if (auto read = read_sensors(dir, sensors, context, recording); !read)
    return tl::unexpected(read.error());
  return recording;
}

Result<std::vector<ImuSample>> load_imu(const fs::path& file, DatasetFaults& faults) {
  return read_imu(file, {Timestamp::min(), Timestamp::max(), {}, faults});
}

Result<std::vector<SpotFrame>> load_spots(const fs::path& file, std::uint8_t camera,
                                          DatasetFaults& faults) {
  return read_spots(file, camera, {Timestamp::min(), Timestamp::max(), {}, faults});
}

}  // namespace crepes
