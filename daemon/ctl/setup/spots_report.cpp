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

std::string threshold_line(const SpotsSummary& summary) {
  return fmt::format("threshold  {} ({}), background {}, at most {} % saturated\n",
                     range_text(summary.threshold),
                     summary.is_automatic ? "automatic" : "vision.threshold",
                     range_text(summary.background), fixed(100.0 * summary.most_saturated, 1));
}

/// What to change, on a line each.
std::vector<std::string> all_advice_of(const SpotsSummary& summary) {
  std::vector<std::string> all{exposure_advice(summary), identity_advice(summary)};
  std::erase(all, "");
  return all;
}

double mean_spots(const SpotsSummary& summary) {
  return static_cast<double>(summary.all_spots) / static_cast<double>(summary.pictures);
}

}  // namespace

std::string exposure_advice(const SpotsSummary& summary) {
  if (summary.is_of_spots) return "";
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

std::string identity_advice(const SpotsSummary& summary) {
  constexpr double kFramesOfASlot = 2.0;
  constexpr double kWithin = 0.9;
  if (!summary.robots.empty() || summary.pictures < 2) return "";
  const double rate_hz = static_cast<double>(summary.pictures - 1) / summary.duration_s;
  const double least_hz = kFramesOfASlot / (1e-3 * summary.slot_ms);
  if (rate_hz < kWithin * least_hz) {
    return fmt::format("{} pictures a second are too few to read slots of {} ms: {} or more",
                       fixed(rate_hz, 1), summary.slot_ms, fixed(least_hz, 0));
  }
  return summary.all_spots == 0
             ? ""
             : "no light blinks as a member: compare the boards' patterns with swarm.members";
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
  Json json{{"class", "PICTURE"}};
  if (!findings.file.empty()) json["file"] = findings.file.string();
  json["t_ns"] = std::to_string(findings.stamp.time_since_epoch().count());
  if (!findings.file.empty()) {  // else it is of spots.csv
    json["background"] = found.background;
    json["threshold"] = found.threshold;
    json["exposure"] = to_text(found.exposure);
    json["saturated_share"] = found.saturated_share;
    json["rejected"] = to_json(found.rejected);
  }
  json["spots"] = Json::array();
  json["robots"] = Json::array();
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
  text += summary.is_of_spots ? "; of spots.csv\n" : "\n" + threshold_line(summary);
  text += fmt::format("spots      {} a picture, mean {}\n", range_text(summary.spots),
                      fixed(mean_spots(summary), 2));
  if (!summary.is_of_spots) {
    text += fmt::format("left out   {}\n", to_text(summary.rejected));
    text += fmt::format("exposure   good {}, dark {}, bright {}\n", share_text(summary.good, all),
                        share_text(summary.dark, all), share_text(summary.bright, all));
  }
  if (summary.failures > 0)
    text += fmt::format("failures   the detector failed on {} pictures\n", summary.failures);
  for (const auto& [id, robot] : summary.robots) {
    text += fmt::format("robot {}    {}, in {} of the pictures, first after {} s\n", id.value,
                        robot.name, share_text(robot.pictures, all), fixed(robot.first_s, 3));
  }
  if (summary.robots.empty() && all > 1) text += "robots     none was recognized\n";
  for (const std::string& advice : all_advice_of(summary))
    text += fmt::format("ADVICE     {}\n", advice);
  return text;
}

std::string summary_json(const SpotsSummary& summary) {
  const auto range = [](const auto& extent) { return Json::array({extent.min, extent.max}); };
  Json json{{"class", "SUMMARY"},
            {"pictures", summary.pictures},
            {"refused", summary.refused},
            {"duration_s", summary.duration_s}};
  if (!summary.is_of_spots) {
    json["background"] = range(summary.background);
    json["threshold"] = range(summary.threshold);
    json["automatic"] = summary.is_automatic;
  }
  json["spots"] = range(summary.spots);
  json["spots_mean"] = mean_spots(summary);
  if (!summary.is_of_spots) {
    json["saturated_share"] = summary.most_saturated;
    json["rejected"] = to_json(summary.rejected);
    json["exposure"] = {{"good", summary.good}, {"dark", summary.dark}, {"bright", summary.bright}};
    json["failures"] = summary.failures;
  }
  json["robots"] = Json::array();
  for (const auto& [id, robot] : summary.robots) {
    json["robots"].push_back({{"id", id.value},
                              {"name", robot.name},
                              {"pictures", robot.pictures},
                              {"first_s", robot.first_s}});
  }
  std::string advice;
  for (const std::string& one : all_advice_of(summary))
    advice += (advice.empty() ? "" : "; ") + one;
  if (!advice.empty()) json["advice"] = advice;
  return json_line(json);
}

}  // namespace crepes
