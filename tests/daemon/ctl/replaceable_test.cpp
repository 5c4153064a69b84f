#include "daemon/ctl/replaceable.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "drivers/base/scratch_directory.hpp"

namespace crepes::replaceable_test {
namespace {

class Replaceable : public testing::Test {
 protected:
  [[nodiscard]] bool may_replace(const std::string& content) const {
    std::ofstream(file()) << content;
    return check_replaceable(file(), "crepesctl calibrate imu").has_value();
  }
  [[nodiscard]] std::filesystem::path file() const { return scratch_.path() / "imu.yaml"; }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

TEST_F(Replaceable, MayBeWhatIsMissingEmptyADeviceOrAnEarlierResult) {
  EXPECT_TRUE(check_replaceable(file(), "crepesctl calibrate imu"));
  EXPECT_TRUE(check_replaceable("/dev/null", "crepesctl calibrate imu"));
  EXPECT_TRUE(may_replace(""));
  EXPECT_TRUE(may_replace("# Written by crepesctl calibrate imu\nimu: {}\n"));
}

TEST_F(Replaceable, IsNothingThatSomebodyElseHasMade) {
  EXPECT_FALSE(may_replace("#Accelerometers\naccelerometer_noise_density: 0.002\n"));
  EXPECT_FALSE(may_replace("# Written by crepesctl calibrate range: measured = distance + bias\n"));
  EXPECT_FALSE(may_replace("robot: {id: 1}\n# Written by crepesctl calibrate imu\n"));
  EXPECT_FALSE(may_replace("# Robot 1, written by crepesctl init.\n"));
}

}  // namespace
}  // namespace crepes::replaceable_test
