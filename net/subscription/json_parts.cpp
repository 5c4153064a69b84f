#include "net/subscription/json_parts.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace crepes {

std::string dump(const OrderedJson& json, int indent) {
  return json.dump(indent, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string truncated_utf8(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return std::string(text);
  std::size_t end = limit;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return std::string(text.substr(0, end));
}

double rounded_to_digits(double value, int digits) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double exponent = std::floor(std::log10(std::abs(value)));
  const double scale = std::pow(10.0, digits - 1 - exponent);
  const double result = std::round(value * scale) / scale;
  return std::isfinite(result) ? result : value;
}

void put(OrderedJson& object, const char* key, double value, int digits) {
  if (std::isfinite(value)) object[key] = rounded_to_digits(value, digits);
}

void put_vector(OrderedJson& object, const char* key, const Eigen::Vector3d& v) {
  if (!v.allFinite()) return;
  object[key] = {{"x", rounded_to_digits(v.x(), 7)},
                 {"y", rounded_to_digits(v.y(), 7)},
                 {"z", rounded_to_digits(v.z(), 7)}};
}

}  // namespace crepes
