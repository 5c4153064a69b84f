#include "net/mesh/redundancy_filter.hpp"

#include <chrono>
#include <vector>

namespace crepes {
namespace {

/// Longer than the history in a message and than any reordering of packets.
constexpr Duration kMemory = std::chrono::seconds{2};

/// A second of a hundred robots at 50 Hz: more comes from nobody who keeps to the protocol.
constexpr std::size_t kMaxItems = 5000;

template <class Item, class Key, class KeyOf>
void keep_first_copies(std::vector<Item>& items, std::set<Key>& passed, std::int64_t forget_before,
                       KeyOf key_of) {
  std::erase_if(items, [&](const Item& item) { return !passed.insert(key_of(item)).second; });
  while (passed.size() > kMaxItems ||
         (!passed.empty() && std::get<0>(*passed.begin()) < forget_before))
    passed.erase(passed.begin());
}

}  // namespace

void RedundancyFilter::remove_repeated(PeerReport& report) {
  const std::int64_t forget_before = to_ns(report.stamp - kMemory);
  keep_first_copies(report.imu, imu_, forget_before,
                    [](const auto& sample) { return std::tuple{to_ns(sample.stamp)}; });
  keep_first_copies(report.bearings, bearings_, forget_before, [](const auto& bearing) {
    const Eigen::Vector3d& p = bearing.p_B_C;
    const Eigen::Vector3d& u = bearing.u_B;
    return BearingKey{
        to_ns(bearing.stamp), bearing.neighbor, {p.x(), p.y(), p.z(), u.x(), u.y(), u.z()}};
  });
  const auto stamp_and_neighbor = [](const auto& item) {
    return std::tuple{to_ns(item.stamp), item.neighbor};
  };
  keep_first_copies(report.ranges, ranges_, forget_before, stamp_and_neighbor);
  keep_first_copies(report.estimates, estimates_, forget_before, stamp_and_neighbor);
}

}  // namespace crepes
