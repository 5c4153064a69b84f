#include "daemon/ctl/setup/spots_recording.hpp"

#include <fmt/core.h>

#include "daemon/ctl/dataset/swarm_dataset.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// The folder that holds `imu0`: the source itself, or the one around its `cam<k>` or
/// `cam<k>/data`.
fs::path robot_folder_of(const fs::path& source) {
  fs::path folder = (source / "").lexically_normal().parent_path();
  if (folder.filename() == "data") folder = folder.parent_path();
  if (folder.filename().string().starts_with("cam")) folder = (folder / "..").lexically_normal();
  return folder;
}

}  // namespace

Result<SpotsRecording> load_spots_recording(const SpotsOptions& options, std::size_t camera,
                                            double rate_hz) {
  SpotsRecording recording;
  DatasetFaults faults;
  std::error_code status;
  if (fs::exists(options.source / "swarm.yaml", status)) {
    return fail(ErrorCode::kUsage,
                options.source.string() + ": holds a swarm; name the folder of one robot");
  }
  const fs::path own = options.source / fmt::format("cam{}", camera);
  const fs::path folder = fs::is_directory(own, status) ? own : options.source;
  const fs::path spots = folder / "spots.csv";
  if (!fs::exists(folder / "data.csv", status) && fs::exists(spots, status)) {
    auto frames = load_spots(spots, static_cast<std::uint8_t>(camera), faults);
    if (!frames) return tl::unexpected(frames.error());
    recording.frames = std::move(*frames);
    if (recording.frames.empty())
      return fail(ErrorCode::kNotFound, spots.string() + ": holds no frames");
  } else {
    auto pictures = list_pictures(folder, rate_hz);
    if (!pictures) return tl::unexpected(pictures.error());
    recording.pictures = std::move(*pictures);
  }
  const fs::path imu_file = robot_folder_of(options.source) / "imu0" / "data.csv";
  if (fs::is_directory(options.source, status) && fs::exists(imu_file, status)) {
    auto imu = load_imu(imu_file, faults);
    if (!imu) return tl::unexpected(imu.error());
    recording.imu = std::move(*imu);
  }
  if (faults.total() > 0 && options.on_fault)
    options.on_fault(fmt::format("{} rows; the last: {}", faults.total(), faults.last()));
  return recording;
}

}  // namespace crepes
