#include "daemon/ctl/json_line.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace crepes {

using Json = nlohmann::ordered_json;

std::string json_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void put_finite(Json& object, const char* key, double value) {
  if (std::isfinite(value)) object[key] = value;
}

}  // namespace crepes
