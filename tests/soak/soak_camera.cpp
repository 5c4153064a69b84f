#include "tests/soak/soak_camera.hpp"

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr int kPictures = 20;

}  // namespace

SoakCamera::SoakCamera(fs::path folder, unsigned seed)
    : folder_(std::move(folder)), random_(seed), is_gige_(enter_own_network()) {
  if (is_gige_) return;
  write_pictures();
  fs::rename(folder_, folder_.string() + ".away");
}

void SoakCamera::write_pictures() const {
  fs::create_directories(folder_ / "data");
  for (int i = 0; i < kPictures; ++i) {
    std::ofstream(folder_ / "data" / (std::to_string(i) + ".pgm"))
        << "P5 64 64 255\n"
        << std::string(64UL * 64, static_cast<char>(i));
  }
  std::ofstream list(folder_ / "data.csv");
  for (std::int64_t i = 0; i < 20'000; ++i)  // longer than it is ever left alone
    list << i * 50'000'000 << ',' << i % kPictures << ".pgm\n";
}

CameraConfig SoakCamera::config() const {
  CameraConfig camera;
  camera.calibration.name = "cam0";
  const int size = is_gige_ ? 256 : 64;
  camera.calibration.intrinsics = {-0.17, 0.59, size / 4.0, size / 4.0, size / 2.0, size / 2.0};
  camera.calibration.resolution = {size, size};
  camera.calibration.rate_hz = is_gige_ ? 100.0 : 20.0;
  camera.device.driver = is_gige_ ? CameraDriver::kAravis : CameraDriver::kFolder;
  camera.device.folder = folder_ / "data";
  camera.device.id = GigeCamera::kAddress;
  camera.device.light.exposure_us = 500;
  camera.device.packet_size = 9000;
  return camera;
}

void SoakCamera::plug() {
  if (is_gige_) {
    gige_ = std::make_unique<GigeCamera>([grey = std::uint8_t{0}](
                                             const GigeCamera::Picture& picture) mutable {
      std::fill_n(picture.pixels, picture.size(), static_cast<std::uint8_t>(++grey % kPictures));
    });
  } else {
    fs::rename(folder_.string() + ".away", folder_);
  }
}

void SoakCamera::unplug() {
  if (is_gige_) {
    gige_.reset();
  } else {
    fs::rename(folder_, folder_.string() + ".away");
  }
}

Duration SoakCamera::between(double least_s, double most_s) {
  return from_seconds(std::uniform_real_distribution<>(least_s, most_s)(random_));
}

void SoakCamera::step(Timestamp now) {
  if (is_away_ && now >= next_change_) {
    plug();
    is_away_ = false;
    recovering_ = true;
    over_ = now;
  } else if (is_well() && now >= next_change_ && !is_calm_) {
    unplug();
    is_away_ = true;
    next_change_ = now + between(0.3, 2.5);
  }
}

std::optional<Duration> SoakCamera::heard(Timestamp now) {
  if (is_away_ || !recovering_) return std::nullopt;
  recovering_ = false;
  next_change_ = now + between(1.0, 3.0);
  return now - *over_;
}

std::optional<Duration> SoakCamera::waiting(Timestamp now) const {
  if (is_away_ || !recovering_) return std::nullopt;
  return now - *over_;
}

}  // namespace crepes
