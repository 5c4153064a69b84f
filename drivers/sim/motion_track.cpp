#include "drivers/sim/motion_track.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "drivers/base/io_failure.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

static_assert(std::is_trivially_copyable_v<SteeredState>);

}  // namespace

Result<MotionTrackWriter> MotionTrackWriter::create(const std::filesystem::path& file,
                                                    std::size_t robots) {
  UniqueFd fd{::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)};
  if (!fd) return io_failure(file.string());
  return MotionTrackWriter(std::move(fd), file.string(), robots);
}

Result<void> MotionTrackWriter::append(const std::vector<SteeredState>& robots) {
  CREPES_EXPECT(robots.size() == robots_, "a record has all robots");
  const std::size_t bytes = robots_ * sizeof(SteeredState);
  const auto written = ::write(file_.get(), robots.data(), bytes);
  if (written < 0) return io_failure(name_);
  if (static_cast<std::size_t>(written) != bytes)
    return fail(ErrorCode::kIo, name_ + ": no space for a whole record");
  ++records_;
  return {};
}

Result<MotionTrackReader> MotionTrackReader::open(const std::filesystem::path& file,
                                                  std::size_t robots) {
  UniqueFd fd{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (!fd) return io_failure(file.string());
  return MotionTrackReader(std::move(fd), robots);
}

/// Whole records; the size of a file grows only after its bytes are there.
std::int64_t MotionTrackReader::records() const {
  struct stat status {};
  if (::fstat(file_.get(), &status) != 0) return 0;
  return status.st_size / static_cast<std::int64_t>(robots_ * sizeof(SteeredState));
}

std::optional<SteeredState> MotionTrackReader::at(std::size_t robot, double t_s) const {
  const std::int64_t last = records() - 1;
  if (last < 0) return std::nullopt;
  // A record's own time, not its index, says where it begins: rounding must not pick the next one.
  const auto wanted = static_cast<std::int64_t>(std::floor(t_s / kTrackPeriod + 1e-9));
  const auto record = static_cast<std::size_t>(std::clamp<std::int64_t>(wanted, 0, last));
  SteeredState state;
  const std::size_t at = (record * robots_ + robot) * sizeof state;
  if (::pread(file_.get(), &state, sizeof state, static_cast<off_t>(at)) != sizeof state)
    return std::nullopt;
  return state;
}

}  // namespace crepes
