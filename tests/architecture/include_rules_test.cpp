#include "tests/architecture/include_rules.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tests/architecture/source_tree.hpp"
#include "tests/support/places.hpp"

namespace crepes::include_rules_test {
namespace {

struct Sample {
  std::string_view path;
  std::string_view line;
};

std::string first_violation(const Sample& sample) {
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
           {"estimator/calibration/imu/rests.cpp", "#include \"estimator/team/team_filter.hpp\""},
           {"estimator/swarm/estimator.cpp", "#include \"daemon/stages/counters.hpp\""},
           {"drivers/uwb/nlink.cpp", "#include \"net/mesh/bit_reader.hpp\""},
           {"drivers/camera/camera.hpp", "#include \"estimator/vision/camera_model.hpp\""},
           {"drivers/sim/sim_camera.cpp", "#include \"estimator/vision/blink_tracker.hpp\""},
           {"net/mesh/peer_link.cpp", "#include \"drivers/uwb/nlink.hpp\""},
           {"net/client/messages.cpp", "#include \"estimator/core/outputs.hpp\""},
           {"daemon/runtime.cpp", "#include \"tests/support/manual_clock.hpp\""},
           {"daemon/runtime.cpp", "#include \"runtime.hpp\""},
           {"elsewhere/new.cpp", ""}}) {
    EXPECT_NE(first_violation(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, CatchLibrariesOutOfPlace) {
  for (const Sample& sample :
       std::vector<Sample>{{"estimator/relative/raw_pose.cpp", "#include <opencv2/core.hpp>"},
                           {"estimator/vision/blink_tracker.cpp", "#include <opencv2/core.hpp>"},
                           {"estimator/swarm/estimator.cpp", "#include <ceres/ceres.h>"},
                           {"drivers/camera/camera.hpp", "#include <libcamera/camera.h>"},
                           {"net/peer_message.cpp", "#include <nlohmann/json.hpp>"},
                           {"net/udp_socket.cpp", "#include <spdlog/spdlog.h>"},
                           {"config/schema/config.hpp", "#include <yaml-cpp/yaml.h>"},
                           {"estimator/swarm/estimator.cpp", "#include <fmt/format.h>"},
                           {"estimator/swarm/estimator.cpp", "#include <fstream>"},
                           {"estimator/swarm/estimator.cpp", "#include <thread>"}}) {
    EXPECT_NE(first_violation(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, CatchThreadsLocksAndClocksOutOfPlace) {
  for (const Sample& sample : std::vector<Sample>{
           {"daemon/runtime.cpp", "  std::jthread thread_;"},
           {"daemon/runtime.cpp", "std::thread t([] {});"},
           {"daemon/runtime.hpp", "#include <mutex>"},
           {"daemon/stages/net_stage.hpp", "#include <condition_variable>"},
           {"net/mesh/peer_link.hpp", "#include <atomic>"},
           {"daemon/stages/net_stage.cpp", "auto t = std::chrono::steady_clock::now();"},
           {"drivers/sim/world.cpp", "::clock_gettime(CLOCK_MONOTONIC, &t);"}}) {
    EXPECT_NE(first_violation(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, LetTheArrowsOfTheTablePass) {
  for (const Sample& sample : std::vector<Sample>{
           {"estimator/swarm/estimator.cpp", "#include \"estimator/relative/a.hpp\""},
           {"estimator/vision/spot_detector.cpp", "#include <opencv2/core.hpp>"},
           {"estimator/graph/pose_graph.cpp", "#include <ceres/problem.h>"},
           {"drivers/sim/a.cpp", "#include \"estimator/vision/camera_model.hpp\""},
           {"net/subscription/subscription_json.cpp", "#include <nlohmann/json.hpp>"},
           {"net/subscription/keyed_hash.cpp", "#include <sodium.h>"},
           {"net/udp_socket.cpp", "#include <fmt/format.h>"},
           {"daemon/stages/worker.hpp", "  std::jthread thread_;"},
           {"daemon/stages/bounded_queue.hpp", "#include <mutex>"},
           {"daemon/runtime.cpp", "// not a std::thread"},
           {"daemon/runtime.cpp", "const Timestamp now = clock.now();"}}) {
    EXPECT_EQ(first_violation(sample), "") << sample.path << ": " << sample.line;
  }
}

TEST(IncludeRules, SayWhereAndWhy) {
  EXPECT_EQ(violations_in("net/a.cpp", "\n#include \"daemon/stages/worker.hpp\"\n"),
            std::vector<std::string>{"net/a.cpp:2: net/ may not include daemon/stages/worker.hpp"});
}

TEST(IncludeRules, NameOnlyFoldersAndFilesThatExist) {
  const std::vector<std::string> files =
      source_files({"estimator", "drivers", "net", "config", "daemon", "firmware", "tests"});

  for (const std::string& named : paths_in_rules()) {
    const bool is_used = std::ranges::any_of(
        files, [&](const std::string& file) { return file.starts_with(named); });
    EXPECT_TRUE(is_used) << named << " is in a rule, but no source file begins with it";
  }
}

TEST(IncludeRules, HoldInEverySourceFile) {
  const std::vector<std::string> files =
      source_files({"estimator", "drivers", "net", "config", "daemon", "firmware", "tests"});

  EXPECT_GT(files.size(), 50U);
  for (const std::string& file : files) {
    // The rules' own test is full of violations, as samples.
    if (file.starts_with("tests/architecture/")) continue;
    for (const std::string& violation :
         violations_in(file, text_of_file(std::filesystem::path(source_dir()) / file)))
      ADD_FAILURE() << violation;
  }
}

}  // namespace
}  // namespace crepes::include_rules_test
