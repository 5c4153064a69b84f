#include "daemon/ctl/score/plot.hpp"

#include <fmt/core.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/ctl/dataset/replay_pairs.hpp"
#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "daemon/ctl/dataset/truth.hpp"
#include "daemon/ctl/replaceable.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/ctl/score/plot_pair.hpp"
#include "daemon/ctl/score/plot_parts.hpp"
#include "daemon/ctl/score/plot_team.hpp"
#include "daemon/ctl/score/svg_chart.hpp"
#include "drivers/dataset/part_file.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

struct PlottedRecording {
  SwarmManifest manifest;
  SwarmTruth truth;
};

Result<PlottedRecording> load_recording(const PlotOptions& options) {
  auto manifest = load_manifest(options.swarm);
  if (!manifest) return tl::unexpected(manifest.error());
  if (auto same = check_same_recording(options.results, *manifest); !same)
    return tl::unexpected(same.error());
  auto truth = SwarmTruth::load(options.swarm, *manifest);
  if (!truth) return tl::unexpected(truth.error());
  return PlottedRecording{std::move(*manifest), std::move(*truth)};
}

Result<SwarmRobot> robot_named(const PlottedRecording& recording, const std::string& name,
                               const PlotOptions& options) {
  for (const SwarmRobot& robot : recording.manifest.robots)
    if (robot.name == name) return robot;
  return fail(ErrorCode::kNotFound,
              fmt::format("{}: no robot '{}', of which there are results in {}",
                          options.swarm.string(), name, options.results.string()));
}

Result<PairData> load_pair(const PlotOptions& options, const PairName& name) {
  return read_pair(options.results, name).map([&](PairFiles&& files) {
    return PairData{.observer = name.observer,
                    .neighbor = name.neighbor,
                    .poses = std::move(files.poses),
                    .measurements = std::move(files.measurements),
                    .calibrations = std::move(files.calibrations),
                    .truth = {},
                    .observer_truth = {},
                    .seconds = {},
                    .duration_s = 0.0};
  });
}

/// Seconds of true time if it is known, otherwise since the observer's first row.
Result<void> set_time_axis(const std::optional<PlottedRecording>& recording,
                           const PlotOptions& options, PairData& pair) {
  if (!recording) {
    const Timestamp start = pair.poses.empty() ? Timestamp{} : pair.poses.front().stamp;
    pair.seconds = [start](Timestamp t) { return to_seconds(t - start); };
    pair.duration_s = pair.poses.empty() ? 1.0 : pair.seconds(pair.poses.back().stamp) + 0.02;
    return {};
  }
  const auto observer = robot_named(*recording, pair.observer, options);
  if (!observer) return tl::unexpected(observer.error());
  const auto neighbor = robot_named(*recording, pair.neighbor, options);
  if (!neighbor) return tl::unexpected(neighbor.error());
  pair.truth = [&recording, B = observer->id, N = neighbor->id](Timestamp local) {
    return recording->truth.relative(B, N, local);
  };
  pair.observer_truth = [&recording, B = *observer](Timestamp local) {
    return recording->truth.pose(B.id, B.clock.true_s(local));
  };
  pair.seconds = [clock = observer->clock](Timestamp local) { return clock.true_s(local); };
  pair.duration_s = recording->manifest.duration_s;
  return {};
}

std::string anchor(const PairData& pair) {
  return fmt::format("{}-{}", pair.observer, pair.neighbor);
}

std::string table_row(const std::vector<std::string>& cells, const char* tag,
                      const std::string& link = {}) {
  std::string row = "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string text = xml_escaped(cells[i]);
    const bool linked = i == 0 && !link.empty();
    row +=
        fmt::format("<{0}>{1}</{0}>", tag,
                    linked ? fmt::format("<a href='#{}'>{}</a>", xml_escaped(link), text) : text);
  }
  return row + "</tr>\n";
}

std::string team_anchor(const TeamData& team) { return team.observer + "-team"; }

/// Of each observer with records, on the time axis of its pairs, which are in order.
Result<std::vector<TeamData>> load_teams(const PlotOptions& options,
                                         const std::vector<PairData>& pairs) {
  std::vector<TeamData> teams;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0 && pairs[i].observer == pairs[i - 1].observer) continue;
    auto team = read_team(options.results, pairs[i].observer);
    if (!team) return tl::unexpected(team.error());
    if (team->innovations.empty() && team->calibrations.empty()) continue;
    team->seconds = pairs[i].seconds;
    team->duration_s = pairs[i].duration_s;
    teams.push_back(std::move(*team));
  }
  return teams;
}

std::string page_of(const PlotOptions& options, const std::vector<PairData>& pairs,
                    const std::vector<TeamData>& teams) {
  const std::string title = "CREPES replay " + xml_escaped(options.results.string());
  // The page loads nothing: neither style, nor script, nor picture of anybody else.
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'>"
      "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; "
      "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">"
      "<title>{0}</title>\n<style>{1}</style></head><body>\n<h1>{0}</h1>\n",
      title, kPlotStyle);
  html += options.swarm.empty() ? "<p>Without truth: uncertainties only.</p>\n"
                                : fmt::format("<p>Against the truth of {}.</p>\n",
                                              xml_escaped(options.swarm.string()));
  html +=
      "<p>B observes N. Position in B's axes, orientation as a rotation vector in N's. All rows "
      "are scored, the first seconds included.</p>\n<nav>";
  for (const PairData& pair : pairs) {
    html += fmt::format("<a href='#{}'>{} → {}</a>", xml_escaped(anchor(pair)),
                        xml_escaped(pair.observer), xml_escaped(pair.neighbor));
  }
  for (const TeamData& team : teams) {
    html += fmt::format("<a href='#{}'>the team of {}</a>", xml_escaped(team_anchor(team)),
                        xml_escaped(team.observer));
  }
  html += fmt::format("</nav>\n{}<div class='wide'><table>", kPlotReading) +
          table_row(summary_header(), "th");
  for (const PairData& pair : pairs) html += table_row(summary_row(pair), "td", anchor(pair));
  html += "</table></div>\n";
  for (const PairData& pair : pairs) {
    html += fmt::format("<h2 id='{}'>{} as seen by {}</h2>\n{}", xml_escaped(anchor(pair)),
                        xml_escaped(pair.neighbor), xml_escaped(pair.observer), pair_charts(pair));
  }
  for (const TeamData& team : teams) {
    html +=
        fmt::format("<h2 id='{}'>The team as {} estimates it</h2>\n{}",
                    xml_escaped(team_anchor(team)), xml_escaped(team.observer), team_charts(team));
  }
  return fmt::format("{}<script>{}</script></body></html>\n", html, kPlotScript);
}

}  // namespace

Result<fs::path> plot(const PlotOptions& options) {
  fs::path out = options.out.empty() ? options.results / "plot.html" : options.out;
  if (!options.force)
    if (auto free = check_replaceable(out, "<!DOCTYPE html>"); !free)
      return tl::unexpected(free.error());
  const std::vector<PairName> names = pairs_in(options.results);
  if (names.empty()) return tl::unexpected(no_pairs_in(options.results));
  std::optional<PlottedRecording> recording;
  if (!options.swarm.empty()) {
    auto loaded = load_recording(options);
    if (!loaded) return tl::unexpected(loaded.error());
    recording = std::move(*loaded);
  }
  std::vector<PairData> pairs;
  for (const PairName& name : names) {
    auto pair = load_pair(options, name);
    if (!pair) return tl::unexpected(pair.error());
    if (auto done = set_time_axis(recording, options, *pair); !done)
      return tl::unexpected(done.error());
    pairs.push_back(std::move(*pair));
  }
  const auto teams = load_teams(options, pairs);
  if (!teams) return tl::unexpected(teams.error());
  if (auto done = replace_text_file(out, page_of(options, pairs, *teams)); !done)
    return tl::unexpected(done.error());
  return out;
}

}  // namespace crepes
