#include "estimator/vision/spot_detector.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/contract.hpp"

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

constexpr int kMaxGap = 3;               // px between the LEDs of one board that is far away
constexpr double kMaxElongation = 2.45;  // of a board in fragments; two side by side are longer
constexpr int kMaxSpeck = 7;        // px; pieces of so little are one board, whatever its shape
constexpr int kMaxFragmented = 28;  // px; on a larger board every LED stands alone
constexpr int kSplitMinSide = 6;    // px; smaller blobs show no ring
constexpr int kSplitMaxSide = 100;  // px; LEDs of larger rings do not touch

constexpr int kMaxHot = 4;           // px; hot pixels side by side
constexpr int kHotReach = 3;         // px; so far away they matter to a center
constexpr int kFaintReach = 6;       // px; what is nearer to a light is of its flanks
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

constexpr double kRim = 1.25;       // of a ring's radius: what is nearer belongs to it
constexpr double kSmallRing = 5.0;  // px radius; the center of its light is surer than that of LEDs
constexpr double kSharpRing = 0.04;      // of its radius, the error of LEDs that stand apart
constexpr double kSmallRingShift = 0.3;  // of its radius; an arc's light is further away
constexpr double kOtherLight = 0.6;      // of its radius; light of another board is in its blob

int longer_side(const PixelBox& box) { return std::max(box.width(), box.height()); }
int shorter_side(const PixelBox& box) { return std::min(box.width(), box.height()); }

PixelBox grown(const PixelBox& box, int by) {
  return {box.u_min - by, box.v_min - by, box.u_max + by, box.v_max + by};
}

/// Of a light of one pixel.
PixelBox box_of(const Spot& spot) {
  const auto u = static_cast<int>(std::lround(spot.u_px));
  const auto v = static_cast<int>(std::lround(spot.v_px));
  return {u, v, u, v};
}

double distance(double u, double v) { return std::sqrt(u * u + v * v); }

Light light_of(const Blob& blob, std::uint32_t index) {
  return {blob.mean_u(), blob.mean_v(), blob.area, blob.peak, index};
}

Exposure judge(const Detection& found, bool is_noise) {
  if (is_noise || found.background >= kTooBrightBackground ||
      found.saturated_share >= kTooMuchSaturated)
    return Exposure::kBright;
  const Rejected& r = found.rejected;
  const bool is_empty = found.spots.empty() && r.hot + r.huge + r.faint + r.surplus == 0;
  return is_empty ? Exposure::kDark : Exposure::kGood;
}

}  // namespace

Rejected& Rejected::operator+=(const Rejected& other) {
  hot += other.hot;
  huge += other.huge;
  faint += other.faint;
  surplus += other.surplus;
  return *this;
}

SpotDetector::SpotDetector(const VisionConfig& config) : config_(config) {
  blobs_.reserve(kUsualBlobs);
  open_.reserve(kUsualBlobs);
  is_open_.reserve(kUsualBlobs);
  huge_.reserve(2 * kMaxHuge);
  lights_.reserve(kUsualBlobs);
  cores_.reserve(kUsualBlobs);
  of_ring_.reserve(kMaxRingLeds);
  parent_.reserve(kUsualBlobs);
  groups_.reserve(kUsualBlobs);
  candidates_.reserve(kUsualBlobs);
  faint_.reserve(kUsualBlobs);
  faint_places_.reserve(kUsualBlobs);
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
    select(found.rejected);
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
    if (count == 1) remember_faint();
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
  find_faint(image, level, rejected);
  sort_out(image, threshold, contrast, rejected);
  const auto close = [&] {
    std::erase_if(open_, [&](std::uint32_t i) { return is_open_[i] == 0; });
  };
  for (const JoinedArcs& square : arc_joiner_.join_squares(blobs_, open_, finder_))
    take_arcs(image, threshold, square);
  close();
  find_lights(image, threshold);
  for (const Ring& ring : ring_finder_.find(lights_, image, threshold))
    if (!is_whole_blob(ring)) take_ring(image, threshold, ring);
  close();
  for (const JoinedArcs& arcs : arc_joiner_.join(blobs_, open_, finder_))
    take_arcs(image, threshold, arcs);
  close();
  join_fragments();
  measure_open(image, threshold);
  for (const FaintLight& light : faint_) {
    const bool was_there =
        std::any_of(faint_places_.begin(), faint_places_.end(), [&](const FaintPlace& place) {
          return distance(light.spot.u_px - place.u, light.spot.v_px - place.v) <= kFaintReach;
        });
    if (was_there || light.significance >= kFaintAtOnce)
      candidates_.push_back({light.spot, box_of(light.spot)});
  }
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
    if (longer_side(box) <= kSplitMaxSide && hot_pixels_.is_in(grown(box, kHotReach))) {
      if (const auto spot = measure_mended(image, box, threshold))
        candidates_.push_back({*spot, box});
    } else {
      const Surroundings around = surroundings_of(image, box, threshold);
      candidates_.push_back({measure_spot(image, blobs_[i], threshold, around), box});
    }
  }
}

/// The spot in the box without the hot pixels in it; empty if it is nothing without them.
std::optional<Spot> SpotDetector::measure_mended(const GrayImage& image, const PixelBox& box,
                                                 int threshold) {
  const PixelBox wide = grown(box, 2 * kHotReach);
  const PixelBox around{std::max(0, wide.u_min), std::max(0, wide.v_min),
                        std::min(image.width - 1, wide.u_max),
                        std::min(image.height - 1, wide.v_max)};
  patch_.clear();
  for (int v = around.v_min; v <= around.v_max; ++v)
    patch_.insert(patch_.end(), image.row(v) + around.u_min, image.row(v) + around.u_max + 1);
  for (const MendedPixel& pixel : hot_pixels_.in_rows_of(around)) {
    if (around.u_min <= pixel.u && pixel.u <= around.u_max) {
      patch_[static_cast<std::size_t>((pixel.v - around.v_min) * around.width() + pixel.u -
                                      around.u_min)] = pixel.level;
    }
  }
  const GrayImage patch{patch_.data(), around.width(), around.height(), around.width()};
  const PixelBox inside{box.u_min - around.u_min, box.v_min - around.v_min,
                        box.u_max - around.u_min, box.v_max - around.v_min};
  cores_.clear();
  if (!splitter_.find(patch, threshold, config_.max_area_px2, cores_)) return std::nullopt;
  std::erase_if(cores_, [&](const Blob& core) { return !core.box.overlaps(inside); });
  if (cores_.empty()) return std::nullopt;
  for (std::size_t i = 1; i < cores_.size(); ++i) cores_[0].absorb(cores_[i]);
  const Surroundings near = surroundings_of(patch, cores_[0].box, threshold);
  Spot spot = measure_spot(patch, cores_[0], threshold, near);
  spot.u_px += around.u_min;
  spot.v_px += around.v_min;
  return spot;
}

/// Lights between blobs that noise does not explain. So many that they are texture are none.
void SpotDetector::find_faint(const GrayImage& image, const Background& level, Rejected& rejected) {
  faint_.clear();
  if (blobs_.size() > kMaxBlobs) return;
  FaintSearch anywhere;
  anywhere.least_light =
      16 * level.median + static_cast<int>(kWorthALook * (level.faint - level.median));
  for (const FaintPeak& peak : finder_.faint_peaks())
    add_faint(image, peak.u, peak.v, anywhere, rejected);
  for (const FaintPlace& place : faint_places_) {
    FaintSearch again;
    again.reach = std::min(place.age + 1, kMaxFaintReach);
    again.significance = place.score < kKnownFaint ? kFaintAgain : kFaintKnown;
    add_faint(image, place.u, place.v, again, rejected);
  }
  std::sort(faint_.begin(), faint_.end(), [](const FaintLight& a, const FaintLight& b) {
    if (a.significance != b.significance) return a.significance > b.significance;
    return a.spot.v_px != b.spot.v_px ? a.spot.v_px < b.spot.v_px : a.spot.u_px < b.spot.u_px;
  });
  if (faint_.size() <= kMaxFaintPeaks) thin_out_faint();
  if (faint_.size() > kMaxFaintLights) {
    rejected.faint += faint_.size();
    faint_.clear();
  }
}

void SpotDetector::add_faint(const GrayImage& image, int u, int v, const FaintSearch& search,
                             Rejected& rejected) {
  const PixelBox box{u, v, u, v};
  if (!is_news(box) || hot_pixels_.is_in(box)) return;
  const auto light = find_faint_light(image, u, v, search);
  if (!light) return;
  const PixelBox found = box_of(light->spot);
  hot_pixels_.suspect(found.u_min, found.v_min);
  if (light->is_hot) {
    ++rejected.hot;
  } else {
    faint_.push_back(*light);
  }
}

/// Keeps those with neither a blob nor a more significant one near them.
void SpotDetector::thin_out_faint() {
  std::size_t kept = 0;
  for (const FaintLight& light : faint_) {
    const auto is_same = [&](const FaintLight& other) {
      return distance(other.spot.u_px - light.spot.u_px, other.spot.v_px - light.spot.v_px) <
             kFaintReach;
    };
    const auto end = faint_.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::none_of(faint_.begin(), end, is_same) && !is_near_blob(light.spot))
      faint_[kept++] = light;
  }
  faint_.resize(kept);
}

/// A board is found again where it was with less significance: there are fewer places to err.
void SpotDetector::remember_faint() {
  const std::size_t before = faint_places_.size();
  for (FaintPlace& place : faint_places_) {
    ++place.age;
    --place.score;
  }
  for (const FaintLight& light : faint_) {
    const PixelBox box = box_of(light.spot);
    FaintPlace now{box.u_min, box.v_min, 0, kNewFaint};
    for (std::size_t i = 0; i < before; ++i) {
      FaintPlace& place = faint_places_[i];
      if (distance(place.u - now.u, place.v - now.v) > kFaintReach) continue;
      now.score = std::clamp(place.score + kFaintGain, now.score, kMostFaint);
      place.score = 0;
    }
    if (faint_places_.size() < before + kMaxFaintLights) faint_places_.push_back(now);
  }
  std::erase_if(faint_places_, [&](const FaintPlace& place) {
    return place.score <= 0 || is_near_blob({.u_px = double(place.u), .v_px = double(place.v)});
  });
}

bool SpotDetector::is_near_blob(const Spot& spot) const {
  const PixelBox near = grown(box_of(spot), kFaintReach);
  return std::any_of(blobs_.begin(), blobs_.end(), [&](const Blob& blob) {
    return blob.area <= config_.max_area_px2 && blob.box.overlaps(near);
  });
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
    } else if (is_news(blob.box)) {
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

/// Whether it lies in what is searched, apart from the spots that are known.
bool SpotDetector::is_news(const PixelBox& box) const {
  const auto overlaps = [&](const PixelBox& other) { return other.overlaps(box); };
  return std::any_of(huge_.begin(), huge_.end(), overlaps) &&
         std::none_of(candidates_.begin(), candidates_.end(),
                      [&](const Candidate& known) { return known.box.overlaps(box); });
}

void SpotDetector::find_lights(const GrayImage& image, int threshold) {
  lights_.clear();
  for (const std::uint32_t i : open_) {
    const Blob& blob = blobs_[i];
    if (shorter_side(blob.box) >= kSplitMinSide && longer_side(blob.box) <= kSplitMaxSide) {
      split(image, i, threshold);
    } else if (blob.area > 1) {
      lights_.push_back(light_of(blob, i));
    }
  }
}

/// LEDs whose flanks touch are apart at a higher level.
void SpotDetector::split(const GrayImage& image, std::uint32_t index, int threshold) {
  constexpr int kLevels = 3;
  const PixelBox& box = blobs_[index].box;
  const GrayImage patch{image.row(box.v_min) + box.u_min, box.width(), box.height(), image.stride};
  const std::size_t first = lights_.size();
  lights_.push_back(light_of(blobs_[index], index));
  for (int k = 1; k <= kLevels; ++k) {
    const int level = threshold + (kSaturated - threshold) * k / kLevels;
    cores_.clear();
    if (level <= threshold || !splitter_.find(patch, level, config_.max_area_px2, cores_)) continue;
    const std::size_t before = lights_.size();
    for (const Blob& core : cores_) {
      Light light = light_of(core, index);
      light.u += box.u_min;
      light.v += box.v_min;
      const auto owner = finder_.blob_at(static_cast<int>(std::lround(light.u)),
                                         static_cast<int>(std::lround(light.v)));
      if (owner == index) lights_.push_back(light);
    }
    // The level that shows most lights counts; a blob in one piece stays one light.
    const std::size_t shown = lights_.size() - before;
    if (shown > before - first) {
      lights_.erase(lights_.begin() + static_cast<std::ptrdiff_t>(first),
                    lights_.begin() + static_cast<std::ptrdiff_t>(before));
    } else {
      lights_.resize(before);
    }
  }
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
  candidates_.push_back({spot, whole.box});
}

std::uint32_t SpotDetector::group_of(std::uint32_t place) {
  while (parent_[place] != place) place = parent_[place] = parent_[parent_[place]];
  return place;
}

/// A board some meters away shows a few pieces with dark pixels between them. Pieces that make up
/// something as round as a board become one blob, at the place of the first.
void SpotDetector::join_fragments() {
  const auto count = static_cast<std::uint32_t>(open_.size());
  parent_.resize(count);
  groups_.resize(count);
  for (std::uint32_t a = 0; a < count; ++a) parent_[a] = a;
  for (std::uint32_t a = 0; a < count; ++a) {
    const PixelBox near = grown(blobs_[open_[a]].box, kMaxGap + 1);
    for (std::uint32_t b = a + 1; b < count && blobs_[open_[b]].box.v_min <= near.v_max; ++b) {
      if (!near.overlaps(blobs_[open_[b]].box)) continue;
      const std::uint32_t x = group_of(a);
      const std::uint32_t y = group_of(b);
      parent_[std::max(x, y)] = std::min(x, y);
    }
  }
  for (std::uint32_t a = 0; a < count; ++a) {
    const std::uint32_t root = group_of(a);  // comes before the others of its group
    if (root == a) {
      groups_[a] = blobs_[open_[a]];
    } else {
      groups_[root].absorb(blobs_[open_[a]]);
    }
  }
  for (std::uint32_t a = 0; a < count; ++a) {
    const std::uint32_t root = group_of(a);
    const Blob& group = groups_[root];
    const int side = longer_side(group.box);
    if (side > kMaxFragmented || (side > kMaxSpeck && group.elongation() > kMaxElongation))
      continue;
    if (root == a) {
      blobs_[open_[a]] = group;
    } else {
      is_open_[open_[a]] = 0;
    }
  }
}

/// Candidates that are spots, brightest first.
void SpotDetector::select(Rejected& rejected) {
  const auto all = candidates_.size();
  std::erase_if(candidates_, [&](const Candidate& candidate) {
    return candidate.spot.area_px2 < config_.min_area_px2;
  });
  rejected.hot += all - candidates_.size();
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
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
  for (const Candidate& candidate : candidates_) spots_.push_back(candidate.spot);
}

}  // namespace crepes
