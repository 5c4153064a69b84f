#include "daemon/ctl/dataset/replay_pairs.hpp"

#include <algorithm>
#include <system_error>
#include <tuple>
#include <utility>

#include "drivers/dataset/pose_file.hpp"
#include "drivers/dataset/record_file.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// Records may be missing, but existing ones must be valid.
template <class Record>
Result<std::vector<Record>> optional_records(Result<std::vector<Record>> records) {
  if (!records && records.error().code == ErrorCode::kNotFound) return std::vector<Record>{};
  return records;
}

/// Whether a replay was interrupted there: it gives its files their names at the end.
bool has_parts(const fs::path& results) {
  std::error_code status;
  for (const auto& dir : fs::directory_iterator(results, status))
    for (const auto& file : fs::directory_iterator(dir.path(), status))
      if (file.path().extension() == ".part") return true;
  return false;
}

}  // namespace

std::vector<PairName> pairs_in(const fs::path& results) {
  std::vector<PairName> pairs;
  std::error_code status;
  const bool is_data_set = fs::exists(results / "swarm.yaml", status);
  for (const auto& dir : fs::directory_iterator(results, status)) {
    if (!dir.is_directory(status) || (is_data_set && dir.path().filename() == "truth")) continue;
    for (const auto& file : fs::directory_iterator(dir.path(), status)) {
      const fs::path stem = file.path().stem();  // a robot's name may have dots
      const bool is_record =
          stem.extension() == ".innovations" || stem.extension() == ".calibration";
      if (file.path().extension() == ".csv" && !is_record)
        pairs.push_back({dir.path().filename().string(), stem.string()});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const PairName& a, const PairName& b) {
    return std::tie(a.observer, a.neighbor) < std::tie(b.observer, b.neighbor);
  });
  return pairs;
}

Error no_pairs_in(const fs::path& results) {
  std::error_code status;
  std::string why;
  if (!fs::is_directory(results, status)) why = ": there is no such directory";
  if (fs::exists(results / "swarm.yaml", status))
    why = ": it is a data set, of which crepesctl replay makes results";
  if (has_parts(results)) why = ": its replay did not end: replay again";
  return {ErrorCode::kNotFound,
          results.string() + ": no <observer>/<neighbor>.csv of a replay" + why};
}

Result<PairFiles> read_pair(const fs::path& results, const PairName& pair) {
  const fs::path stem = results / pair.observer / pair.neighbor;
  const auto file = [&stem](const char* extension) { return fs::path(stem) += extension; };
  auto poses = read_pose_file(file(".csv"), {});
  if (!poses) return tl::unexpected(poses.error());
  auto measurements = optional_records(read_innovation_file(file(".innovations.csv")));
  if (!measurements) return tl::unexpected(measurements.error());
  auto calibrations = optional_records(read_calibration_file(file(".calibration.csv")));
  if (!calibrations) return tl::unexpected(calibrations.error());
  return PairFiles{std::move(*poses), std::move(*measurements), std::move(*calibrations)};
}

}  // namespace crepes
