/// Connected bright pixels of a gray image.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace crepes {

/// An 8-bit image that someone else owns.
struct GrayImage {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next

  [[nodiscard]] const std::uint8_t* row(int v) const { return pixels + v * stride; }
};

/// Pixels from `u_min, v_min` to `u_max, v_max`, both included.
struct PixelBox {
  int u_min = 0, v_min = 0;
  int u_max = -1, v_max = -1;

  [[nodiscard]] int width() const { return u_max - u_min + 1; }
  [[nodiscard]] int height() const { return v_max - v_min + 1; }
  [[nodiscard]] int longer_side() const { return std::max(width(), height()); }
  [[nodiscard]] int shorter_side() const { return std::min(width(), height()); }
  /// Larger by `by` pixels on each side; it may leave the image.
  [[nodiscard]] PixelBox grown(int by) const {
    return {u_min - by, v_min - by, u_max + by, v_max + by};
  }
  [[nodiscard]] bool overlaps(const PixelBox& other) const;
  void include(const PixelBox& other);
};

/// Sums over connected pixels, weighted by how far each rises above a level.
struct Blob {
  PixelBox box;
  std::int32_t area = 0;                ///< pixels
  std::int64_t weight = 0;              ///< 0: huge, and not measured
  std::int64_t u = 0, v = 0;            ///< weighted
  std::int64_t uu = 0, uv = 0, vv = 0;  ///< weighted
  int peak = 0;

  [[nodiscard]] double mean_u() const { return static_cast<double>(u) / double(weight); }
  [[nodiscard]] double mean_v() const { return static_cast<double>(v) / double(weight); }
  /// Ratio of the principal axes, 1 for round.
  [[nodiscard]] double elongation() const;
  void absorb(const Blob& part);
};

/// A pixel that does not reach the threshold, and that no neighbor outshines.
struct FaintPeak {
  int u = 0;
  int v = 0;
};

/// A pixel that errs, and what it should show.
struct MendedPixel {
  int u = 0;
  int v = 0;
  std::uint8_t level = 0;
};

/// Finds the blobs of one image after another.
class BlobFinder {
 public:
  BlobFinder();

  /// Appends the 8-connected blobs of pixels at or above `threshold`, those of more than `max_area`
  /// pixels without their sums, ordered by first row. False, and nothing appended, when the image
  /// holds so many that it must be noise.
  [[nodiscard]] bool find(const GrayImage& image, int threshold, double max_area,
                          std::vector<Blob>& blobs) {
    return find(image, {threshold, threshold}, {}, max_area, blobs);
  }
  /// The same, but a blob that ends in one of the `mended` pixels uses the pixel's corrected value.
  /// They are ordered by row and column.
  struct Levels {
    int threshold = 0;
    int faint = 0;  ///< at most the threshold; if lower, faint_peaks() are the peaks from it on
  };
  [[nodiscard]] bool find(const GrayImage& image, Levels levels,
                          std::span<const MendedPixel> mended, double max_area,
                          std::vector<Blob>& blobs);

  /// Peaks of the last find() that belong to no blob. Empty if there were so many that they are
  /// texture.
  [[nodiscard]] std::span<const FaintPeak> faint_peaks() const { return faint_; }

  /// Which of the blobs that the last find() appended has the pixel, counted from 0.
  [[nodiscard]] std::optional<std::size_t> blob_at(int u, int v) const;

  /// Calls visit(u, v) for the pixels of one of them, which lie in `box`.
  template <class Visit>
  void visit(std::size_t blob, const PixelBox& box, const Visit& visit) const {
    auto run = std::partition_point(runs_.begin(), runs_.end(),
                                    [&](const Run& r) { return r.row < box.v_min; });
    for (; run != runs_.end() && run->row <= box.v_max; ++run) {
      if (blob_of_[static_cast<std::size_t>(run - runs_.begin())] != blob) continue;
      for (int u = run->begin; u < run->end; ++u) visit(u, run->row);
    }
  }

 private:
  struct Run {
    int row = 0;
    int begin = 0;
    int end = 0;
    std::uint32_t parent = 0;  ///< union-find over runs
  };

  void find_runs(const GrayImage& image, int v, Levels levels);
  void find_peak(const GrayImage& image, int v, int begin, int end);
  void add_run(int v, int begin, int end, int threshold);
  [[nodiscard]] std::uint32_t root_of(std::uint32_t run);
  void link_rows();
  void outline(std::vector<Blob>& blobs);

  std::vector<Run> runs_;
  std::vector<FaintPeak> faint_;
  std::span<const MendedPixel> mended_;  ///< those of later rows, and of this
  std::vector<std::uint32_t> blob_of_;
};

}  // namespace crepes
