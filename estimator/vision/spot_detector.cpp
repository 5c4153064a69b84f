#include "estimator/vision/spot_detector.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/contract.hpp"
#include "estimator/vision/spot_measure.hpp"

namespace crepes {
namespace {

constexpr int kMaxSide = 2048;
constexpr int kMaxSearches = 3;
constexpr std::size_t kMaxBlobs = 4096;  // the brightest are kept
constexpr std::size_t kUsualBlobs = 1024;
constexpr std::size_t kMaxHuge = 64;
constexpr double kLeastContrast = 0.5;  // of the threshold's: what rises less is no spot
constexpr int kNoContrastLeft = 230;    // a background as bright hides every spot

constexpr int kSaturated = 250;
constexpr double kTooMuchSaturated = 0.25;
constexpr int kTooBrightBackground = 192;

constexpr int kMaxHot = 4;       // px; hot pixels side by side
constexpr int kMaxMended = 100;  // px; the center of what is larger does not depend on them

constexpr double kRim = 1.25;       // of a ring's radius: what is nearer belongs to it
constexpr double kSmallRing = 5.0;  // px radius; the center of its light is surer than that of LEDs
constexpr double kSharpRing = 0.04;      // of its radius, the error of LEDs that stand apart
constexpr double kLedSigma = 0.1;        // px; the least, of the center of an LED
constexpr double kSmallRingShift = 0.3;  // of its radius; an arc's light is further away
constexpr double kOtherLight = 0.6;      // of its radius; light of another board is in its blob

double distance(double u, double v) { return std::sqrt(u * u + v * v); }

/// Of a whole ring. Each LED says as much of its size as of one of the axes.
RingEllipse ellipse_of(const Ring& ring) {
  const Eigen::Matrix2d squared = ring.view.axes * ring.view.axes.transpose();
  return {.leds = ring.leds,
          .uu_px2 = squared(0, 0),
          .uv_px2 = squared(0, 1),
          .vv_px2 = squared(1, 1),
          .sigma = std::max(ring.rms, kLedSigma) / ring.view.radius() * std::sqrt(2.0 / ring.leds)};
}

Exposure judge(const Detection& found, bool is_noise) {
  if (is_noise || found.background >= kTooBrightBackground ||
      found.saturated_share >= kTooMuchSaturated)
    return Exposure::kBright;
  const Rejected& r = found.rejected;
  const bool is_empty = found.spots.empty() && r.hot + r.huge + r.faint + r.surplus + r.cut == 0;
  return is_empty ? Exposure::kDark : Exposure::kGood;
}

}  // namespace

SpotDetector::SpotDetector(const VisionConfig& config)
    : config_(config),
      separator_(config.max_area_px2),
      mended_(config.max_area_px2),
      faint_(config.max_area_px2) {
  blobs_.reserve(kUsualBlobs);
  open_.reserve(kUsualBlobs);
  is_open_.reserve(kUsualBlobs);
  huge_.reserve(2 * kMaxHuge);
  of_ring_.reserve(kMaxRingLeds);
  candidates_.reserve(kUsualBlobs);
  spots_.reserve(kUsualBlobs);
}

Detection SpotDetector::detect(const GrayImage& image) {
  CREPES_EXPECT(image.pixels != nullptr && image.width > 0 && image.height > 0 &&
                    image.width <= kMaxSide && image.height <= kMaxSide &&
                    image.stride >= image.width,
                "an image of 1 to 2048 pixels a side");
  const BrightnessSample sample(image);
  const Background darkest = sample.darkest_from(0);
  faint_.clear();
  Detection found;
  found.background = darkest.median;
  found.threshold = config_.threshold > 0 ? config_.threshold : darkest.threshold;
  found.faint_threshold = config_.threshold > 0 ? config_.threshold : darkest.faint;
  found.saturated_share = sample.share_from(kSaturated);
  spots_.clear();
  bool is_noise = false;
  if (config_.detector == SpotDetectorKind::kHough) {
    if (const auto done = find_circles(image, found.threshold, config_, spots_); !done) {
      failure_ = done.error().message;
      found.failure = failure_;
    }
  } else {
    hot_pixels_.add_frame(image, found.faint_threshold);
    found.hot_pixels = hot_pixels_.known();
    is_noise = !search_levels(image, sample, found);
    select(image, found.rejected);
  }
  found.spots = spots_;
  found.exposure = judge(found, is_noise);
  return found;
}

/// Searches the picture, then what is huge and bright in it for spots that are brighter still.
/// False when there is nothing but noise.
bool SpotDetector::search_levels(const GrayImage& image, const BrightnessSample& sample,
                                 Detection& found) {
  candidates_.clear();
  huge_.assign(1, {0, 0, image.width - 1, image.height - 1});
  Background level{found.background, found.threshold, found.faint_threshold};
  for (int count = 1;; ++count) {
    const double contrast = kLeastContrast * (level.threshold - level.median);
    const bool is_complete = search(image, level, contrast, found.rejected);
    if (count == 1) faint_.remember(blobs_);
    if (is_complete && huge_.empty()) return true;
    const Background next = sample.darkest_from(level.threshold);
    if (count == kMaxSearches || config_.threshold > 0 || next.median >= kNoContrastLeft ||
        next.threshold <= level.threshold)
      return is_complete;
    level = next;
  }
}

/// Looks in the boxes of huge_ for spots and puts there what is huge at this threshold. False, and
/// nothing changed, when all is noise.
bool SpotDetector::search(const GrayImage& image, const Background& level, double contrast,
                          Rejected& rejected) {
  const int threshold = level.threshold;
  blobs_.clear();
  if (!finder_.find(image, {threshold, level.faint}, hot_pixels_.known(), config_.max_area_px2,
                    blobs_))
    return false;
  suspect_specks();
  faint_.find({.image = image,
               .level = level,
               .blobs = blobs_,
               .peaks = finder_.faint_peaks(),
               .area = area()},
              hot_pixels_, rejected);
  sort_out(image, threshold, contrast, rejected);
  const auto close = [&] {
    std::erase_if(open_, [&](std::uint32_t i) { return is_open_[i] == 0; });
  };
  for (const JoinedArcs& square : arc_joiner_.join_squares(blobs_, open_, finder_))
    take_arcs(image, threshold, square);
  close();
  lights_ = separator_.find(image, threshold, open_, blobs_, finder_);
  for (const Ring& ring : ring_finder_.find(lights_, image, threshold))
    if (!is_whole_blob(ring)) take_ring(image, threshold, ring);
  close();
  for (const JoinedArcs& arcs : arc_joiner_.join(blobs_, open_, finder_))
    take_arcs(image, threshold, arcs);
  close();
  fragment_joiner_.join(open_, blobs_, is_open_);
  measure_open(image, threshold);
  for (const FaintLight& light : faint_.lights())
    if (faint_.is_sure(light)) candidates_.push_back({light.spot, pixel_of(light.spot)});
  return true;
}

/// Pixels of a few may be hot.
void SpotDetector::suspect_specks() {
  for (std::size_t i = 0; i < blobs_.size() && hot_pixels_.has_room(); ++i) {
    if (blobs_[i].area <= kMaxHot)
      finder_.visit(i, blobs_[i].box, [&](int u, int v) { hot_pixels_.suspect(u, v); });
  }
}

void SpotDetector::measure_open(const GrayImage& image, int threshold) {
  for (const std::uint32_t i : open_) {
    if (is_open_[i] == 0) continue;
    const PixelBox& box = blobs_[i].box;
    if (box.longer_side() <= kMaxMended && hot_pixels_.is_in(box.grown(MendedSpot::kReach_px))) {
      if (const auto spot = mended_.measure(image, box, threshold, hot_pixels_))
        candidates_.push_back({*spot, box});
    } else {
      const Surroundings around = surroundings_of(image, box, threshold);
      candidates_.push_back({measure_spot(image, blobs_[i], threshold, around), box});
    }
  }
}

/// Leaves open what may be a board or a part of one.
void SpotDetector::sort_out(const GrayImage& image, int threshold, double contrast,
                            Rejected& rejected) {
  open_.clear();
  is_open_.assign(blobs_.size(), 0);
  const std::size_t first_huge = huge_.size();
  std::uint64_t huge = 0;
  for (std::uint32_t i = 0; i < blobs_.size(); ++i) {
    const Blob& blob = blobs_[i];
    if (blob.area > config_.max_area_px2) {
      ++huge;
      if (huge_.size() < first_huge + kMaxHuge) huge_.push_back(blob.box);
    } else if (area().has(blob.box)) {
      open_.push_back(i);
    }
  }
  rejected.huge = std::max(rejected.huge, huge);
  huge_.erase(huge_.begin(), huge_.begin() + static_cast<std::ptrdiff_t>(first_huge));
  if (open_.size() > kMaxBlobs) {
    std::nth_element(
        open_.begin(), open_.begin() + kMaxBlobs, open_.end(),
        [&](std::uint32_t a, std::uint32_t b) {
          return blobs_[a].weight != blobs_[b].weight ? blobs_[a].weight > blobs_[b].weight : a < b;
        });
    rejected.surplus += open_.size() - kMaxBlobs;
    open_.resize(kMaxBlobs);
    std::sort(open_.begin(), open_.end());
  }
  std::erase_if(open_, [&](std::uint32_t i) {
    const Blob& blob = blobs_[i];
    const Surroundings around = surroundings_of(image, blob.box, threshold);
    const bool is_faint = around.is_known && blob.peak - around.crest < contrast;
    const bool is_hot = blob.area == 1 && area_of(image, blob, threshold, around) == 1;
    rejected.faint += is_faint ? 1 : 0;
    rejected.hot += is_hot && !is_faint ? 1 : 0;
    return is_faint || is_hot;
  });
  for (const std::uint32_t i : open_) is_open_[i] = 1;
}

/// Whether it is an arc that is one blob, too round for that.
bool SpotDetector::is_whole_blob(const Ring& ring) const {
  constexpr double kLong = 1.4;  // half a ring is longer than wide
  const std::uint32_t blob = lights_[ring.lights[0]].blob;
  const auto members = ring.members();
  return !ring.is_whole() && blobs_[blob].elongation() < kLong &&
         std::all_of(members.begin(), members.end(),
                     [&](std::uint32_t light) { return lights_[light].blob == blob; });
}

/// Blobs of a ring, and what else is in it, are accounted for. Returns their sum.
Blob SpotDetector::take_blobs(std::span<const std::uint32_t> blobs, const RingView& view) {
  Blob whole;
  const auto take = [&](std::uint32_t i) {
    if (is_open_[i] == 0) return;
    is_open_[i] = 0;
    if (whole.area == 0) whole.box = blobs_[i].box;
    whole.absorb(blobs_[i]);
  };
  for (const std::uint32_t i : blobs) take(i);
  if (whole.area == 0) return whole;  // its blobs went into another ring
  for (const std::uint32_t i : open_)
    if (view.place_near({blobs_[i].mean_u(), blobs_[i].mean_v()}).norm() < kRim) take(i);
  return whole;
}

void SpotDetector::take_arcs(const GrayImage& image, int threshold, const JoinedArcs& arcs) {
  const Blob whole = take_blobs(arcs.members(), arcs.view);
  if (whole.area == 0) return;
  const Surroundings around = surroundings_of(image, whole.box, threshold);
  Spot spot = measure_spot(image, whole, threshold, around);
  spot.u_px = arcs.view.center.x();
  spot.v_px = arcs.view.center.y();
  candidates_.push_back({spot, whole.box});
}

void SpotDetector::take_ring(const GrayImage& image, int threshold, const Ring& ring) {
  of_ring_.clear();
  for (const std::uint32_t light : ring.members()) of_ring_.push_back(lights_[light].blob);
  const Blob whole = take_blobs(of_ring_, ring.view);
  if (whole.area == 0) return;
  const Surroundings around = surroundings_of(image, whole.box, threshold);
  Spot spot = measure_spot(image, whole, threshold, around);
  const Eigen::Vector2d& center = ring.view.center;
  const double radius = ring.view.radius();
  const double shift = distance(spot.u_px - center.x(), spot.v_px - center.y());
  const bool is_cut = shift > (ring.is_whole() ? kOtherLight : kSmallRingShift) * radius;
  const bool is_sharp = radius > kSmallRing && ring.rms < kSharpRing * radius;
  if (is_sharp || is_cut) {
    spot.u_px = center.x();
    spot.v_px = center.y();
  }
  if (is_sharp && ring.is_whole()) spot.ring = ellipse_of(ring);
  candidates_.push_back({spot, whole.box});
}

/// Candidates that are spots, brightest first.
void SpotDetector::select(const GrayImage& image, Rejected& rejected) {
  rejected.cut += std::erase_if(candidates_, [&](const SpotCandidate& candidate) {
    const PixelBox& box = candidate.box;
    return box.u_min <= 0 || box.v_min <= 0 || box.u_max >= image.width - 1 ||
           box.v_max >= image.height - 1;
  });
  const auto all = candidates_.size();
  std::erase_if(candidates_, [&](const SpotCandidate& candidate) {
    return candidate.spot.area_px2 < config_.min_area_px2;
  });
  rejected.hot += all - candidates_.size();
  std::sort(
      candidates_.begin(), candidates_.end(), [](const SpotCandidate& a, const SpotCandidate& b) {
        const double a_light = a.spot.peak * a.spot.area_px2;
        const double b_light = b.spot.peak * b.spot.area_px2;
        if (a_light != b_light) return a_light > b_light;
        return a.box.v_min != b.box.v_min ? a.box.v_min < b.box.v_min : a.box.u_min < b.box.u_min;
      });
  const auto most = static_cast<std::size_t>(config_.max_spots);
  if (candidates_.size() > most) {
    rejected.surplus += candidates_.size() - most;
    candidates_.resize(most);
  }
  for (const SpotCandidate& candidate : candidates_) spots_.push_back(candidate.spot);
}

}  // namespace crepes
