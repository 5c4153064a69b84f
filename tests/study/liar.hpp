/// Faulty members: one robot that reports false measurements.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

#include "tests/study/pair_sightings.hpp"

namespace crepes::study {

enum class Lie : std::uint8_t {
  kEstimates,     ///< it broadcasts poses of the others that are 2 m wrong, with a sigma of 1 mm
  kCamera5,       ///< its camera points 5 deg away from its calibration, about z
  kCamera20,      ///< 20 deg
  kClock,         ///< its sensors are stamped 20 ms late
  kRanges,        ///< its module's readings are 1 m too long
  kAntennaDelay,  ///< all readings to and from its module are 1 m too long
  kModules,       ///< it carries another robot's module, and that robot its own
  kUpsideDown,    ///< its IMU is turned by 180 deg about x
  kOnItsSide,     ///< by 90 deg about x
};

struct Liar {
  std::string_view name;
  Lie lie;
};
inline constexpr std::array kLiars{
    Liar{"estimates", Lie::kEstimates},  Liar{"camera-5", Lie::kCamera5},
    Liar{"camera-20", Lie::kCamera20},   Liar{"clock", Lie::kClock},
    Liar{"ranges", Lie::kRanges},        Liar{"antenna-delay", Lie::kAntennaDelay},
    Liar{"modules", Lie::kModules},      Liar{"upside-down", Lie::kUpsideDown},
    Liar{"on-its-side", Lie::kOnItsSide}};

/// Makes `robot` a liar: what it records, and what it believes of its sensors.
void corrupt(Lie lie, RobotId robot, SwarmDataset& dataset);

/// What it changes in the reports that it sends; empty if nothing.
[[nodiscard]] std::function<void(Report&)> corrupted_reports(Lie lie, RobotId robot);

}  // namespace crepes::study
