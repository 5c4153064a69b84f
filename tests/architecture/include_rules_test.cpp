#include "tests/architecture/include_rules.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/places.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

struct Sample {
  std::string_view path;
  std::string_view line;
};

std::string told(const Sample& sample) {
  const std::vector<std::string> violations = violations_in(sample.path, sample.line);
  return violations.empty() ? "" : violations.front();
}

TEST(IncludeRules, CatchArrowsThatAreNotInTheTable) {
  for (const Sample& sample : std::vector<Sample>{
           {"estimator/core/pose.hpp", "#include \"estimator/relative/raw_pose.hpp\""},
           {"estimator/relative/raw_pose.cpp", "#include \"estimator/vision/camera_model.hpp\""},
           {"estimator/relative/raw_pose.cpp", "  #  include \"estimator/core/clock.hpp\""},
           {"estimator/vision/id_library.cpp", "#include \"estimator/graph/pose_graph.hpp\""},
           {"estimator/graph/pose_graph.cpp", "#include \"estimator/swarm/estimator.hpp\""},
           {"estimator/swarm/estimator.cpp", "#include \"daemon/counters.hpp\""},
           {"drivers/uwb/nlink.cpp", "#include \"net/byte_reader.hpp\""},
           {"drivers/camera/camera.hpp", "#include \"estimator/vision/camera_model.hpp\""},
           {"drivers/sim/sim_camera.cpp", "#include \"estimator/vision/blink_tracker.hpp\""},
           {"net/peer_link.cpp", "#include \"drivers/unique_fd.hpp\""},
           {"daemon/runtime.cpp", "#include \"tests/support/manual_clock.hpp\""},
           {"daemon/runtime.cpp", "#include \"runtime.hpp\""},
           {"elsewhere/new.cpp", ""}}) {
    EXPECT_NE(told(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, CatchLibrariesOutOfPlace) {
  for (const Sample& sample :
       std::vector<Sample>{{"estimator/relative/raw_pose.cpp", "#include <opencv2/core.hpp>"},
                           {"estimator/vision/blink_tracker.cpp", "#include <opencv2/core.hpp>"},
                           {"estimator/swarm/estimator.cpp", "#include <ceres/ceres.h>"},
                           {"net/peer_message.cpp", "#include <nlohmann/json.hpp>"},
                           {"net/udp_socket.cpp", "#include <spdlog/spdlog.h>"},
                           {"estimator/core/config.hpp", "#include <yaml-cpp/yaml.h>"},
                           {"estimator/swarm/estimator.cpp", "#include <fstream>"},
                           {"estimator/swarm/estimator.cpp", "#include <thread>"}}) {
    EXPECT_NE(told(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, CatchThreadsLocksAndClocksOutOfPlace) {
  for (const Sample& sample :
       std::vector<Sample>{{"daemon/runtime.cpp", "  std::jthread thread_;"},
                           {"daemon/runtime.cpp", "std::thread t([] {});"},
                           {"daemon/runtime.hpp", "#include <mutex>"},
                           {"daemon/net_stage.hpp", "#include <condition_variable>"},
                           {"net/peer_link.hpp", "#include <atomic>"},
                           {"daemon/net_stage.cpp", "auto t = std::chrono::steady_clock::now();"},
                           {"drivers/sim/world.cpp", "::clock_gettime(CLOCK_MONOTONIC, &t);"}}) {
    EXPECT_NE(told(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, LetTheArrowsOfTheTablePass) {
  for (const Sample& sample : std::vector<Sample>{
           {"estimator/swarm/estimator.cpp", "#include \"estimator/relative/a.hpp\""},
           {"estimator/vision/spot_detector.cpp", "#include <opencv2/core.hpp>"},
           {"estimator/graph/pose_graph.cpp", "#include <ceres/problem.h>"},
           {"drivers/sim/a.cpp", "#include \"estimator/vision/camera_model.hpp\""},
           {"net/subscription_json.cpp", "#include <nlohmann/json.hpp>"},
           {"net/keyed_hash.cpp", "#include <sodium.h>"},
           {"daemon/worker.hpp", "  std::jthread thread_;"},
           {"daemon/bounded_queue.hpp", "#include <mutex>"},
           {"daemon/runtime.cpp", "// not a std::thread"},
           {"daemon/runtime.cpp", "const Timestamp now = clock.now();"}}) {
    EXPECT_EQ(told(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, SayWhereAndWhy) {
  EXPECT_EQ(violations_in("net/a.cpp", "\n#include \"daemon/worker.hpp\"\n"),
            std::vector<std::string>{"net/a.cpp:2: net/ may not include daemon/worker.hpp"});
}

TEST(IncludeRules, HoldInEverySourceFile) {
  const fs::path root = source_dir();
  std::size_t files = 0;
  std::vector<std::string> violations;
  for (const char* folder : {"estimator", "drivers", "net", "daemon", "firmware", "tests"}) {
    if (!fs::exists(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string path = entry.path().lexically_relative(root).generic_string();
      const std::string extension = entry.path().extension().string();
      // The rules' own test is full of violations, as samples.
      if (path.starts_with("tests/architecture/")) continue;
      if (extension != ".hpp" && extension != ".cpp" && extension != ".h" && extension != ".c")
        continue;
      ++files;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      for (std::string& violation : violations_in(path, text))
        violations.push_back(std::move(violation));
    }
  }

  EXPECT_GT(files, 50U);
  for (const std::string& violation : violations) ADD_FAILURE() << violation;
}

}  // namespace
}  // namespace crepes
