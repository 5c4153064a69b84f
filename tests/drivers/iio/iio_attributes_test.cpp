#include "drivers/iio/iio_attributes.hpp"

#include <gtest/gtest.h>

#include "tests/support/fake_iio.hpp"

namespace crepes::iio_attributes_test {
namespace {

class IioFiles : public testing::Test {
 protected:
  void SetUp() override { machine_.write(0, "name", "chip"); }
  [[nodiscard]] IioAttributes device() const { return IioAttributes(machine_.folder(0)); }

  FakeIio machine_;
};

TEST(MountMatrix, IsReadRowByRow) {
  const auto R = parse_mount_matrix("0, -1, 0; 1, 0, 0; 0, 0, 1");

  ASSERT_TRUE(R);
  EXPECT_EQ(*R * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
}

TEST(MountMatrix, IsRefusedUnlessARotation) {
  for (const char* text : {"", "1, 0, 0; 0, 1, 0", "1, 0, 0; 0, 1, 0; 0, 0, -1",
                           "2, 0, 0; 0, 2, 0; 0, 0, 2", "nan, 0, 0; 0, 1, 0; 0, 0, 1",
                           "1, 0, 0; 0, 1, 0; 0, 0, 1; 0", "one, 0, 0; 0, 1, 0; 0, 0, 1"})
    EXPECT_FALSE(parse_mount_matrix(text)) << text;
}

TEST(NearestRate, IsOfTheListOrTheInterval) {
  EXPECT_EQ(nearest_rate("12.5 26 52 104 208 416 833\n", 200.0), 208.0);
  EXPECT_EQ(nearest_rate("833", 200.0), 833.0);
  EXPECT_EQ(nearest_rate("[1 1 1000]", 200.4), 200.0);
  EXPECT_EQ(nearest_rate("[10 10 100]", 200.0), 100.0);
  EXPECT_EQ(nearest_rate("", 200.0), 200.0);
  EXPECT_EQ(nearest_rate("as you like", 200.0), 200.0);
  EXPECT_EQ(nearest_rate("0 100", 1.0), 100.0);
}

TEST_F(IioFiles, ConvertRawNumbersByOffsetScaleAndMountMatrix) {
  machine_.write(0, "in_accel_scale", "0.5");
  machine_.write(0, "in_accel_y_scale", "2");
  machine_.write(0, "in_accel_offset", "-1");
  machine_.write(0, "in_mount_matrix", "1, 0, 0; 0, -1, 0; 0, 0, -1");

  const auto conversion = read_conversion(device(), "accel");

  ASSERT_TRUE(conversion) << conversion.error().message;
  EXPECT_EQ(conversion->apply({11.0, 11.0, 11.0}), Eigen::Vector3d(5.0, -20.0, -5.0));
}

TEST_F(IioFiles, ThatAreMissingOrWrongAreNamed) {
  EXPECT_NE(read_conversion(device(), "accel").error().message.find("in_accel_scale"),
            std::string::npos);

  machine_.write(0, "in_accel_scale", "0.5 g");
  EXPECT_NE(read_conversion(device(), "accel").error().message.find("\"0.5 g\""),
            std::string::npos);

  machine_.write(0, "in_accel_scale", "0.5");
  machine_.write(0, "in_accel_mount_matrix", "1, 0, 0; 0, 1, 0; 0, 0, -1");
  EXPECT_NE(read_conversion(device(), "accel").error().message.find("is no rotation"),
            std::string::npos);
}

TEST_F(IioFiles, AreWrittenOnlyIfTheyChange) {
  EXPECT_TRUE(device().set("name", "chip"));
  EXPECT_TRUE(device().set("name", "other"));
  EXPECT_EQ(machine_.read(0, "name"), "other");

  const auto missing = device().set("absent", "1");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("absent: cannot be set to 1"), std::string::npos);
}

}  // namespace
}  // namespace crepes::iio_attributes_test
