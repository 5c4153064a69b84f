#include "drivers/camera/image_folder.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/manual_clock.hpp"

namespace crepes::image_folder_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class ImageFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) /
            testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(root_);
    fs::create_directories(root_ / "data");
    camera_.name = "cam0";
    camera_.resolution = {3, 2};
  }
  void TearDown() override { fs::remove_all(root_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(root_ / name, std::ios::binary) << text;
  }
  /// 3 x 2 pixels; OpenCV reads portable gray maps as it does PNG.
  void write_picture(const std::string& name) const {
    write("data/" + name, "P5 3 2 255\n\x01\x02\x03\x04\x05\xff");
  }
  [[nodiscard]] std::string list_error() const {
    const auto list = read_picture_list(root_ / "data.csv", root_ / "data");
    return list ? "" : list.error().message;
  }

  fs::path root_;
  ManualClock clock_;
  CameraCalibration camera_;
};

TEST_F(ImageFolderTest, ReadsAPictureRowByRow) {
  write_picture("a.pgm");

  const auto image = read_gray_image(root_ / "data/a.pgm");

  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->width, 3);
  EXPECT_EQ(image->height, 2);
  EXPECT_EQ(image->pixels, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 255}));
}

TEST_F(ImageFolderTest, NamesAMissingAndABrokenPicture) {
  write("data/broken.png", "\x89PNG\r\n\x1a\nnot really");

  EXPECT_EQ(read_gray_image(root_ / "data/none.png").error().message,
            (root_ / "data/none.png").string() + ": no such picture");
  EXPECT_EQ(read_gray_image(root_ / "data/broken.png").error().message,
            (root_ / "data/broken.png").string() + ": not a picture that can be read");
}

TEST_F(ImageFolderTest, SaysWhereAListIsWrong) {
  const std::string csv = (root_ / "data.csv").string();
  write_picture("a.pgm");
  EXPECT_EQ(list_error(), csv + ": cannot be read");
  write("data.csv", "#t,name\n");
  EXPECT_EQ(list_error(), csv + ": names no pictures");
  write("data.csv", "#t,name\n100,a.pgm\n12x,a.pgm\n");
  EXPECT_EQ(list_error(), csv + ":3: expected `t_ns,file name`");
  write("data.csv", "#t,name\n100,a.pgm\n100,a.pgm\n");
  EXPECT_EQ(list_error(), csv + ":3: time goes back");
  write("data.csv", "#t,name\n100,b.pgm\n");
  EXPECT_EQ(list_error(), csv + ":2: " + (root_ / "data/b.pgm").string() + " is missing");
}

TEST_F(ImageFolderTest, PlaysPicturesAtTheirRecordedPaceOnItsOwnClock) {
  write_picture("a.pgm");
  write("data.csv", "#t,name\n7000000000,a.pgm\r\n7005000000,a.pgm\n");
  clock_.set(Timestamp{1s});
  auto camera = FolderCamera::open(root_ / "data/", camera_, 2, clock_);
  ASSERT_TRUE(camera) << camera.error().message;

  const auto first = (*camera)->read_once(0ms);
  const auto too_early = (*camera)->read_once(0ms);
  clock_.advance(6ms);
  const auto second = (*camera)->read_once(0ms);
  EXPECT_EQ((*camera)->diagnosis(), (root_ / "data").string() + ": no more pictures");
  const auto end = (*camera)->read_once(0ms);

  ASSERT_TRUE(first && *first);
  EXPECT_EQ((*first)->stamp, Timestamp{1s});
  EXPECT_EQ((*first)->camera, 2);
  EXPECT_TRUE(too_early && !*too_early);
  ASSERT_TRUE(second && *second);
  EXPECT_EQ((*second)->stamp, Timestamp{1s} + 5ms);
  EXPECT_TRUE(end && !*end);
}

TEST_F(ImageFolderTest, PlaysOnAfterPicturesThatCannotBeUsed) {
  write_picture("a.pgm");
  write("data/broken.pgm", "P5 3");
  write("data/larger.pgm", "P5 3 3 255\n123456789");
  write("data.csv", "#t,name\n1,broken.pgm\n2,larger.pgm\n3,a.pgm\n4,a.pgm\n");
  auto camera = FolderCamera::open(root_ / "data", camera_, 0, clock_);
  ASSERT_TRUE(camera) << camera.error().message;
  clock_.advance(1ms);

  const auto broken = (*camera)->read_once(0ms);
  EXPECT_NE((*camera)->diagnosis().value_or("").find("broken.pgm: "), std::string::npos);
  const auto larger = (*camera)->read_once(0ms);
  EXPECT_EQ((*camera)->diagnosis(), (root_ / "data/larger.pgm").string() +
                                        ": is 3x3, but cam0 takes pictures of 3x2 (resolution)");
  const auto good = (*camera)->read_once(0ms);

  EXPECT_TRUE(broken && !*broken);
  EXPECT_TRUE(larger && !*larger);
  EXPECT_TRUE(good && *good);
  EXPECT_EQ((*camera)->counters().faults, (Totals{{"unreadable_pictures", 2}}));
  EXPECT_EQ((*camera)->counters().counts, (Totals{{"frames", 1}}));
}

}  // namespace
}  // namespace crepes::image_folder_test
