#include "drivers/dataset/dataset_rows.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

template <class First, class... Rest>
void append_row(std::string& text, First first, Rest... rest) {
  append_number(text, first);
  ((text += ',', append_number(text, rest)), ...);
  text += '\n';
}

/// The next line of `rows`, without its end, which are shortened by it.
std::string_view next_line(std::string_view& rows) {
  const std::size_t end = std::min(rows.find('\n'), rows.size());
  const std::string_view line = rows.substr(0, end);
  rows.remove_prefix(std::min(end + 1, rows.size()));
  return line;
}

/// The stamp and the numbers of a row. Empty if one of them is none.
template <std::size_t N>
struct Row {
  std::int64_t t_ns = 0;
  std::array<double, N> values{};
};

template <std::size_t N>
std::optional<Row<N>> row_of(std::string_view line) {
  Row<N> row;
  std::size_t end = std::min(line.find(','), line.size());
  if (!parse_number(line.substr(0, end), row.t_ns).empty()) return std::nullopt;
  for (double& value : row.values) {
    line.remove_prefix(std::min(end + 1, line.size()));
    end = std::min(line.find(','), line.size());
    if (!parse_number(line.substr(0, end), value).empty()) return std::nullopt;
  }
  return row;
}

}  // namespace

void append_rows(std::string& text, const ImuSample& sample) {
  const auto& [stamp, w, a] = sample;
  append_row(text, to_ns(stamp), w.x(), w.y(), w.z(), a.x(), a.y(), a.z());
}

void append_rows(std::string& text, const UwbRange& range) {
  append_row(text, to_ns(range.stamp), range.neighbor.value, range.range_m, range.first_path_dbm,
             range.received_dbm);
}

void append_rows(std::string& text, const SpotFrame& frame) {
  const std::int64_t stamp = to_ns(frame.stamp);
  if (frame.spots.empty()) text += fmt::format("{},,,,\n", stamp);
  for (const Spot& spot : frame.spots)
    append_row(text, stamp, spot.u_px, spot.v_px, spot.area_px2, spot.peak);
}

std::vector<ImuSample> imu_samples(std::string_view rows) {
  std::vector<ImuSample> samples;
  while (!rows.empty()) {
    const auto row = row_of<6>(next_line(rows));
    if (!row) continue;
    const auto& v = row->values;
    samples.push_back({Timestamp{Duration{row->t_ns}}, {v[0], v[1], v[2]}, {v[3], v[4], v[5]}});
  }
  return samples;
}

std::vector<SpotFrame> spot_frames(std::string_view rows) {
  std::vector<SpotFrame> frames;
  while (!rows.empty()) {
    const std::string_view line = next_line(rows);
    const auto stamp = row_of<0>(line);
    if (!stamp) continue;
    const Timestamp t{Duration{stamp->t_ns}};
    if (frames.empty() || frames.back().stamp != t)
      frames.push_back({.stamp = t, .camera = 0, .spots = {}});
    const auto row = row_of<4>(line);
    if (!row) continue;
    const auto& v = row->values;
    frames.back().spots.push_back({.u_px = v[0], .v_px = v[1], .area_px2 = v[2], .peak = v[3]});
  }
  return frames;
}

void append_bearing_row(std::string& text, Timestamp frame, const Bearing& bearing, double u_px,
                        double v_px) {
  const Eigen::Vector3d& u_B = bearing.u_B;
  append_row(text, to_ns(frame), bearing.neighbor.value, u_px, v_px, u_B.x(), u_B.y(), u_B.z(),
             bearing.sigma_rad);
  text.back() = ',';
  text += bearing.how == Naming::kRead ? "read\n" : "predicted\n";
}

}  // namespace crepes
