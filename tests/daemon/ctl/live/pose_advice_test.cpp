#include "daemon/ctl/live/pose_advice.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/places.hpp"

namespace crepes::pose_advice_test {
namespace {

TEST(PoseAdvice, AndTheDocumentHaveEveryReason) {
  std::ifstream file(std::string(source_dir()) + "/config/docs/troubleshooting.md");
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  for (auto i = 1U; i <= static_cast<unsigned>(NoPoseReason::kUncertain); ++i) {
    const auto reason = static_cast<NoPoseReason>(i);
    EXPECT_FALSE(advice_for(reason).empty()) << name_of(reason);
    EXPECT_EQ(advice_for(name_of(reason)), advice_for(reason));
    EXPECT_NE(document.find("* **" + std::string(name_of(reason)) + "**"), std::string::npos)
        << name_of(reason);
  }
}

TEST(PoseAdvice, IsEmptyWithAPoseAndForUnknownReasons) {
  EXPECT_TRUE(advice_for(NoPoseReason::kNone).empty());
  EXPECT_TRUE(advice_for("tired").empty());
  EXPECT_TRUE(advice_for("").empty());
}

}  // namespace
}  // namespace crepes::pose_advice_test
