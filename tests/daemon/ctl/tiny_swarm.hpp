/// A data set of two robots and a fifth of a second, written to disk to be spoilt.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/base/scratch_directory.hpp"

namespace crepes {

/// Robot clocks: r1 10 s ahead of true time, r2 20 s ahead. Twenty IMU samples, ten ranges and ten
/// frames of two spots each.
class TinySwarm {
 public:
  TinySwarm() : scratch_(ScratchDirectory::create({}).value()) {
    write("swarm.yaml",
          "scenario: tiny\nseed: 1\nduration_s: 0.2\n"
          "network: {latency_ms: 3.0, jitter_ms: 2.0, loss: 0.1, seed: 7}\n"
          "robots:\n"
          "- {id: 1, name: r1, dir: r1, clock: {offset_s: 10.0, skew_ppm: 0.0}}\n"
          "- {id: 2, name: r2, dir: r2, clock: {offset_s: 20.0, skew_ppm: 0.0}}\n");
    write_robot("r1", 1, 2, 10);
    write_robot("r2", 2, 1, 20);
  }

  [[nodiscard]] const std::filesystem::path& dir() const { return scratch_.path(); }

  void write(const std::filesystem::path& file, const std::string& text) const {
    std::filesystem::create_directories((dir() / file).parent_path());
    std::ofstream(dir() / file, std::ios::binary) << text;
  }

  [[nodiscard]] std::string read(const std::filesystem::path& file) const {
    std::ostringstream text;
    text << std::ifstream(dir() / file, std::ios::binary).rdbuf();
    return text.str();
  }

  /// Line `number`, counted from 1, becomes `text`.
  void replace_line(const std::filesystem::path& file, int number, const std::string& text) const {
    std::istringstream in(read(file));
    std::string out;
    std::string line;
    for (int i = 1; std::getline(in, line); ++i) out += (i == number ? text : line) + "\n";
    write(file, out);
  }

 private:
  void write_robot(const std::string& name, int id, int neighbor, int offset_s) const {
    const auto stamp = [offset_s](int ms) {
      return std::to_string((offset_s * 1000LL + ms) * 1'000'000LL);
    };
    std::string imu = "#t_ns,wx,wy,wz,ax,ay,az\n";
    std::string ranges = "#t_ns,peer,distance,first path,received\n";
    std::string spots = "#t_ns,u,v,area,peak\n";
    for (int i = 0; i < 20; ++i) imu += stamp(10 * i) + ",0.1,0.2,0.3,0.01,-0.02,9.81\n";
    for (int i = 0; i < 10; ++i) {
      ranges += stamp(20 * i) + "," + std::to_string(neighbor) + ",5.5,-80.5,-79\n";
      spots += stamp(20 * i) + ",100.5,200.25,12,255\n" + stamp(20 * i) + ",300,400,9,128\n";
    }
    write(name + "/imu0/data.csv", imu);
    write(name + "/uwb0/data.csv", ranges);
    write(name + "/cam0/spots.csv", spots);
    write(name + "/crepesd.yaml",
          "robot: {id: " + std::to_string(id) +
              "}\n"
              "swarm:\n  members:\n"
              "  - {id: 1, name: r1, pattern: '011111111111111111', p_body_led: [0, 0, 0],"
              " p_body_uwb: [0, 0, 0]}\n"
              "  - {id: 2, name: r2, pattern: '001001011111111111', p_body_led: [0, 0, 0],"
              " p_body_uwb: [0, 0, 0]}\n"
              "cameras:\n"
              "- {name: cam0, camera_model: ds,"
              " intrinsics: [-0.17, 0.59, 316.0, 316.0, 640.0, 512.0], resolution: [1280, 1024],"
              " T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]}\n");
  }

  ScratchDirectory scratch_;
};

}  // namespace crepes
