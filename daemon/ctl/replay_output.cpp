#include "daemon/ctl/replay_output.hpp"

#include <cerrno>
#include <fstream>

#include "daemon/ctl/pose_file.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

fs::path part_of(fs::path file) { return file += ".part"; }

Result<void> write_text(const fs::path& file, std::string_view text, std::ios::openmode mode) {
  std::ofstream out(file, std::ios::binary | mode);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  if (out) return {};
  return fail(ErrorCode::kIo, file.string() + ": " + std::generic_category().message(errno));
}

Result<void> publish(const fs::path& file) {
  std::error_code status;
  fs::rename(part_of(file), file, status);
  if (!status) return {};
  return fail(ErrorCode::kIo, file.string() + ": " + status.message());
}

}  // namespace

Result<ReplayOutput> ReplayOutput::create(const fs::path& dir, Names names) {
  ReplayOutput output(dir, std::move(names));
  std::error_code status;
  fs::remove(dir / "report.json", status);  // the mark of a whole result goes first
  for (const auto& [observer, observer_name] : output.names_) {
    fs::create_directories(dir / observer_name, status);
    if (status)
      return fail(ErrorCode::kIo, (dir / observer_name).string() + ": " + status.message());
    for (const auto& [neighbor, neighbor_name] : output.names_) {
      if (neighbor == observer) continue;
      PairFile file{.csv = dir / observer_name / (neighbor_name + ".csv"),
                    .tum = dir / observer_name / (neighbor_name + ".tum"),
                    .csv_text = {},
                    .tum_text = {}};
      for (const fs::path& path : {file.csv, file.tum}) {
        fs::remove(path, status);
        const bool is_csv = path == file.csv;
        const std::string header = is_csv ? std::string(pose_file_header()) + '\n' : "";
        if (auto done = write_text(part_of(path), header, std::ios::trunc); !done)
          return tl::unexpected(done.error());
      }
      output.pairs_.emplace(std::pair(observer, neighbor), std::move(file));
    }
  }
  return output;
}

void ReplayOutput::write(RobotId observer, const NeighborPose& pose) {
  constexpr std::size_t kFlushAt = 1 << 16;
  const auto pair = pairs_.find({observer, pose.neighbor});
  CREPES_EXPECT(pair != pairs_.end(), "a pose of a robot that is not in the data set");
  CREPES_EXPECT(pose.T_B_N.pose.p.allFinite() && pose.T_B_N.pose.q.coeffs().allFinite() &&
                    pose.T_B_N.covariance.allFinite(),
                "a pose that is not finite");
  append_pose_row(pair->second.csv_text, pose);
  append_tum_row(pair->second.tum_text, pose);
  if (pair->second.csv_text.size() >= kFlushAt) flush(pair->second);
}

void ReplayOutput::flush(PairFile& file) {
  for (auto [path, text] : {std::pair(&file.csv, &file.csv_text), {&file.tum, &file.tum_text}}) {
    const auto done = write_text(part_of(*path), *text, std::ios::app);
    if (!done && !failure_) failure_ = done.error();
    text->clear();
  }
}

Result<void> ReplayOutput::finish(const ReplayReport& report) {
  for (auto& [pair, file] : pairs_) flush(file);
  if (failure_) return tl::unexpected(*failure_);
  for (const auto& [pair, file] : pairs_) {
    for (const fs::path& path : {file.csv, file.tum})
      if (auto done = publish(path); !done) return done;
  }
  const fs::path report_file = dir_ / "report.json";
  return write_text(part_of(report_file), report_json(report, names_), std::ios::trunc)
      .and_then([&] { return publish(report_file); });
}

}  // namespace crepes
