#include "tests/faults/robot_faults.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes::faults {
namespace {

using Change = std::function<void(Config&)>;

/// Configurations before all faults.
class Originals {
 public:
  const Config& of(VirtualSwarm& swarm, RobotId robot) {
    if (configs_.empty())
      for (const VirtualRobot& one : swarm.robots()) configs_[one.id()] = one.recording.config;
    return configs_.at(robot);
  }

 private:
  std::map<RobotId, Config> configs_;
};

class Schedule {
 public:
  void add(const Fault& fault);
  [[nodiscard]] std::vector<Action> take() {
    std::ranges::stable_sort(actions_, {}, &Action::at_s);
    return std::move(actions_);
  }

 private:
  void at(double at_s, std::function<void(VirtualSwarm&)> apply) {
    actions_.push_back({at_s, std::move(apply)});
  }
  void reload(const Fault& fault, bool others, const Change& change);
  void reload_for(const Fault& fault);
  void change_keys(const Fault& fault);
  void change_clock(const Fault& fault);
  void change_power(const Fault& fault);

  std::vector<Action> actions_;
  std::shared_ptr<Originals> originals_ = std::make_shared<Originals>();
  std::shared_ptr<std::set<RobotId>> killed_ = std::make_shared<std::set<RobotId>>();
  std::shared_ptr<MeshKey> swarm_key_ = std::make_shared<MeshKey>(replay_swarm_key());
};

void Schedule::add(const Fault& fault) {
  change_power(fault);
  change_clock(fault);
  change_keys(fault);
  reload_for(fault);
}

void Schedule::change_power(const Fault& fault) {
  const RobotId robot = fault.robot;
  const auto off = [robot](VirtualSwarm& swarm) { swarm.switch_off(robot); };
  const auto on = [robot, killed = killed_](VirtualSwarm& swarm) {
    if (!killed->contains(robot)) swarm.switch_on(robot);
  };
  if (fault.kind == Kind::kReboot) {
    at(fault.from_s, off);
    at(fault.to_s, on);
  } else if (fault.kind == Kind::kReplayedSession) {
    constexpr double kBoot_s = 0.3;
    at(fault.from_s, off);
    at(std::min(fault.from_s + kBoot_s, fault.to_s), on);
  } else if (fault.kind == Kind::kKilled) {
    at(fault.from_s, [robot, killed = killed_](VirtualSwarm& swarm) {
      killed->insert(robot);
      swarm.switch_off(robot);
    });
  } else if (fault.kind == Kind::kRebootLoop) {
    const double half_s = 0.5 * fault.rate;
    for (double t = fault.from_s; t < fault.to_s; t += 2 * half_s) {
      at(t, off);
      at(std::min(t + half_s, fault.to_s), on);
    }
  } else if (fault.kind == Kind::kFreeze) {
    at(fault.from_s, [robot, killed = killed_](VirtualSwarm& swarm) {
      if (!killed->contains(robot)) swarm.freeze(robot);
    });
    at(fault.to_s, [robot, end_s = fault.to_s, killed = killed_](VirtualSwarm& swarm) {
      if (killed->contains(robot)) return;
      CREPES_EXPECT(swarm.thaw(robot, end_s).has_value(), "there are no pictures");
    });
  }
}

void Schedule::change_clock(const Fault& fault) {
  const auto shift = [&](double at_s, double by_s) {
    at(at_s, [robot = fault.robot, by_s](VirtualSwarm& swarm) {
      swarm.robot(robot).clock_shift += from_seconds(by_s);
    });
  };
  if (fault.kind == Kind::kClockStep) shift(fault.from_s, 2.0 * fault.rate);
  if (fault.kind != Kind::kClockSkew) return;
  constexpr double kStep_s = 0.01;
  const double skew = (fault.seed % 2 == 0 ? 200e-6 : -200e-6) * fault.rate;
  for (double t = fault.from_s; t < fault.to_s; t += kStep_s) shift(t, skew * kStep_s);
}

void Schedule::change_keys(const Fault& fault) {
  const auto change = [&](double at_s, std::function<void(VirtualRobot&)> keys) {
    at(at_s, [robot = fault.robot, keys = std::move(keys)](VirtualSwarm& swarm) {
      keys(swarm.robot(robot));
    });
  };
  if (fault.kind == Kind::kWrongKey) {
    change(fault.from_s, [](VirtualRobot& r) { r.seal.emplace(MeshKey{{99}}); });
  } else if (fault.kind == Kind::kNoKey) {
    change(fault.from_s, [](VirtualRobot& r) { r.seal.reset(); });
  } else if (fault.kind == Kind::kWrongSignature) {
    change(fault.from_s, [](VirtualRobot& r) { r.signer.emplace(replay_robot_key(RobotId{77})); });
  } else if (fault.kind == Kind::kOldKey) {
    at(fault.from_s, [robot = fault.robot, key = swarm_key_](VirtualSwarm& swarm) {
      ++key->bytes.front();  // a new key
      for (VirtualRobot& one : swarm.robots())
        if (one.id() != robot) one.seal.emplace(*key);
    });
  } else {
    return;
  }
  change(fault.to_s, [key = swarm_key_](VirtualRobot& r) {
    const bool is_sealed = !r.trust.keys.empty();
    r.seal.reset();
    r.signer.reset();
    if (is_sealed || *key != replay_swarm_key()) r.seal.emplace(*key);
    if (is_sealed) r.signer.emplace(replay_robot_key(r.id()));
  });
}

/// All that other reloads have changed is taken back with this one.
void Schedule::reload(const Fault& fault, bool others, const Change& change) {
  const auto each = [robot = fault.robot, others, originals = originals_](VirtualSwarm& swarm,
                                                                          const Change& to) {
    for (VirtualRobot& one : swarm.robots()) {
      if ((one.id() == robot) == others) continue;
      Config wanted = originals->of(swarm, one.id());
      to(wanted);
      const auto changed = one.reload(wanted);
      if (!changed) fmt::print(stderr, "{}\n", changed.error().message);
      CREPES_EXPECT(changed.has_value(), "configurations of the trial are valid");
    }
  };
  at(fault.from_s, [each, change](VirtualSwarm& swarm) { each(swarm, change); });
  at(fault.to_s, [each](VirtualSwarm& swarm) { each(swarm, [](Config&) {}); });
}

void Schedule::reload_for(const Fault& fault) {
  switch (fault.kind) {
    case Kind::kReload:
      return reload(fault, false, [](Config& config) {
        config.estimator.gate_probability = 0.99;
        config.estimator.lag_ms = 150.0;
        config.net.report_rate_hz = 20.0;
        config.subscription.lease_s = 5.0;
      });
    case Kind::kReloadVision:
      return reload(fault, false, [](Config& config) { config.vision.max_spots = 50; });
    case Kind::kMemberRemoved:
      return reload(fault, true, [gone = fault.robot](Config& config) {
        std::erase_if(config.swarm.members, [gone](const auto& m) { return m.id == gone; });
      });
    case Kind::kMemberExcluded:
      return reload(fault, true, [gone = fault.robot](Config& config) {
        for (MemberConfig& member : config.swarm.members) member.excluded |= member.id == gone;
      });
    default:
      return;
  }
}

}  // namespace

std::vector<Action> actions_of(const std::vector<Fault>& faults) {
  Schedule schedule;
  for (const Fault& fault : faults) schedule.add(fault);
  return schedule.take();
}

}  // namespace crepes::faults
