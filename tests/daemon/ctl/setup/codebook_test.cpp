#include "daemon/ctl/setup/codebook.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "config/reading/config_file.hpp"
#include "drivers/base/text_file.hpp"
#include "estimator/vision/id_library.hpp"
#include "tests/support/places.hpp"

namespace crepes::codebook_test {
namespace {

constexpr const char* kTheRest = R"(robot: {id: 1}
cameras:
  - name: cam0
    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]
    resolution: [1280, 1024]
    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]
)";

std::string refusal(const CodebookOptions& options) {
  const Result<std::string> text = codebook(options);
  return text ? "" : text.error().message;
}

TEST(CodebookCommand, WritesTheSwarmSectionOfAConfiguration) {
  const Result<std::string> text = codebook({.ids = 12, .search = {.steps = 100'000}});
  ASSERT_TRUE(text.has_value()) << text.error().message;

  const CheckedConfig checked = check_config_text(kTheRest + *text, "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  ASSERT_EQ(checked.config.swarm.members.size(), 12U);
  EXPECT_EQ(checked.config.swarm.members.back().id, RobotId{12});
  EXPECT_EQ(checked.config.swarm.members.back().name, "r12");
  EXPECT_TRUE(IdLibrary::from(checked.config.swarm).has_value());
}

TEST(CodebookCommand, WroteTheLibraryOfSixtyFour) {
  const auto kept =
      read_text_file(source_dir() + "/config/libraries/library64.yaml").value_or("none");

  EXPECT_EQ(codebook({.ids = 64}), kept)
      << "renew it: crepesctl codebook --out config/libraries/library64.yaml";
}

TEST(CodebookCommand, TheLibraryOfSixtyFourIsGoodForTheDaemon) {
  const auto kept = read_text_file(source_dir() + "/config/libraries/library64.yaml");
  ASSERT_TRUE(kept.has_value());

  const CheckedConfig checked = check_config_text(kTheRest + *kept, "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  const std::vector<MemberConfig>& members = checked.config.swarm.members;
  ASSERT_EQ(members.size(), 64U);
  for (const MemberConfig& a : members) {
    EXPECT_EQ(a.pattern->size(), 20U);
    for (const MemberConfig& b : members) {
      if (a.id != b.id) {
        EXPECT_GE(cyclic_distance(*a.pattern, *b.pattern), 4U);
      }
    }
  }
}

TEST(CodebookCommand, SaysWhatIsPossibleWhenTheRequestIsNot) {
  const std::string why = refusal({.ids = 12,
                                   .rules = {.slots = 12, .distance = 4, .max_dark = 2},
                                   .search = {.steps = 100'000}});

  EXPECT_NE(why.find("of 12 patterns of 12 slots with distance 4, dark for at most 2"),
            std::string::npos)
      << why;
  const std::size_t at = why.find("\n  --slots ");
  ASSERT_NE(at, std::string::npos) << why;
  EXPECT_NE(why.find("\n  --distance 2"), std::string::npos) << why;
  // What it says is true.
  const CodebookRules rules{.slots = std::stoul(why.substr(at + 11)), .distance = 4, .max_dark = 2};
  EXPECT_EQ(search_codebook(rules, 12).patterns.size(), 12U);
}

TEST(CodebookCommand, RefusesWhatMakesNoSense) {
  const auto refused = [](CodebookOptions options) { return refusal(options).substr(0, 8); };

  EXPECT_EQ(refused({.ids = 0}), "--ids: m");
  EXPECT_EQ(refused({.ids = 1001}), "--ids: m");
  EXPECT_EQ(refused({.rules = {.slots = 33}}), "--slots:");
  EXPECT_EQ(refused({.rules = {.distance = 0}}), "--distan");
  EXPECT_EQ(refused({.rules = {.max_dark = 20}}), "--max-da");
}

}  // namespace
}  // namespace crepes::codebook_test
