#include "tests/study/simulated_spots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes::study {
namespace {

constexpr std::uint64_t kSpotKey = 0x73706f74U;
constexpr double kNearNoise = 0.12;      // px, one sigma an axis
constexpr double kNoiseByMeter = 0.012;  // px/m: far spots are small and dim
constexpr double kDropOut = 0.004;
constexpr double kMergeWithin = 4.0;  // px
constexpr double kGlintNoise = 0.5;   // px; what glints and shines is not a point

// A floor mirrors for some seconds, then the angle or the ground is another.
constexpr double kMirrorPeriod = 3.0;  // s
constexpr double kMirrorShare = 0.4;

const std::array<Eigen::Vector3d, 2> kGlints{{{6.0, 2.5, 0.4}, {-5.0, -3.5, 0.8}}};
const std::array<Eigen::Vector3d, 3> kLamps{{{2.0, 4.5, 3.0}, {-4.0, 1.5, 3.2}, {1.5, -5.0, 2.8}}};
constexpr double kMains = 50.0;  // Hz; a lamp shines twice a period
constexpr double kGlintShare = 0.6;

}  // namespace

SimulatedSpots::SimulatedSpots(const SimWorld& world, const Config& config, Disturbance disturbance)
    : world_(world),
      self_(config.robot.id),
      members_(config.swarm.members),
      renderer_(
          RingRenderer::make(world, self_, config.swarm, config.cameras.front().calibration, 0)
              .value()),
      p_B_C_(config.cameras.front().calibration.T_cam_imu.inverse().p),
      disturbance_(std::move(disturbance)),
      noise_{kSpotKey, static_cast<std::uint64_t>(world.seed()), self_.value} {}

std::vector<Spot> SimulatedSpots::at(double t_s) {
  std::vector<Spot> spots;
  if (disturbance_.dark.covers(self_, t_s)) return spots;
  const auto views = renderer_.views(t_s);
  for (const RingRenderer::View& view : views) {
    if (is_hidden(view.robot, t_s)) continue;
    const double distance = world_.T_B_N(self_, view.robot, t_s).p.norm();
    if (distance > disturbance_.sight_m) continue;
    if (noise_.uniform(drawn_++) < kDropOut) continue;
    add(view.spot, std::hypot(kNearNoise, kNoiseByMeter * distance), spots);
  }
  if (disturbance_.interference) {
    add_mirror_images(views, t_s, spots);
    add_lights(t_s, spots);
  }
  return spots;
}

bool SimulatedSpots::is_hidden(RobotId neighbor, double t_s) const {
  if (disturbance_.dark.covers(neighbor, t_s)) return true;
  const auto member = std::find_if(members_.begin(), members_.end(),
                                   [&](const MemberConfig& m) { return m.id == neighbor; });
  CREPES_EXPECT(member != members_.end(), "views are of members");
  return disturbance_.obstacles.blocks_light(world_.T_W_B(self_, t_s) * p_B_C_,
                                             world_.T_W_B(neighbor, t_s) * member->p_body_led);
}

void SimulatedSpots::add(Spot spot, double sigma_px, std::vector<Spot>& spots) {
  spot.u_px += sigma_px * noise_.gaussian(drawn_++);
  spot.v_px += sigma_px * noise_.gaussian(drawn_++);
  const auto touched = std::find_if(spots.begin(), spots.end(), [&](const Spot& other) {
    return std::hypot(spot.u_px - other.u_px, spot.v_px - other.v_px) < kMergeWithin;
  });
  if (touched == spots.end()) {
    spots.push_back(spot);
    return;
  }
  const double area = touched->area_px2 + spot.area_px2;
  const double share = spot.area_px2 / area;
  touched->u_px += share * (spot.u_px - touched->u_px);
  touched->v_px += share * (spot.v_px - touched->v_px);
  touched->area_px2 = area;
  touched->peak = std::max(touched->peak, spot.peak);
}

void SimulatedSpots::add_mirror_images(const std::vector<RingRenderer::View>& views, double t_s,
                                       std::vector<Spot>& spots) {
  const auto spell = static_cast<std::uint64_t>(t_s / kMirrorPeriod);
  for (const RingRenderer::View& view : views) {
    const SeededNoise luck{kSpotKey, static_cast<std::uint64_t>(world_.seed()), self_.value,
                           view.robot.value};
    if (luck.uniform(spell) > kMirrorShare) continue;
    // A pillar stands on the way by the floor, too.
    if (disturbance_.hides_images && is_hidden(view.robot, t_s)) continue;
    const auto member = std::find_if(members_.begin(), members_.end(),
                                     [&](const MemberConfig& m) { return m.id == view.robot; });
    CREPES_EXPECT(member != members_.end(), "views are of members");
    Eigen::Vector3d image = world_.T_W_B(view.robot, t_s) * member->p_body_led;
    image.z() = -image.z();
    const auto uv = renderer_.project(image, t_s);
    if (!uv) continue;
    Spot spot = view.spot;
    spot.u_px = uv->x();
    spot.v_px = uv->y();
    spot.area_px2 *= 0.7;
    add(spot, kGlintNoise, spots);
  }
}

void SimulatedSpots::add_lights(double t_s, std::vector<Spot>& spots) {
  const auto shine = [&](const Eigen::Vector3d& p_W, double area) {
    if (const auto uv = renderer_.project(p_W, t_s))
      add({.u_px = uv->x(), .v_px = uv->y(), .area_px2 = area, .peak = 200.0}, kGlintNoise, spots);
  };
  for (const Eigen::Vector3d& glint : kGlints)
    if (noise_.uniform(drawn_++) < kGlintShare) shine(glint, 12.0);
  for (std::size_t i = 0; i < kLamps.size(); ++i) {
    const double phase = static_cast<double>(i) * 2.0 / 3.0 * std::numbers::pi;  // three-phase
    const double light = std::sin(2.0 * std::numbers::pi * kMains * t_s + phase);
    if (light * light > 0.3) shine(kLamps[i], 30.0);
  }
}

}  // namespace crepes::study
