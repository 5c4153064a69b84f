#include "daemon/ctl/replaceable.hpp"

#include <array>
#include <fstream>
#include <string>
#include <system_error>

namespace crepes {

Result<void> check_replaceable(const std::filesystem::path& file, std::string_view mark) {
  std::error_code status;
  if (!std::filesystem::is_regular_file(file, status)) return {};
  std::array<char, 512> beginning{};
  std::ifstream in(file, std::ios::binary);
  in.read(beginning.data(), beginning.size());
  const std::string_view text(beginning.data(), static_cast<std::size_t>(in.gcount()));
  const std::string_view first_line = text.substr(0, text.find('\n'));
  if (text.empty() || first_line.find(mark) != std::string_view::npos) return {};
  return fail(ErrorCode::kConfig, file.string() +
                                      ": exists, and is no earlier result of this command; --force "
                                      "replaces it");
}

}  // namespace crepes
