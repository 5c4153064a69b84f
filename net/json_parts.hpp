/// What the answers of the subscription are made of. For the files that write them alone.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace crepes {

using OrderedJson = nlohmann::ordered_json;

inline constexpr std::size_t kMaxText = 160;  ///< bytes of a message
inline constexpr std::size_t kMaxName = 32;

/// Never throws: invalid UTF-8 is replaced.
[[nodiscard]] std::string dump(const OrderedJson& json);

/// At most `limit` bytes of `text`, cut between characters.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t limit);

/// Rounded to so many significant digits, so that it prints short.
[[nodiscard]] double rounded(double value, int digits);

/// Unknown values are left out.
void put(OrderedJson& object, const char* key, double value, int digits = 7);
void put_vector(OrderedJson& object, const char* key, const Eigen::Vector3d& v);

}  // namespace crepes
