#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/setup/spots.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

const char* to_text(Exposure exposure) {
  switch (exposure) {
    case Exposure::kDark:
      return "dark";
    case Exposure::kBright:
      return "bright";
    case Exposure::kGood:
      break;
  }
  return "good";
}

std::string range_text(const auto& extent) {
  return extent.min == extent.max ? fmt::format("{}", extent.min)
                                  : fmt::format("{} to {}", extent.min, extent.max);
}

std::string share_text(std::uint64_t part, std::uint64_t whole) {
  return fixed(100.0 * static_cast<double>(part) / static_cast<double>(whole), 1) + " %";
}

Json to_json(const Rejected& rejected) {
  return {{"hot", rejected.hot},
          {"huge", rejected.huge},
          {"faint", rejected.faint},
          {"surplus", rejected.surplus},
          {"cut", rejected.cut}};
}

std::string to_text(const Rejected& rejected) {
  return fmt::format("{} hot pixels, {} huge, {} faint, {} surplus, {} cut by the border",
                     rejected.hot, rejected.huge, rejected.faint, rejected.surplus, rejected.cut);
}

double mean_spots(const SpotsSummary& summary) {
  return static_cast<double>(summary.all_spots) / static_cast<double>(summary.pictures);
}

}  // namespace

std::string exposure_advice(const SpotsSummary& summary) {
  const std::string because = fmt::format(
      "background {}, threshold {}, at most {} % saturated", range_text(summary.background),
      range_text(summary.threshold), fixed(100.0 * summary.most_saturated, 1));
  const std::string manual =
      summary.is_automatic ? "" : "; set vision.threshold to 0 (automatic) to see what that finds";
  if (2 * summary.bright > summary.pictures) {
    return fmt::format(
        "too bright ({}): shorten the exposure or lower the gain, and check that the infrared "
        "filter is in place{}",
        because, manual);
  }
  if (summary.dark == summary.pictures) {
    return fmt::format(
        "all dark, nothing stands out ({}): check the lens cap, and that a board is lit and in "
        "view; then lengthen the exposure or raise the gain{}",
        because, manual);
  }
  return "";
}

std::string picture_caption(const PictureFindings& findings) {
  const Detection& found = findings.detection;
  return fmt::format("{} spots, threshold {}, exposure {}", found.spots.size(), found.threshold,
                     to_text(found.exposure));
}

std::string picture_text(const PictureFindings& findings) {
  std::vector<std::vector<std::string>> rows{
      {"spot", "u [px]", "v [px]", "area [px2]", "peak", "elongation"}};
  for (const Spot& spot : findings.detection.spots) {
    rows.push_back({std::to_string(rows.size()), fixed(spot.u_px, 2), fixed(spot.v_px, 2),
                    fixed(spot.area_px2, 0), fixed(spot.peak, 0), fixed(spot.elongation, 2)});
  }
  return rows.size() > 1 ? text_table(rows) + "\n" : "";
}

std::string picture_json(const PictureFindings& findings) {
  const Detection& found = findings.detection;
  Json json{{"class", "PICTURE"},
            {"file", findings.file.string()},
            {"t_ns", std::to_string(findings.stamp.time_since_epoch().count())},
            {"background", found.background},
            {"threshold", found.threshold},
            {"exposure", to_text(found.exposure)},
            {"saturated_share", found.saturated_share},
            {"rejected", to_json(found.rejected)},
            {"spots", Json::array()},
            {"robots", Json::array()}};
  if (!found.failure.empty()) json["failure"] = std::string(found.failure);
  for (const Spot& spot : found.spots) {
    json["spots"].push_back({{"u", spot.u_px},
                             {"v", spot.v_px},
                             {"area", spot.area_px2},
                             {"peak", spot.peak},
                             {"elongation", spot.elongation}});
  }
  for (const RobotSighting& robot : findings.robots) {
    json["robots"].push_back(
        {{"id", robot.id.value}, {"name", robot.name}, {"u", robot.u_px}, {"v", robot.v_px}});
  }
  return json_line(json);
}

std::string summary_text(const SpotsSummary& summary) {
  const std::uint64_t all = summary.pictures;
  std::string text = fmt::format("{} {}", all, all == 1 ? "picture" : "pictures");
  if (all > 1) text += fmt::format(", {} s", fixed(summary.duration_s, 3));
  if (summary.refused > 0) text += fmt::format("; {} refused", summary.refused);
  text += fmt::format("\nthreshold  {} ({}), background {}, at most {} % saturated\n",
                      range_text(summary.threshold),
                      summary.is_automatic ? "automatic" : "vision.threshold",
                      range_text(summary.background), fixed(100.0 * summary.most_saturated, 1));
  text += fmt::format("spots      {} a picture, mean {}\n", range_text(summary.spots),
                      fixed(mean_spots(summary), 2));
  text += fmt::format("left out   {}\n", to_text(summary.rejected));
  text += fmt::format("exposure   good {}, dark {}, bright {}\n", share_text(summary.good, all),
                      share_text(summary.dark, all), share_text(summary.bright, all));
  if (summary.failures > 0)
    text += fmt::format("failures   the detector failed on {} pictures\n", summary.failures);
  for (const auto& [id, robot] : summary.robots) {
    text += fmt::format("robot {}    {}, in {} of the pictures, first after {} s\n", id.value,
                        robot.name, share_text(robot.pictures, all), fixed(robot.first_s, 3));
  }
  if (summary.robots.empty() && all > 1) text += "robots     none was recognized\n";
  const std::string advice = exposure_advice(summary);
  return advice.empty() ? text : fmt::format("{}ADVICE     {}\n", text, advice);
}

std::string summary_json(const SpotsSummary& summary) {
  const auto range = [](const auto& extent) { return Json::array({extent.min, extent.max}); };
  Json json{
      {"class", "SUMMARY"},
      {"pictures", summary.pictures},
      {"refused", summary.refused},
      {"duration_s", summary.duration_s},
      {"background", range(summary.background)},
      {"threshold", range(summary.threshold)},
      {"automatic", summary.is_automatic},
      {"spots", range(summary.spots)},
      {"spots_mean", mean_spots(summary)},
      {"saturated_share", summary.most_saturated},
      {"rejected", to_json(summary.rejected)},
      {"exposure", {{"good", summary.good}, {"dark", summary.dark}, {"bright", summary.bright}}},
      {"failures", summary.failures},
      {"robots", Json::array()}};
  for (const auto& [id, robot] : summary.robots) {
    json["robots"].push_back({{"id", id.value},
                              {"name", robot.name},
                              {"pictures", robot.pictures},
                              {"first_s", robot.first_s}});
  }
  const std::string advice = exposure_advice(summary);
  if (!advice.empty()) json["advice"] = advice;
  return json_line(json);
}

}  // namespace crepes
