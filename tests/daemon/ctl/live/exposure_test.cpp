#include "daemon/ctl/live/exposure.hpp"

#include <gtest/gtest.h>

#include "drivers/base/scratch_directory.hpp"
#include "tests/daemon/ctl/live/served_status.hpp"
#include "tests/support/places.hpp"

namespace crepes::exposure_test {
namespace {

namespace fs = std::filesystem;

TEST(ExposureCommand, ChangesNoFilesOfAnotherRobotThanTheDaemons) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path config = scratch.path() / "crepesd.yaml";
  fs::copy_file(source_dir() + "/config/examples/four-simulated/r1.yaml", config);
  SystemStatus status;
  status.self = RobotId{2};
  const ServedStatus daemon(status);
  ExposureOptions options;
  options.daemon = daemon.address();
  options.config = config;
  options.exposure_us = 300.0;

  const auto done = exposure(options);

  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("crepesd.yaml is robot 1's, this daemon is robot 2"),
            std::string::npos)
      << done.error().message;
  EXPECT_FALSE(fs::exists(scratch.path() / "crepesd.d"));
}

}  // namespace
}  // namespace crepes::exposure_test
