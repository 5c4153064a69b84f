#include "estimator/vision/faint_light_memory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "estimator/vision/spot_measure.hpp"

namespace crepes {
namespace {

constexpr std::size_t kUsualFaint = 1024;
constexpr std::size_t kMaxBlobsBeside = 4096;  // among more, a faint light is noise
constexpr int kFaintReach = 6;                 // px; what is nearer to a light is of its flanks
constexpr double kWorthALook = 6.5;  // of the filter, against a pixel from the faint threshold on
constexpr int kMaxFaintReach = 5;    // px; so far a board may have moved since
// Scores of a place, in pictures: a board is lit in half of them or more, noise in a few of 100.
constexpr int kNewFaint = 8;
constexpr int kFaintGain = 4;
constexpr int kKnownFaint = 14;
constexpr int kMostFaint = 32;
constexpr double kFaintAtOnce = 7.5;  // sigmas, of a light that counts in its first picture
constexpr double kFaintAgain = 4.3;   // sigmas, of a light where one was
constexpr double kFaintKnown = 3.5;   // sigmas, where one was often
constexpr std::size_t kMaxFaintPeaks = 256;
constexpr std::size_t kMaxFaintLights = 64;  // more are texture

double pixels_between(double u, double v) { return std::sqrt(u * u + v * v); }

}  // namespace

FaintLightMemory::FaintLightMemory(double max_area_px2) : max_area_px2_(max_area_px2) {
  lights_.reserve(kUsualFaint);
  places_.reserve(kUsualFaint);
}

void FaintLightMemory::find(const Scene& scene, HotPixelMap& hot_pixels, Rejected& rejected) {
  lights_.clear();
  if (scene.blobs.size() > kMaxBlobsBeside) return;
  const Background& level = scene.level;
  FaintSearch anywhere;
  anywhere.least_light =
      16 * level.median + static_cast<int>(kWorthALook * (level.faint - level.median));
  for (const FaintPeak& peak : scene.peaks) add(scene, peak, anywhere, hot_pixels, rejected);
  for (const Place& place : places_) {
    FaintSearch again;
    again.reach = std::min(place.age + 1, kMaxFaintReach);
    again.significance = place.score < kKnownFaint ? kFaintAgain : kFaintKnown;
    add(scene, {place.u, place.v}, again, hot_pixels, rejected);
  }
  std::sort(lights_.begin(), lights_.end(), [](const FaintLight& a, const FaintLight& b) {
    if (a.significance != b.significance) return a.significance > b.significance;
    return a.spot.v_px != b.spot.v_px ? a.spot.v_px < b.spot.v_px : a.spot.u_px < b.spot.u_px;
  });
  if (lights_.size() <= kMaxFaintPeaks) thin_out(scene.blobs);
  if (lights_.size() > kMaxFaintLights) {
    rejected.faint += lights_.size();
    lights_.clear();
  }
}

void FaintLightMemory::add(const Scene& scene, const FaintPeak& at, const FaintSearch& search,
                           HotPixelMap& hot_pixels, Rejected& rejected) {
  const PixelBox box{at.u, at.v, at.u, at.v};
  if (!scene.area.has(box) || hot_pixels.is_in(box)) return;
  const auto light = find_faint_light(scene.image, at.u, at.v, search);
  if (!light) return;
  const PixelBox found = pixel_of(light->spot);
  hot_pixels.suspect(found.u_min, found.v_min);
  if (light->is_hot) {
    ++rejected.hot;
  } else {
    lights_.push_back(*light);
  }
}

/// Keeps those with neither a blob nor a more significant one near them.
void FaintLightMemory::thin_out(std::span<const Blob> blobs) {
  std::size_t kept = 0;
  for (const FaintLight& light : lights_) {
    const auto is_same = [&](const FaintLight& other) {
      return pixels_between(other.spot.u_px - light.spot.u_px, other.spot.v_px - light.spot.v_px) <
             kFaintReach;
    };
    const auto end = lights_.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::none_of(lights_.begin(), end, is_same) && !is_near_blob(light.spot, blobs))
      lights_[kept++] = light;
  }
  lights_.resize(kept);
}

void FaintLightMemory::remember(std::span<const Blob> blobs) {
  const std::size_t before = places_.size();
  for (Place& place : places_) {
    ++place.age;
    --place.score;
  }
  for (const FaintLight& light : lights_) {
    const PixelBox box = pixel_of(light.spot);
    Place now{box.u_min, box.v_min, 0, kNewFaint};
    for (std::size_t i = 0; i < before; ++i) {
      Place& place = places_[i];
      if (pixels_between(place.u - now.u, place.v - now.v) > kFaintReach) continue;
      now.score = std::clamp(place.score + kFaintGain, now.score, kMostFaint);
      place.score = 0;
    }
    if (places_.size() < before + kMaxFaintLights) places_.push_back(now);
  }
  std::erase_if(places_, [&](const Place& place) {
    return place.score <= 0 ||
           is_near_blob({.u_px = double(place.u), .v_px = double(place.v)}, blobs);
  });
}

bool FaintLightMemory::is_sure(const FaintLight& light) const {
  return light.significance >= kFaintAtOnce ||
         std::any_of(places_.begin(), places_.end(), [&](const Place& place) {
           return pixels_between(light.spot.u_px - place.u, light.spot.v_px - place.v) <=
                  kFaintReach;
         });
}

bool FaintLightMemory::is_near_blob(const Spot& spot, std::span<const Blob> blobs) const {
  const PixelBox near = pixel_of(spot).grown(kFaintReach);
  return std::any_of(blobs.begin(), blobs.end(), [&](const Blob& blob) {
    return blob.area <= max_area_px2_ && blob.box.overlaps(near);
  });
}

}  // namespace crepes
