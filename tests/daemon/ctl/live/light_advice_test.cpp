#include "daemon/ctl/live/light_advice.hpp"

#include <gtest/gtest.h>

namespace crepes::light_advice_test {
namespace {

using Totals = client::Status::Totals;

/// A near board that is just white and a far one well above the threshold.
Totals well() {
  return {{"background", 4}, {"threshold", 20}, {"spots", 3}, {"brightest", 252}, {"faintest", 60}};
}

Totals with(Totals counts, const Totals& other) {
  for (const auto& [name, count] : other) counts[name] = count;
  return counts;
}

bool asks_for(const Totals& counts, const char* what) {
  return light_advice(counts).find(what) != std::string::npos;
}

TEST(LightAdvice, IsEmptyWhereTheExposureFits) { EXPECT_EQ(light_advice(well()), ""); }

TEST(LightAdvice, SaysWhatIsWrongWithAFixedExposure) {
  EXPECT_TRUE(asks_for(with(well(), {{"background", 90}}), "shorten"));
  EXPECT_TRUE(asks_for(with(well(), {{"spots", 50}}), "shorten"));
  EXPECT_TRUE(asks_for(with(well(), {{"brightest", 120}}), "lengthen exposure_us, or raise gain"));
  EXPECT_TRUE(asks_for(with(well(), {{"faintest", 25}}), "lengthen"));
  EXPECT_TRUE(asks_for({{"background", 4}, {"threshold", 20}}, "in view"));
}

TEST(LightAdvice, LeavesToAnAutomaticExposureWhatThatCanChange) {
  const Totals shortened = with(well(), {{"auto_exposure_us", 200}, {"longest_exposure_us", 500}});
  EXPECT_EQ(light_advice(with(shortened, {{"brightest", 120}})), "");
  EXPECT_EQ(light_advice(with(shortened, {{"faintest", 25}})), "");
  EXPECT_TRUE(asks_for(with(shortened, {{"background", 90}}), "shorten"))
      << "it looks at boards, not at the room";

  const Totals longest = with(well(), {{"auto_exposure_us", 500}, {"longest_exposure_us", 500}});
  EXPECT_EQ(light_advice(with(longest, {{"brightest", 120}})), "") << "blur has a bound";
  EXPECT_TRUE(asks_for(with(longest, {{"faintest", 25}}), "lengthen"));
}

}  // namespace
}  // namespace crepes::light_advice_test
