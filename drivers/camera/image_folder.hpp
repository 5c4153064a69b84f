/// Recorded images in a folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// The image in a file, in grey and without a stamp. Errors name the file.
[[nodiscard]] Result<Frame> read_gray_image(const std::filesystem::path& file);

/// The file of a picture and its stamp.
struct RecordedPicture {
  Timestamp stamp{};
  std::filesystem::path file;
};

/// Reads a list of images: rows `t_ns,file name` after a `#` header; the files are in `pictures`.
/// Refuses rows that do not parse, stamps that decrease and missing files.
[[nodiscard]] Result<std::vector<RecordedPicture>> read_picture_list(
    const std::filesystem::path& csv, const std::filesystem::path& pictures);

/// Plays the images of a folder once, at their recorded rate, as if they were taken now.
class FolderCamera final : public Camera {
 public:
  /// `folder` holds the images; data.csv is beside it. `clock` must outlive this.
  [[nodiscard]] static Result<std::unique_ptr<Camera>> open(const std::filesystem::path& folder,
                                                            std::uint8_t camera,
                                                            const Clock& clock);

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override;
  [[nodiscard]] SensorTotals counters() const override;

 private:
  FolderCamera(std::vector<RecordedPicture> pictures, std::uint8_t camera, const Clock& clock)
      : pictures_(std::move(pictures)), camera_(camera), clock_(clock), begin_(clock.now()) {}

  std::vector<RecordedPicture> pictures_;
  std::uint8_t camera_;
  const Clock& clock_;
  Timestamp begin_;  ///< when the first image is due
  std::size_t next_ = 0;
};

}  // namespace crepes
