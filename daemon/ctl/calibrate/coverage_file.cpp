#include "daemon/ctl/calibrate/coverage_file.hpp"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <system_error>

#include "drivers/base/text_file.hpp"
#include "drivers/dataset/part_file.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kMaxCoverageBytes = 8192;
constexpr std::chrono::seconds kMaxCoverageAge{5};  // it is written once a second

fs::path file_beside(const fs::path& socket) { return fs::path(socket) += ".coverage"; }

bool are_strings(const Json& list) {
  return list.is_array() && std::ranges::all_of(list, [](const Json& e) { return e.is_string(); });
}

bool is_coverage(const Json& json) {
  return json.is_object() && json.value("share", Json()).is_number() &&
         json.value("seen_s", Json()).is_number() && are_strings(json.value("cells", Json())) &&
         are_strings(json.value("missing", Json()));
}

}  // namespace

CoverageFile::CoverageFile(const fs::path& socket) : file_(file_beside(socket)) {}

CoverageFile::~CoverageFile() {
  std::error_code status;
  fs::remove(file_, status);
}

Result<void> CoverageFile::write(std::string_view json) const {
  return replace_text_file(file_, json);
}

std::optional<std::string> read_coverage(const fs::path& socket) {
  const fs::path file = file_beside(socket);
  std::error_code status;
  const auto written = fs::last_write_time(file, status);
  if (status || fs::file_time_type::clock::now() - written > kMaxCoverageAge) return std::nullopt;
  const auto text = read_text_file(file, kMaxCoverageBytes);
  if (!text) return std::nullopt;
  const Json json = Json::parse(*text, nullptr, /*allow_exceptions=*/false);
  return is_coverage(json) ? std::optional(dump(json)) : std::nullopt;
}

}  // namespace crepes
