#include "daemon/ctl/live/light_advice.hpp"

#include <cstdint>

namespace crepes {

bool is_spots(const client::Status::Sensor& sensor) { return sensor.name.ends_with(kSpotsSuffix); }

std::string light_advice(const client::Status::Totals& counts) {
  constexpr std::uint64_t kBright = 60;  // gray levels of the darkest part of the picture
  constexpr std::uint64_t kWhite = 250;
  constexpr std::uint64_t kClutter = 30;  // spots in a frame
  constexpr std::uint64_t kMargin = 20;   // gray levels above the threshold
  const auto total = [&](const char* name) {
    const auto found = counts.find(name);
    return found == counts.end() ? std::uint64_t{0} : found->second;
  };
  if (total("background") > kBright) {
    return "the picture is too bright: shorten exposure_us (crepesctl exposure), check the "
           "infrared filter";
  }
  if (total("brightest") == 0)
    return "put another robot's board in view, at the longest distance that you need";
  if (total("spots") > kClutter)
    return "lamps, windows or mirrors are in view: shorten exposure_us";
  const bool is_automatic = total("auto_exposure_us") > 0;
  if (is_automatic && total("auto_exposure_us") < total("longest_exposure_us")) return "";
  if (total("brightest") < kWhite && !is_automatic)
    return "no board is white: lengthen exposure_us, or raise gain";
  if (total("faintest") < total("threshold") + kMargin) {
    return "the faintest light is nearly lost: if it is a board, lengthen exposure_us; if not, "
           "shorten it";
  }
  return "";
}

}  // namespace crepes
