#include "daemon/ctl/setup/spots.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::spots_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// A data set's camera, r1/cam0, with pictures of a board that blinks as robot 2.
class Pictures : public testing::Test {
 protected:
  Pictures() {
    std::string config = swarm_.read("r1/crepesd.yaml");
    const std::string camera =
        "intrinsics: [-0.17, 0.59, 316.0, 316.0, 640.0, 512.0], resolution: [1280, 1024]";
    config.replace(config.find(camera), camera.size(),
                   "intrinsics: [-0.17, 0.59, 80.0, 80.0, 160.0, 120.0], resolution: [320, 240]");
    swarm_.write("r1/crepesd.yaml", config);
    options_.config = swarm_.dir() / "r1/crepesd.yaml";
    options_.on_text = [this](const std::string& text) { text_ += text; };
    options_.on_fault = [this](const std::string& fault) { faults_ += fault + "\n"; };
  }

  /// A dark picture with noise and, if lit, a spot that wanders to the right.
  cv::Mat picture(int number, bool is_lit) {
    cv::Mat image(240, 320, CV_8UC1);
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) {
        const double d2 = std::pow(u - 100.0 - 0.1 * number, 2) + std::pow(v - 90.0, 2);
        const double light = is_lit ? 500.0 * std::exp(-d2 / 2.0) : 0.0;
        image.at<std::uint8_t>(v, u) =
            cv::saturate_cast<std::uint8_t>(8.0 + light + static_cast<double>(random_() % 4U));
      }
    return image;
  }

  void save(const fs::path& file, const cv::Mat& image) const {
    fs::create_directories((swarm_.dir() / file).parent_path());
    ASSERT_TRUE(cv::imwrite((swarm_.dir() / file).string(), image));
  }

  /// 0.5 s at 200 Hz; `name_of(i)` names the pictures.
  template <class NameOf>
  void record(const fs::path& folder, const NameOf& name_of) {
    std::string list = "#t_ns,file\n";
    const std::string pattern = "001001011111111111";
    for (int i = 0; i < 100; ++i) {
      save(folder / name_of(i), picture(i, pattern[static_cast<std::size_t>(i / 2) % 18] == '1'));
      list += std::to_string(1'000'000'000LL + i * 5'000'000LL) + "," + name_of(i) + "\n";
    }
    list_ = list;
  }

  [[nodiscard]] Result<SpotsSummary> look_at(const fs::path& source) {
    options_.source = swarm_.dir() / source;
    return inspect_spots(options_);
  }

  TinySwarm swarm_;
  SpotsOptions options_;
  std::string text_;
  std::string faults_;
  std::string list_;
  std::mt19937 random_{1};
};

TEST_F(Pictures, OfADataSetShowTheRobotThatBlinksInThem) {
  // Names in an order of their own: the list counts.
  record("r1/cam0/data", [](int i) { return "x" + std::to_string(997 * i % 100) + ".png"; });
  swarm_.write("r1/cam0/data.csv", list_);

  const auto summary = look_at("r1/cam0");

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->pictures, 100U);
  EXPECT_NEAR(summary->duration_s, 0.495, 1e-9);
  ASSERT_EQ(summary->robots.size(), 1U);
  EXPECT_EQ(summary->robots.begin()->first, RobotId{2});
  EXPECT_EQ(summary->robots.begin()->second.name, "r2");
  EXPECT_LT(summary->robots.begin()->second.first_s, 0.4);
  EXPECT_GT(summary->dark, 20U);
  EXPECT_GT(summary->good, 60U);
  EXPECT_EQ(exposure_advice(*summary), "");
  EXPECT_NE(text_.find("robot 2"), std::string::npos) << text_;
}

TEST_F(Pictures, AreOrderedByNanosecondsInTheirNames) {
  record("shots", [](int i) { return std::to_string(900'000'000LL + i * 5'000'000LL) + ".png"; });

  const auto summary = look_at("shots");

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_NEAR(summary->duration_s, 0.495, 1e-9);
  EXPECT_EQ(summary->robots.count(RobotId{2}), 1U);
}

TEST_F(Pictures, FollowEachOtherAtTheCamerasRateWhenNothingSaysTheirTime) {
  record("shots", [](int i) { return "shot" + std::to_string(1000 + i) + ".png"; });

  const auto summary = look_at("shots");

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_NEAR(summary->duration_s, 0.495, 1e-9);
  EXPECT_EQ(summary->robots.count(RobotId{2}), 1U);
}

TEST_F(Pictures, AreDrawnWithCirclesWhereSpotsAre) {
  save("one.png", picture(0, true));
  options_.out = swarm_.dir() / "drawn" / "here";

  const auto summary = look_at("one.png");

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->spots.max, 1U);
  EXPECT_NE(text_.find("100.0"), std::string::npos) << text_;
  const cv::Mat drawn = cv::imread((*options_.out / "one.spots.png").string());
  ASSERT_EQ(drawn.size(), cv::Size(320, 240));
  int colored_near = 0;
  int colored_far = 0;
  for (int v = 40; v < drawn.rows; ++v)
    for (int u = 0; u < drawn.cols; ++u) {
      const auto& p = drawn.at<cv::Vec3b>(v, u);
      if (p[1] - p[0] > 40) (std::hypot(u - 100, v - 90) < 20 ? colored_near : colored_far)++;
    }
  EXPECT_GT(colored_near, 20);
  EXPECT_EQ(colored_far, 0);
}

TEST_F(Pictures, OfARobotGiveARowForEachBearing) {
  record("r1/cam0/data", [](int i) { return std::to_string(i) + ".png"; });
  swarm_.write("r1/cam0/data.csv", list_);
  options_.out = swarm_.dir() / "found";
  options_.every = 1000;

  const auto summary = look_at("r1");

  ASSERT_TRUE(summary) << summary.error().message;
  std::istringstream rows(swarm_.read("found/bearings.csv"));
  std::string row;
  std::getline(rows, row);
  EXPECT_EQ(row, "t_ns,id,u,v,bx,by,bz,sigma_rad,how");
  std::size_t count = 0;
  while (std::getline(rows, row)) {
    ++count;
    EXPECT_NE(row.find(",2,10"), std::string::npos) << row;
    EXPECT_TRUE(row.ends_with(",read")) << row;
  }
  EXPECT_EQ(count, summary->robots.at(RobotId{2}).pictures);
  EXPECT_GT(count, 20U);
}

TEST_F(Pictures, ThatWereNotRecordedAreReplacedBySpots) {
  std::string spots = "#t_ns,u,v,area,peak\n";
  const std::string pattern = "001001011111111111";
  for (int i = 0; i < 100; ++i) {
    const std::string stamp = std::to_string(1'000'000'000LL + i * 5'000'000LL);
    spots += stamp +
             (pattern[static_cast<std::size_t>(i / 2) % 18] == '1' ? ",100,90,12,200\n" : ",,,,\n");
  }
  swarm_.write("r1/cam0/spots.csv", spots);

  const auto summary = look_at("r1");

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->pictures, 100U);
  EXPECT_EQ(summary->robots.count(RobotId{2}), 1U);
  // Nobody knows what was behind these spots.
  EXPECT_EQ(text_.find("threshold"), std::string::npos) << text_;
  EXPECT_EQ(text_.find("exposure"), std::string::npos) << text_;
  EXPECT_NE(text_.find("of spots.csv"), std::string::npos) << text_;
  EXPECT_FALSE(Json::parse(summary_json(*summary)).contains("background"));

  const auto camera = look_at("r1/cam0");

  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->pictures, 100U);
}

TEST_F(Pictures, InWhichNobodyIsRecognizedComeWithTheReason) {
  for (int i = 0; i < 20; ++i) {
    save("slow/" + std::to_string(1'000'000'000LL + i * 50'000'000LL) + ".png", picture(i, true));
    save("steady/" + std::to_string(1'000'000'000LL + i * 5'000'000LL) + ".png", picture(i, true));
  }

  const auto slow = look_at("slow");
  const auto steady = look_at("steady");

  ASSERT_TRUE(slow && steady);
  EXPECT_EQ(identity_advice(*slow),
            "20.0 pictures a second are too few to read slots of 10 ms: 200 or more");
  EXPECT_NE(identity_advice(*steady).find("swarm.members"), std::string::npos);
  EXPECT_NE(text_.find("ADVICE     no light blinks as a member"), std::string::npos) << text_;
}

TEST_F(Pictures, OfASwarmAreRefusedBecauseARobotIsWanted) {
  const auto summary = look_at(".");

  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUsage);
  EXPECT_NE(summary.error().message.find("holds a swarm; name the folder of one robot"),
            std::string::npos)
      << summary.error().message;
}

TEST_F(Pictures, AreReportedInJson) {
  save("shots/1.png", picture(0, true));
  save("shots/2.png", picture(0, false));
  options_.json = true;

  ASSERT_TRUE(look_at("shots"));

  std::istringstream lines(text_);
  std::vector<Json> objects;
  for (std::string line; std::getline(lines, line);) objects.push_back(Json::parse(line));
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[0]["class"], "PICTURE");
  EXPECT_EQ(objects[0]["t_ns"], "1");
  EXPECT_NEAR(objects[0]["spots"][0]["u"], 100.0, 0.1);
  EXPECT_EQ(objects[1]["exposure"], "dark");
  EXPECT_EQ(objects[2]["class"], "SUMMARY");
  EXPECT_EQ(objects[2]["exposure"]["good"], 1);
}

TEST_F(Pictures, ThatAreHopelessComeWithAdvice) {
  save("dark/1.png", picture(0, false));
  save("bright/1.png", cv::Mat(240, 320, CV_8UC1, cv::Scalar(255)));

  const auto dark = look_at("dark");
  const auto bright = look_at("bright");

  ASSERT_TRUE(dark && bright);
  EXPECT_NE(exposure_advice(*dark).find("lengthen the exposure"), std::string::npos);
  EXPECT_NE(exposure_advice(*bright).find("shorten the exposure"), std::string::npos);
  EXPECT_NE(text_.find("ADVICE"), std::string::npos) << text_;
}

TEST_F(Pictures, ThatCannotBeUsedAreRefusedByName) {
  save("shots/1.png", picture(0, true));
  save("shots/2.png", cv::Mat(24, 32, CV_8UC1, cv::Scalar(0)));
  swarm_.write("shots/3.png", "no picture");

  const auto summary = look_at("shots");

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->pictures, 1U);
  EXPECT_EQ(summary->refused, 2U);
  EXPECT_NE(faults_.find("2.png: is 32x24, but cam0 takes pictures of 320x240"), std::string::npos)
      << faults_;
  EXPECT_NE(faults_.find("3.png"), std::string::npos) << faults_;
}

TEST_F(Pictures, ThatAreNotThereAreAnErrorThatNamesThem) {
  fs::create_directories(swarm_.dir() / "empty");
  swarm_.write("bad.png", "no picture");
  swarm_.write("cam0/data.csv", "#t_ns,file\n1,a.png\n");
  save("twice/7.png", picture(0, true));
  save("twice/07.png", picture(0, true));
  save("cam3/1.png", picture(0, true));

  for (const auto& [source, expected] : std::vector<std::pair<std::string, std::string>>{
           {"nowhere", "nowhere: no such picture or folder"},
           {"empty", "empty: holds no pictures"},
           {"bad.png", "bad.png: not a picture"},
           {"cam0", "data.csv:2: "},
           {"twice", "say the same time"},
           {"cam3", "cameras[3]"}}) {
    const auto summary = look_at(source);

    ASSERT_FALSE(summary) << source;
    EXPECT_NE(summary.error().message.find(expected), std::string::npos) << summary.error().message;
  }
}

TEST_F(Pictures, NeedAConfigurationAndItsCamera) {
  save("one.png", picture(0, true));
  options_.camera = "rear";
  const auto no_camera = look_at("one.png");
  options_.camera = "cam0";
  const auto right_camera = look_at("one.png");
  options_.config = swarm_.dir() / "none.yaml";
  const auto no_config = look_at("one.png");

  ASSERT_FALSE(no_camera);
  EXPECT_NE(no_camera.error().message.find("rear"), std::string::npos);
  EXPECT_TRUE(right_camera);
  ASSERT_FALSE(no_config);
  EXPECT_NE(no_config.error().message.find("none.yaml"), std::string::npos);
}

TEST_F(Pictures, AreNotDrawnWhereNothingCanBeWritten) {
  save("one.png", picture(0, true));
  swarm_.write("taken", "a file");
  options_.out = swarm_.dir() / "taken";

  const auto summary = look_at("one.png");

  ASSERT_FALSE(summary);
  EXPECT_NE(summary.error().message.find("taken"), std::string::npos);
}

}  // namespace
}  // namespace crepes::spots_test
