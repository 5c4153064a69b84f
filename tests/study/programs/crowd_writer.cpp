/// crowd_writer: writes a simulated swarm of any size as a data set.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "tests/study/crowd.hpp"
#include "tests/study/swarm_writer.hpp"

int main(int argc, char** argv) {
  crepes::study::Crowd crowd;
  std::string dir;
  int seed = 1;
  double duration_s = 8.0;
  CLI::App app("crowd_writer: a simulated swarm of any size as a data set");
  app.add_option("DIR", dir, "the data set")->required();
  app.add_option("--robots", crowd.robots)->capture_default_str()->check(CLI::Range(2, 200));
  app.add_option("--rings", crowd.rings)->capture_default_str()->check(CLI::Range(1, 20));
  app.add_option("--radius", crowd.radius_m, "of a ring [m]")->capture_default_str();
  app.add_option("--distance", crowd.distance_m, "of rings [m]")->capture_default_str();
  app.add_option("--sight", crowd.sight_m, "of cameras and UWB modules [m]")->capture_default_str();
  app.add_option("--spread", crowd.spread_m, "of the heights [m]")->capture_default_str();
  app.add_option("--covered", crowd.dark.robot.value,
                 "a robot that nobody sees, and that sees nobody");
  app.add_option("--covered-from", crowd.dark.from_s, "[s]")->capture_default_str();
  app.add_option("--covered-to", crowd.dark.to_s, "[s]; the end, unless given");
  app.add_option("--seed", seed)->capture_default_str();
  app.add_option("--duration", duration_s, "[s]")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (crowd.dark.robot != crepes::RobotId{} && crowd.dark.to_s == 0.0) crowd.dark.to_s = duration_s;
  if (crepes::study::write_swarm(dir, crepes::study::simulate_crowd(crowd, seed, duration_s)))
    return 0;
  std::fprintf(stderr, "crowd_writer: %s: cannot be written\n", dir.c_str());
  return 1;
}
