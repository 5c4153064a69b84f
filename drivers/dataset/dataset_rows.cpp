#include "drivers/dataset/dataset_rows.hpp"

#include <fmt/core.h>

#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

template <class First, class... Rest>
void append_row(std::string& text, First first, Rest... rest) {
  append_number(text, first);
  ((text += ',', append_number(text, rest)), ...);
  text += '\n';
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

void append_bearing_row(std::string& text, Timestamp frame, const Bearing& bearing, double u_px,
                        double v_px) {
  const Eigen::Vector3d& u_B = bearing.u_B;
  append_row(text, to_ns(frame), bearing.neighbor.value, u_px, v_px, u_B.x(), u_B.y(), u_B.z(),
             bearing.sigma_rad);
  text.back() = ',';
  text += "read\n";
}

}  // namespace crepes
