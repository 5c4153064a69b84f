#include "config/reading/spelling.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace crepes::spelling_test {
namespace {

const std::vector<std::string> kWords{"watch", "waitpose", "view", "status"};

TEST(Spelling, FindsTheWordWithTheFewestEdits) {
  EXPECT_EQ(nearest_spelling("wacht", kWords), "watch");
  EXPECT_EQ(nearest_spelling("veiw", kWords), "view");
  EXPECT_EQ(nearest_spelling("waitpos", kWords), "waitpose");
}

TEST(Spelling, NamesNothingThatIsNotSimilar) {
  EXPECT_EQ(nearest_spelling("calibrate", kWords), std::nullopt);
  EXPECT_EQ(nearest_spelling("", kWords), std::nullopt);
  EXPECT_EQ(nearest_spelling(std::string(65, 'w'), std::vector{std::string(65, 'w')}),
            std::nullopt);
}

TEST(Spelling, KeepsTheFirstOfEquals) {
  EXPECT_EQ(nearest_spelling("b", std::vector<std::string>{"a", "c"}), "a");
}

}  // namespace
}  // namespace crepes::spelling_test
