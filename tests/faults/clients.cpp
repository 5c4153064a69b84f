#include "tests/faults/clients.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

namespace crepes::faults {
namespace {

constexpr double kRenewal_s = 1.0;
constexpr std::size_t kMostClientComplaints = 4;
const Endpoint kHonest = Endpoint::ipv4({127, 0, 0, 1}, 5000);
constexpr std::string_view kWatch = R"({"class":"WATCH","rate_hz":10})";

std::uint64_t total(const SubscriptionService& service, std::string_view name) {
  for (const auto& [counter, count] : service.counters())
    if (counter == name) return count;
  return 0;
}

}  // namespace

Clients::Clients(VirtualSwarm& swarm) : swarm_(swarm) {
  for (const VirtualRobot& robot : swarm.robots()) begin(robot.id());
}

void Clients::begin(RobotId robot) {
  Served& at = robots_[robot];
  at = {};
  const auto status = [this, robot] {
    SystemStatus all;
    all.self = robot;
    all.estimator = swarm_.robot(robot).estimator.status();
    all.network = swarm_.robot(robot).link.counters().totals();
    return all;
  };
  at.service.emplace(swarm_.robot(robot).recording.config.subscription, "0", status, HashKey{});
}

void Clients::strike(const std::vector<Fault>& faults) {
  faults_ = faults;
  if (!faults.empty()) dice_ = Dice(faults.front().seed);
}

void Clients::add(RobotId robot, const NeighborPose& pose, double true_s) {
  constexpr std::uint64_t kMostUnsent = 15;  // of 50 Hz, for a client of 10 Hz
  Served& at = robots_.at(robot);
  std::uint64_t& unsent = at.unsent[pose.neighbor];
  unsent = at.is_subscribed ? unsent + 1 : 0;
  for (const PoseDelivery& delivery :
       at.service->deliveries(pose.neighbor, pose.stamp, swarm_.robot(robot).local(true_s))) {
    if (delivery.client != kHonest) continue;
    unsent = 0;
    const std::string json = pose_json(delivery.sequence, robot, "r", pose);
    if (json.find("null") != std::string::npos)
      complain(fmt::format("r{}: a pose without numbers: {}", robot.value, json));
  }
  if (unsent == kMostUnsent + 1)
    complain(fmt::format("r{}: an honest client gets no poses at {:.1f} s", robot.value, true_s));
}

void Clients::step(double true_s) {
  for (auto& [robot, at] : robots_) {
    const VirtualRobot& virtual_robot = swarm_.robot(robot);
    if (virtual_robot.state == VirtualRobot::State::kOff) {
      begin(robot);
    } else if (virtual_robot.state == VirtualRobot::State::kOn) {
      serve_honest(robot, at, true_s);
      for (const Fault& fault : faults_)
        if (fault.robot == robot && fault.lasts_at(true_s))
          misbehave(fault, at, virtual_robot.local(true_s));
    }
  }
}

void Clients::serve_honest(RobotId robot, Served& at, double true_s) {
  if (true_s < at.renewal_s) return;
  at.renewal_s = true_s + kRenewal_s;
  const auto answer = at.service->answer(kHonest, kWatch, swarm_.robot(robot).local(true_s));
  at.is_subscribed = answer && answer->find("\"VERSION\"") != std::string::npos;
  if (!at.is_subscribed)
    complain(fmt::format("r{}: an honest client is refused at {:.1f} s: {}", robot.value, true_s,
                         answer.value_or("no answer")));
}

void Clients::misbehave(const Fault& fault, Served& at, Timestamp now) {
  static const std::array<std::string, 6> kRequests{R"({"class":"POLL"})",
                                                    std::string(1200, '['),
                                                    "\xff\xfe garbage",
                                                    R"({"class":"WATCH","rate_hz":1000})",
                                                    R"({"class":"WATCH","enable":false})",
                                                    R"({"class":"POLL","peer":-1})"};
  const bool floods = fault.kind == Kind::kClientsFlood;
  if (!floods && fault.kind != Kind::kClientsComeAndGo) return;
  const int requests = static_cast<int>((floods ? 400 : 10) * fault.rate);
  for (int i = 0; i < requests; ++i) {
    const auto address = static_cast<std::uint8_t>(1 + dice_.below(200));
    const bool is_local = dice_.happens(0.5);
    const auto port = static_cast<std::uint16_t>(6000 + dice_.below(1000));
    const Endpoint client = is_local ? Endpoint::ipv4({127, 0, 0, address}, port)
                                     : Endpoint::ipv4({10, 0, 1, address}, port);
    const std::string& request = kRequests.at(dice_.below(kRequests.size()));
    const auto answer = at.service->answer(client, request, now);
    if (answer && !is_local && answer->size() > request.size())
      complain("an answer is longer than the request of a stranger");
  }
  const auto& limits = swarm_.robot(fault.robot).recording.config.subscription;
  if (total(*at.service, "subscribers") > static_cast<std::uint64_t>(limits.max_subscribers))
    complain("more subscribers than are allowed");
}

void Clients::complain(std::string what) {
  if (complaints_.size() < kMostClientComplaints) complaints_.push_back(std::move(what));
}

}  // namespace crepes::faults
