/// Measurements as rows of the data set's CSV files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

inline constexpr std::string_view kImuHeader = "#timestamp [ns],wx,wy,wz,ax,ay,az\n";
inline constexpr std::string_view kRangeHeader =
    "#timestamp [ns],peer,distance [m],first path [dBm],received [dBm]\n";
inline constexpr std::string_view kSpotHeader = "#timestamp [ns],u,v,area,peak\n";
inline constexpr std::string_view kPictureHeader = "#timestamp [ns],filename\n";
inline constexpr std::string_view kBearingHeader = "t_ns,id,u,v,bx,by,bz,sigma_rad,how\n";

void append_rows(std::string& text, const ImuSample& sample);
void append_rows(std::string& text, const UwbRange& range);
/// One row per spot. A frame without spots is one row.
void append_rows(std::string& text, const SpotFrame& frame);
/// What `append_rows` has written. A row that is none is left out.
[[nodiscard]] std::vector<ImuSample> imu_samples(std::string_view rows);
[[nodiscard]] std::vector<SpotFrame> spot_frames(std::string_view rows);

/// A bearing in the picture of `frame`, at the pixel `u_px`, `v_px`.
void append_bearing_row(std::string& text, Timestamp frame, const Bearing& bearing, double u_px,
                        double v_px);

}  // namespace crepes
