#include "drivers/uwb/nlink_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kNlinkStart = 0x55;
constexpr std::size_t kMostNodes = 255;

void append_bytes(std::vector<std::uint8_t>& out, std::uint32_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(static_cast<std::uint8_t>(value >> 8U * i & 0xffU));
  }
}

std::uint32_t power_code(double dbm) {
  return static_cast<std::uint32_t>(std::clamp(std::lround(-2.0 * dbm), 0L, 255L));
}

}  // namespace

std::vector<std::uint8_t> encode_node_frame3(std::uint8_t module, std::uint32_t system_time_ms,
                                             const std::vector<NlinkNode>& nodes) {
  constexpr std::uint8_t kRoleNode = 0;
  constexpr std::uint32_t kMillivolts = 4950;
  constexpr std::size_t kFixed = 21;
  constexpr std::size_t kPerNode = 7;
  CREPES_EXPECT(nodes.size() <= kMostNodes, "the number of nodes is one byte");
  std::vector<std::uint8_t> out{kNlinkStart, static_cast<std::uint8_t>(NlinkKind::kNodeFrame3)};
  append_bytes(out, static_cast<std::uint32_t>(kFixed + nodes.size() * kPerNode + 1), 2);
  append_bytes(out, kRoleNode, 1);
  append_bytes(out, module, 1);
  append_bytes(out, system_time_ms, 4);  // the module's own time
  append_bytes(out, system_time_ms, 4);  // the network's time
  append_bytes(out, 0, 4);
  append_bytes(out, kMillivolts, 2);
  append_bytes(out, static_cast<std::uint32_t>(nodes.size()), 1);
  for (const NlinkNode& node : nodes) {
    append_bytes(out, kRoleNode, 1);
    append_bytes(out, node.module, 1);
    append_bytes(out, static_cast<std::uint32_t>(std::lround(node.range_m * 1000.0)), 3);
    append_bytes(out, power_code(node.first_path_dbm), 1);
    append_bytes(out, power_code(node.received_dbm), 1);
  }
  out.push_back(byte_sum(out));
  return out;
}

}  // namespace crepes
