#include "daemon/ctl/live/check/findings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace crepes {

std::string_view name_of(CheckVerdict verdict) {
  constexpr std::array<std::string_view, 3> kNames{"good", "doubt", "fault"};
  return kNames.at(static_cast<std::size_t>(verdict));
}

CheckSection::CheckSection(std::string about, std::vector<CheckFinding>& findings)
    : about_(std::move(about)), findings_(findings) {}

void CheckSection::good(std::string text) { add(CheckVerdict::kGood, std::move(text), ""); }

void CheckSection::doubt(std::string text, std::string advice) {
  add(CheckVerdict::kDoubt, std::move(text), std::move(advice));
}

void CheckSection::fault(std::string text, std::string advice) {
  add(CheckVerdict::kFault, std::move(text), std::move(advice));
}

void CheckSection::add(CheckVerdict verdict, std::string text, std::string advice) {
  findings_.push_back({about_, verdict, std::move(text), std::move(advice)});
}

std::uint64_t total(const StatusTotals& totals, const std::string& name) {
  const auto found = totals.find(name);
  return found == totals.end() ? 0 : found->second;
}

std::uint64_t growth(const StatusTotals& before, const StatusTotals& after,
                     const std::string& name) {
  const std::uint64_t first = total(before, name);
  const std::uint64_t last = total(after, name);
  return last > first ? last - first : 0;
}

std::string growth_text(const StatusTotals& before, const StatusTotals& after) {
  std::string text;
  for (const auto& [name, value] : after) {
    const std::uint64_t more = growth(before, after, name);
    if (more > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, more);
  }
  return text;
}

const client::Status::Sensor* sensor_of(const client::Status& status, const std::string& name) {
  const auto found = std::ranges::find(status.sensors, name, &client::Status::Sensor::name);
  return found == status.sensors.end() ? nullptr : &*found;
}

std::string name_of_neighbor(const client::Status::Neighbor& neighbor) {
  return neighbor.name.empty() ? fmt::format("robot {}", neighbor.peer) : neighbor.name;
}

bool is_silent(const client::Status::Neighbor& neighbor) {
  constexpr double kLongest_s = 2.0;
  return !neighbor.reports || neighbor.reports->received == 0 ||
         neighbor.reports->age_s > kLongest_s;
}

MeasurementFlow flow_of(const RobotObservation& seen, const client::Status::Neighbor& now,
                        const std::string& kind) {
  const auto then =
      std::ranges::find(seen.before.neighbors, now.peer, &client::Status::Neighbor::peer);
  const bool was_there = then != seen.before.neighbors.end();
  const auto after = now.measurements.find(kind);
  if (after == now.measurements.end()) return {};
  const auto before = was_there ? then->measurements.find(kind) : after;
  const bool is_new = !was_there || before == then->measurements.end();
  const StatusTotals none;
  MeasurementFlow flow;
  for (const auto& [verdict, value] : after->second) {
    const std::uint64_t more = growth(is_new ? none : before->second, after->second, verdict);
    flow.all += more;
    if (verdict == "fused") flow.fused += more;
    if (verdict == "gated") flow.gated += more;
  }
  return flow;
}

}  // namespace crepes
