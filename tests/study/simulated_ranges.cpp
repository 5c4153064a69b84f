#include "tests/study/simulated_ranges.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/sim/seeded_noise.hpp"
#include "drivers/sim/sim_uwb.hpp"
#include "drivers/uwb/nlink.hpp"

namespace crepes::study {
namespace {

constexpr double kRangingPeriod = 0.02;  // s, of a module of up to five
constexpr std::size_t kModulesAtOnce = 5;
constexpr std::uint64_t kLateKey = 0x6c617465U;
constexpr double kThroughBias = 0.3;    // m; through a pillar, as in the simulated world
constexpr double kThroughSpread = 0.4;  // m
constexpr double kThroughLoss = 12.0;   // dB

constexpr std::uint64_t kPairKey = 0x6c696e6bU;
constexpr double kLongestShort = -0.19;  // m
constexpr double kLongestLong = 0.18;    // m
constexpr double kScatter = 0.086;       // m
constexpr double kSpell = 3.0;           // s
constexpr double kSpellShare = 0.255;
constexpr double kSpellMean = 0.212;  // m
constexpr int kThinning = 200;        // readings of a module and neighbor: one in 4 s

/// Antenna to antenna.
class Line {
 public:
  Line(const SimWorld& world, const SwarmConfig& swarm, RobotId from, RobotId to, double t_s)
      : from_(world.T_W_B(from, t_s) * antenna(swarm, from)),
        to_(world.T_W_B(to, t_s) * antenna(swarm, to)) {}

  [[nodiscard]] double length() const { return (to_ - from_).norm(); }
  [[nodiscard]] bool is_blocked(const ObstacleField& field) const {
    return field.blocks_radio(from_, to_);
  }

 private:
  static Eigen::Vector3d antenna(const SwarmConfig& swarm, RobotId robot) {
    return std::find_if(swarm.members.begin(), swarm.members.end(),
                        [&](const MemberConfig& m) { return m.id == robot; })
        ->p_body_uwb;
  }

  Eigen::Vector3d from_;
  Eigen::Vector3d to_;
};

/// Both modules of a pair take turns, so the pair has twice the rate of each.
bool is_measured_by_a_thin_module(int reading, RobotId self, RobotId neighbor) {
  const int turn = self < neighbor ? 0 : kThinning / 2;
  const int pair = 7 * (self.value + neighbor.value);
  return (reading + turn + pair) % kThinning == 0;
}

}  // namespace

double link_track_error_m(int seed, RobotId a, RobotId b, double t_s) {
  const auto [low, high] = std::minmax(a, b);
  const SeededNoise pair{kPairKey, static_cast<std::uint64_t>(seed), low.value, high.value};
  const SeededNoise single{kPairKey, static_cast<std::uint64_t>(seed), a.value, b.value, 1};
  const auto spell = 2 * static_cast<std::uint64_t>(t_s / kSpell) + 1;
  double error = kLongestShort + (kLongestLong - kLongestShort) * pair.uniform(0);
  if (pair.uniform(spell) < kSpellShare) error -= kSpellMean * std::log(pair.uniform(spell + 1));
  return error + kScatter * single.gaussian(static_cast<std::uint64_t>(std::llround(t_s * 1000.0)));
}

std::vector<UwbRange> simulated_ranges(const SimWorld& world, const Config& config,
                                       const RobotClock& clock, RangeModel model,
                                       const ObstacleField& obstacles, double duration_s) {
  const RobotId self = config.robot.id;
  const SimUwb module = SimUwb::make(world, self, config.swarm, config.uwb.noise).value();
  NlinkParser parser(uwb_modules_of(config.swarm), config.uwb.noise.max_range_m);
  std::vector<UwbRange> ranges;
  // Modules take turns.
  const double phase_s = 0.004 * self.value;
  const auto rounds = std::max<std::size_t>(config.swarm.members.size() / kModulesAtOnce, 1);
  const double period_s = kRangingPeriod * static_cast<double>(rounds);
  for (int i = 0; i * period_s + phase_s <= duration_s; ++i) {
    const double t = i * period_s + phase_s;
    const auto bytes = module.sample(t);
    parser.parse(Bytes(bytes), clock.local(t), [&](UwbRange range) {
      const Line line(world, config.swarm, self, range.neighbor, t);
      if (model == RangeModel::kLinkTrack) {
        if (!is_measured_by_a_thin_module(i, self, range.neighbor)) return;
        range.range_m = std::max(
            0.001, line.length() + link_track_error_m(world.seed(), self, range.neighbor, t));
      }
      if (line.is_blocked(obstacles)) {
        const SeededNoise noise{kLateKey, static_cast<std::uint64_t>(world.seed()), self.value,
                                range.neighbor.value};
        range.range_m +=
            kThroughBias - kThroughSpread * std::log(noise.uniform(static_cast<std::uint64_t>(i)));
        range.first_path_dbm -= kThroughLoss;
      }
      ranges.push_back(range);
    });
  }
  return ranges;
}

}  // namespace crepes::study
