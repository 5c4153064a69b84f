#include "daemon/ctl/live/check/mesh_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/ctl/live/pose_advice.hpp"
#include "daemon/ctl/text_table.hpp"
#include "net/mesh/mesh_counters.hpp"

namespace crepes {
namespace {

void check_keys(const client::Status::Mesh& mesh, CheckSection& section) {
  const std::string keys = "crepesctl keygen makes keys: see MESH.md";
  if (!mesh.sealed) {
    section.doubt("not sealed: whoever is on the mesh can read and forge", keys);
  } else if (!mesh.warning.empty()) {
    section.doubt(mesh.warning, keys);
  } else {
    section.good(mesh.signs ? "sealed and signed" : "sealed");
  }
}

void check_air(const client::Status::Mesh& mesh, CheckSection& section) {
  constexpr double kBusy = 0.5;
  constexpr double kFull = 0.9;
  const std::string text =
      fmt::format("{} % of the air by all that are heard", fixed(100.0 * mesh.airtime_of_all, 1));
  const std::string advice =
      "raise the Wi-Fi's basic rate and net.broadcast_mbps, or lower net.airtime_of_all";
  if (mesh.airtime_of_all > kFull) return section.fault(text, advice);
  if (mesh.airtime_of_all > kBusy) return section.doubt(text, advice);
  section.good(text);
}

void check_link(const client::Status::Neighbor& neighbor, CheckSection& section) {
  constexpr double kLossy = 0.2;
  constexpr double kLost = 0.6;
  const std::string name = name_of_neighbor(neighbor);
  if (!neighbor.reports || neighbor.reports->received == 0) {
    return section.fault(name + ": never heard",
                         std::string(advice_for(NoPoseReason::kNeverHeard)));
  }
  if (is_silent(neighbor)) {
    return section.fault(
        fmt::format("{}: silent for {} s", name, fixed(neighbor.reports->age_s, 0)),
        std::string(advice_for(NoPoseReason::kSilent)));
  }
  const std::string text =
      fmt::format("{}: {} % lost", name, fixed(100.0 * neighbor.reports->loss, 0));
  const std::string advice = "come nearer, or use another channel";
  if (neighbor.reports->loss > kLost) return section.fault(text, advice);
  if (neighbor.reports->loss > kLossy) return section.doubt(text, advice);
  section.good(text);
}

}  // namespace

void check_clocks(const RobotObservation& seen, CheckSection section) {
  constexpr double kCoarse = 1e-3;  // s
  constexpr double kBadSkew = 100.0;
  for (const auto& neighbor : seen.after.neighbors) {
    const std::string name = name_of_neighbor(neighbor);
    if (!neighbor.reports || neighbor.reports->received == 0) continue;  // see mesh
    const auto clock =
        std::ranges::find(seen.after.clocks, neighbor.peer, &client::Status::Clock::peer);
    if (clock == seen.after.clocks.end()) {
      section.fault(name + ": clock offset unknown",
                    std::string(advice_for(NoPoseReason::kNoClockOffset)));
      continue;
    }
    if (!clock->sigma_s || !clock->skew_ppm) {
      section.doubt(name + ": known, but not how well",
                    "the daemon had no room to say it: ask again");
      continue;
    }
    const std::string text =
        fmt::format("{}: known to {} ms, {} ppm", name, fixed(1e3 * *clock->sigma_s, 3),
                    fixed(*clock->skew_ppm, 1));
    if (*clock->sigma_s > kCoarse) {
      section.doubt(text, "many packets are late or lost: see mesh, below");
    } else if (std::abs(*clock->skew_ppm) > kBadSkew) {
      section.doubt(text, "one of the two computers has a bad clock, or steps it: see chrony");
    } else {
      section.good(text);
    }
  }
}

void check_mesh(const RobotObservation& seen, CheckSection section) {
  if (seen.after.mesh) {
    check_keys(*seen.after.mesh, section);
    check_air(*seen.after.mesh, section);
  }
  if (seen.after.neighbors.empty())
    section.doubt("no other robot is a member of the swarm", "add it to swarm.members");
  for (const auto& neighbor : seen.after.neighbors) check_link(neighbor, section);
  std::string refused;
  for (std::size_t i = 0; i < kMeshCounterCount; ++i) {
    const auto counter = static_cast<MeshCounter>(i);
    const std::string name(name_of(counter));
    const std::uint64_t more = growth(seen.before.network, seen.after.network, name);
    if (more > 0 && is_refusal(counter))
      refused += fmt::format("{}{} {}", refused.empty() ? "" : ", ", name, more);
  }
  if (!refused.empty()) {
    section.doubt(fmt::format("in {} s, {}", fixed(seen.duration_s, 0), refused),
                  "another key, or another version, is on the mesh: see troubleshooting.md");
  }
}

}  // namespace crepes
