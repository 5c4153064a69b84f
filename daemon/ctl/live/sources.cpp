#include "daemon/ctl/live/sources.hpp"

#include <fmt/core.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/live/full_status.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUnknownAge = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view kUsed = name_of(Verdict::kFused);

std::uint64_t sum_of(const client::Status::Totals& totals) {
  std::uint64_t sum = 0;
  for (const auto& [name, total] : totals) sum += total;
  return sum;
}

template <class Value>
Value value_or(const std::map<std::string, Value>& map, const std::string& key, Value otherwise) {
  const auto found = map.find(key);
  return found == map.end() ? otherwise : found->second;
}

double rate_of(std::uint64_t before, std::uint64_t after, double elapsed_s) {
  return after > before ? static_cast<double>(after - before) / elapsed_s : 0.0;
}

Source measured(const client::Status::Neighbor& before, const client::Status::Neighbor& after,
                const std::string& kind, double elapsed_s) {
  const client::Status::Totals none;
  client::Status::Totals totals = value_or(after.measurements, kind, none);
  Source source{.neighbor = RobotId{after.peer},
                .name = after.name,
                .kind = kind,
                .rate_hz = rate_of(sum_of(value_or(before.measurements, kind, none)),
                                   sum_of(totals), elapsed_s),
                .age_s = value_or(after.ages_s, kind, kUnknownAge),
                .used = value_or(totals, std::string(kUsed), std::uint64_t{0}),
                .refused = {}};
  totals.erase(std::string(kUsed));
  source.refused = std::move(totals);
  return source;
}

Source reported(const client::Status::Neighbor& before, const client::Status::Neighbor& after,
                double elapsed_s) {
  const client::Status::Reports old = before.reports.value_or(client::Status::Reports());
  const client::Status::Reports now = after.reports.value_or(
      client::Status::Reports{.received = 0, .lost = 0, .restarts = 0, .age_s = kUnknownAge});
  Source source{.neighbor = RobotId{after.peer},
                .name = after.name,
                .kind = "reports",
                .rate_hz = rate_of(old.received, now.received, elapsed_s),
                .age_s = now.age_s,
                .used = now.received,
                .refused = {}};
  if (now.lost > 0) source.refused["lost"] = now.lost;
  if (now.restarts > 0) source.refused["restarts"] = now.restarts;
  return source;
}

std::string table_of(const std::vector<Source>& sources) {
  std::vector<std::vector<std::string>> rows{
      {"neighbor", "source", "rate Hz", "age ms", "used", "refused"}};
  RobotId last{};
  for (const Source& source : sources) {
    std::string refused;
    for (const auto& [reason, total] : source.refused)
      refused += fmt::format("{}{} {}", refused.empty() ? "" : ", ", reason, total);
    const std::string name =
        source.name.empty() ? std::to_string(source.neighbor.value) : source.name;
    const bool counts = source.kind != "imu";
    rows.push_back({source.neighbor == last ? "" : name, source.kind,
                    counts ? fixed(source.rate_hz, 1) : "", fixed(1e3 * source.age_s, 0),
                    counts ? std::to_string(source.used) : "", refused});
    last = source.neighbor;
  }
  return text_table(rows);
}

std::string json_of(const std::vector<Source>& sources, double elapsed_s) {
  Json list = Json::array();
  for (const Source& source : sources) {
    Json json{{"peer", source.neighbor.value}, {"name", source.name}, {"source", source.kind}};
    json["rate_hz"] = source.rate_hz;
    put_finite(json, "age_s", source.age_s);
    json["used"] = source.used;
    json["refused"] = source.refused;
    list.push_back(std::move(json));
  }
  return json_line({{"over_s", elapsed_s}, {"sources", std::move(list)}});
}

}  // namespace

std::vector<Source> sources_of(const client::Status& before, const client::Status& after,
                               double elapsed_s) {
  std::vector<Source> sources;
  for (const client::Status::Neighbor& neighbor : after.neighbors) {
    const auto found =
        std::ranges::find(before.neighbors, neighbor.peer, &client::Status::Neighbor::peer);
    const client::Status::Neighbor old =
        found == before.neighbors.end() ? client::Status::Neighbor{} : *found;
    for (std::size_t kind = 0; kind < kMeasurementKindCount; ++kind) {
      sources.push_back(measured(
          old, neighbor, std::string(name_of(static_cast<MeasurementKind>(kind))), elapsed_s));
    }
    sources.push_back(reported(old, neighbor, elapsed_s));
    sources.push_back({.neighbor = RobotId{neighbor.peer},
                       .name = neighbor.name,
                       .kind = "imu",
                       .rate_hz = 0.0,
                       .age_s = value_or(neighbor.ages_s, "imu", kUnknownAge),
                       .used = 0,
                       .refused = {}});
  }
  return sources;
}

Result<std::string> sources(const SourcesOptions& options) {
  const Result<FullStatus> before = request_full_status(options.daemon);
  if (!before) return tl::unexpected(before.error());
  ::poll(nullptr, 0, static_cast<int>(1e3 * options.over_s));
  const Result<FullStatus> after = request_full_status(options.daemon);
  if (!after) return tl::unexpected(after.error());
  const double elapsed_s = after->message.uptime_s - before->message.uptime_s;
  if (!(elapsed_s > 0.0)) return fail(ErrorCode::kIo, "the daemon was restarted meanwhile");
  const auto found = sources_of(before->message, after->message, elapsed_s);
  return options.json ? json_of(found, elapsed_s) : table_of(found);
}

}  // namespace crepes
