/// Where the fields of NLink's frames are.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "drivers/uwb/nlink_frame.hpp"

namespace crepes {

/// A kind with nodes: a fixed part that ends with the number of nodes, the nodes, a checksum.
/// Offsets are from the frame, or from the node where the name says so; 0: the kind has no such
/// field.
struct NlinkLayout {
  NlinkKind kind;
  std::string_view name;
  std::size_t id = 5;          ///< of the module
  std::size_t id_size = 1;     ///< of module ids
  std::size_t role = 4;        ///< of the module
  bool has_node_roles = true;  ///< before the nodes' ids
  std::size_t local_time = 0;
  std::size_t system_time = 0;
  std::size_t voltage = 0;
  std::size_t count = 0;
  std::size_t node_size = 0;  ///< with user data: of what precedes them
  std::size_t node_id = 1;
  std::size_t node_range = 0;
  std::size_t node_powers = 0;
  std::size_t node_time = 0;
  std::size_t node_angle = 0;
  std::size_t node_position = 0;
  std::size_t node_user_data = 0;       ///< their number
  std::size_t node_user_data_size = 2;  ///< of that number
  std::size_t node_user_data_unit = 1;  ///< bytes each

  [[nodiscard]] std::size_t first_node() const { return count + 1; }
};

/// All kinds with nodes.
inline constexpr std::array kNlinkLayouts{
    NlinkLayout{.kind = NlinkKind::kNodeFrame0,
                .name = "NodeFrame0",
                .count = 10,
                .node_size = 4,
                .node_user_data = 2},
    NlinkLayout{.kind = NlinkKind::kNodeFrame1,
                .name = "NodeFrame1",
                .local_time = 10,
                .system_time = 6,
                .voltage = 24,
                .count = 26,
                .node_size = 20,
                .node_position = 2},
    NlinkLayout{.kind = NlinkKind::kNodeFrame2,
                .name = "NodeFrame2",
                .local_time = 102,
                .system_time = 6,
                .voltage = 116,
                .count = 118,
                .node_size = 13,
                .node_range = 2,
                .node_powers = 5,
                .node_time = 7},
    NlinkLayout{.kind = NlinkKind::kNodeFrame3,
                .name = "NodeFrame3",
                .local_time = 6,
                .system_time = 10,
                .voltage = 18,
                .count = 20,
                .node_size = 7,
                .node_range = 2,
                .node_powers = 5},
    NlinkLayout{.kind = NlinkKind::kNodeFrame4,
                .name = "NodeFrame4",
                .has_node_roles = false,
                .local_time = 10,
                .system_time = 6,
                .voltage = 18,
                .count = 20,
                .node_size = 5,
                .node_id = 0,
                .node_user_data = 4,
                .node_user_data_size = 1,
                .node_user_data_unit = 4},
    NlinkLayout{.kind = NlinkKind::kAoaNodeFrame0,
                .name = "AOA NodeFrame0",
                .local_time = 6,
                .system_time = 10,
                .voltage = 18,
                .count = 20,
                .node_size = 11,
                .node_range = 2,
                .node_powers = 7,
                .node_angle = 5},
    NlinkLayout{.kind = NlinkKind::kNodeFrame5,
                .name = "NodeFrame5",
                .id_size = 4,
                .local_time = 9,
                .system_time = 13,
                .voltage = 21,
                .count = 23,
                .node_size = 10,
                .node_range = 5,
                .node_powers = 8},
    NlinkLayout{.kind = NlinkKind::kNodeFrame6,
                .name = "NodeFrame6",
                .id_size = 4,
                .count = 13,
                .node_size = 7,
                .node_user_data = 5},
    // As in nlink_unpack/nlink_iot_frame0.c of github.com/nooploop-dev/nlink_parser; no recording.
    NlinkLayout{.kind = NlinkKind::kIotFrame0,
                .name = "IoT Frame0",
                .id = 4,
                .id_size = 4,
                .role = 0,
                .has_node_roles = false,
                .count = 13,
                .node_size = 14,
                .node_id = 0,
                .node_range = 4,
                .node_powers = 11,
                .node_user_data = 13,
                .node_user_data_size = 1},
};

}  // namespace crepes
