/// The pictures of a file or folder, and the time of each.
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/camera/image_folder.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// `source` is a picture, a data set's `cam<k>` or `cam<k>/data` with its list data.csv, or any
/// folder of pictures. In such a folder, names that are all numbers are nanoseconds; other pictures
/// are stamped at `rate_hz` in the order of their names. Stamps increase.
[[nodiscard]] Result<std::vector<RecordedPicture>> list_pictures(
    const std::filesystem::path& source, double rate_hz);

/// The number in the last part of `source` that is called `cam<number>`; 0 when there is none.
[[nodiscard]] std::size_t camera_index_of(const std::filesystem::path& source);

}  // namespace crepes
