/// Recorded images in a folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// The image in a file, in grey and without a stamp. Errors name the file.
[[nodiscard]] Result<Frame> read_gray_image(const std::filesystem::path& file);
/// Likewise, a picture that `camera` took: refused if it has another size.
[[nodiscard]] Result<Frame> read_gray_image(const std::filesystem::path& file,
                                            const CameraCalibration& camera);

/// The file of a picture and its stamp.
struct RecordedPicture {
  Timestamp stamp{};
  std::filesystem::path file;
};

/// Reads a list of images: rows `t_ns,file name` after a `#` header; the files are in `pictures`.
/// Refuses rows that do not parse, stamps that decrease and missing files.
[[nodiscard]] Result<std::vector<RecordedPicture>> read_picture_list(
    const std::filesystem::path& csv, const std::filesystem::path& pictures);

/// Plays the images of a folder once, at their recorded rate, as if they were taken now. A picture
/// that cannot be read, or that has another size than the camera's, is skipped and counted.
class FolderCamera final : public Camera {
 public:
  /// `folder` holds the images; data.csv is beside it. `index` is the camera's among those
  /// configured. `clock` must outlive this.
  [[nodiscard]] static Result<std::unique_ptr<Camera>> open(const std::filesystem::path& folder,
                                                            const CameraCalibration& camera,
                                                            std::uint8_t index, const Clock& clock);

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override;
  [[nodiscard]] SensorTotals counters() const override;
  [[nodiscard]] std::optional<std::string> diagnosis() const override;

 private:
  FolderCamera(std::vector<RecordedPicture> pictures, CameraCalibration camera, std::uint8_t index,
               const Clock& clock)
      : pictures_(std::move(pictures)),
        camera_(std::move(camera)),
        index_(index),
        clock_(clock),
        begin_(clock.now()) {}

  std::vector<RecordedPicture> pictures_;
  CameraCalibration camera_;
  std::uint8_t index_;
  const Clock& clock_;
  Timestamp begin_;  ///< when the first image is due
  std::size_t next_ = 0;
  std::uint64_t unreadable_ = 0;
  std::string last_error_;  ///< of an unreadable picture
};

}  // namespace crepes
