#include "daemon/ctl/json_line.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "net/subscription/json_parts.hpp"

namespace crepes {

using Json = nlohmann::ordered_json;

std::string json_line(const Json& json) { return dump(json) + "\n"; }

void put_finite(Json& object, const char* key, double value) {
  if (std::isfinite(value)) object[key] = value;
}

}  // namespace crepes
