#include "daemon/ctl/text_table.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace crepes::text_table_test {
namespace {

TEST(TextTable, AlignsNumbersToTheRight) {
  EXPECT_EQ(text_table({{"robot", "m"}, {"r1", "0.5"}, {"r20", "12"}}),
            "robot    m\n"
            "r1     0.5\n"
            "r20     12\n");
}

TEST(TextTable, WordsInTheLastColumnAreFlushLeft) {
  EXPECT_EQ(text_table({{"robot", "m", "why"}, {"r1", "0.5", ""}, {"r2", "1", "not seen"}},
                       LastColumn::kWords),
            "robot    m  why\n"
            "r1     0.5\n"
            "r2       1  not seen\n");
}

TEST(TextTable, WordsWrapBelowTheirFirstLetterAndNoneIsLost) {
  std::string words = "word";
  for (int i = 0; i < 60; ++i) words += " word";
  std::istringstream lines(text_table({{"robot", "what"}, {"r1", words}}, LastColumn::kWords));
  std::string line;
  std::getline(lines, line);
  std::size_t count = 0;
  while (std::getline(lines, line)) {
    EXPECT_LE(line.size(), 100U);
    EXPECT_EQ(line.find('w'), 7U) << line;
    std::istringstream found(line.substr(7));
    for (std::string word; found >> word; ++count) EXPECT_EQ(word, "word");
  }
  EXPECT_EQ(count, 61U);
}

TEST(TextTable, AWordThatIsTooLongStaysWhole) {
  const std::string word(150, 'x');
  EXPECT_EQ(text_table({{"a", "b"}, {"c", word + " d"}}, LastColumn::kWords),
            "a  b\nc  " + word + "\n   d\n");
}

TEST(Fixed, GivesZeroNoSign) {
  EXPECT_EQ(fixed(-0.0, 1), "0.0");
  EXPECT_EQ(fixed(-0.04, 1), "0.0");
  EXPECT_EQ(fixed(-0.06, 1), "-0.1");
  EXPECT_EQ(fixed(-10.0, 0), "-10");
}

}  // namespace
}  // namespace crepes::text_table_test
