#include "daemon/ctl/calibrate/coverage_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>

#include "drivers/base/scratch_directory.hpp"

namespace crepes::coverage_file_test {
namespace {

namespace fs = std::filesystem;

constexpr auto kCoverage = R"({"share":0.5,"seen_s":31,"cells":["#. "],"missing":["more"]})";

class CoverageFileTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path socket() const { return scratch_.path() / "record"; }
  [[nodiscard]] fs::path file() const { return scratch_.path() / "record.coverage"; }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

TEST_F(CoverageFileTest, LastsAsLongAsTheCalibration) {
  EXPECT_FALSE(read_coverage(socket()));
  {
    const CoverageFile written(socket());
    ASSERT_TRUE(written.write(kCoverage));
    EXPECT_EQ(read_coverage(socket()), kCoverage);
  }
  EXPECT_FALSE(fs::exists(file()));
}

TEST_F(CoverageFileTest, OfACalibrationThatWasKilledIsForgotten) {
  std::ofstream(file()) << kCoverage;
  EXPECT_TRUE(read_coverage(socket()));
  fs::last_write_time(file(), fs::last_write_time(file()) - std::chrono::seconds{6});

  EXPECT_FALSE(read_coverage(socket()));
}

TEST_F(CoverageFileTest, RefusesWhatIsNoCoverage) {
  for (const char* text : {"", "[]", "{}", "no json", R"({"share":1})",
                           R"({"share":"1","seen_s":1,"cells":[],"missing":[]})",
                           R"({"share":1,"seen_s":1,"cells":[1],"missing":[]})"}) {
    std::ofstream(file()) << text;
    EXPECT_FALSE(read_coverage(socket())) << text;
  }
  std::ofstream(file()) << std::string(100'000, ' ') << kCoverage;
  EXPECT_FALSE(read_coverage(socket()));
}

TEST_F(CoverageFileTest, SaysWhereItCannotBeWritten) {
  const CoverageFile nowhere(scratch_.path() / "missing" / "record");
  EXPECT_FALSE(nowhere.write(kCoverage));
}

}  // namespace
}  // namespace crepes::coverage_file_test
