/// Building blocks of JSON replies. Include only where messages are written.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace crepes {

using OrderedJson = nlohmann::ordered_json;

inline constexpr std::size_t kMaxText = 160;  ///< bytes of a message
inline constexpr std::size_t kMaxName = 32;

/// One line, or indented by `indent` spaces. Never throws: invalid UTF-8 is replaced.
[[nodiscard]] std::string dump(const OrderedJson& json, int indent = -1);

/// At most `limit` bytes of `text`; no character is cut.
[[nodiscard]] std::string truncated_utf8(std::string_view text, std::size_t limit);

/// Rounded to `digits` significant digits, for short output.
[[nodiscard]] double rounded_to_digits(double value, int digits);

/// Values that are not finite are omitted.
void put(OrderedJson& object, const char* key, double value, int digits = 7);
void put_vector(OrderedJson& object, const char* key, const Eigen::Vector3d& v);

}  // namespace crepes
