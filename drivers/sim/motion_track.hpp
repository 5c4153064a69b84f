/// The motions of robots that are steered, as a file that separate processes share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "drivers/sim/velocity_lag.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One record for every 20 ms of world time, written before that time begins. Where a record is not
/// there yet, the last one continues: its command holds. So all processes agree on where a robot
/// is, also when the writer is late.
inline constexpr double kTrackPeriod = 0.02;  // s

/// One writer, which appends.
class MotionTrackWriter {
 public:
  [[nodiscard]] static Result<MotionTrackWriter> create(const std::filesystem::path& file,
                                                        std::size_t robots);

  /// The next record: where each robot is when its time begins, and its command.
  [[nodiscard]] Result<void> append(const std::vector<SteeredState>& robots);
  /// World time at which the next record begins.
  [[nodiscard]] double next_s() const { return kTrackPeriod * static_cast<double>(records_); }

 private:
  MotionTrackWriter(UniqueFd file, std::string name, std::size_t robots)
      : file_(std::move(file)), name_(std::move(name)), robots_(robots) {}

  UniqueFd file_;
  std::string name_;
  std::size_t robots_;
  std::uint64_t records_ = 0;
};

/// Any number of readers. Thread-safe: reading has no state.
class MotionTrackReader {
 public:
  [[nodiscard]] static Result<MotionTrackReader> open(const std::filesystem::path& file,
                                                      std::size_t robots);

  /// The record for `t_s`; the first or last one outside of what is written. Empty before there is
  /// any.
  [[nodiscard]] std::optional<SteeredState> at(std::size_t robot, double t_s) const;

 private:
  MotionTrackReader(UniqueFd file, std::size_t robots) : file_(std::move(file)), robots_(robots) {}
  [[nodiscard]] std::int64_t records() const;

  UniqueFd file_;
  std::size_t robots_;
};

}  // namespace crepes
