#include "daemon/ctl/demo/demo_page.hpp"

#include <fmt/core.h>

#include <string_view>
#include <utility>

#include "drivers/base/text_file.hpp"

namespace crepes {

Result<DemoPage> DemoPage::start(const std::filesystem::path& tool,
                                 const std::filesystem::path& dir, const std::string& listen,
                                 std::uint16_t first_port, const std::vector<std::string>& robots) {
  std::vector<std::string> arguments{"view", "--listen", listen, "--port",
                                     std::to_string(first_port)};
  for (std::size_t i = 0; i < robots.size(); ++i) {
    if (i > 0) {
      arguments.emplace_back("--also");
      arguments.push_back(fmt::format("127.0.0.1:{}", first_port + i));
    }
    arguments.emplace_back("--socket");
    arguments.push_back(socket_of(dir, robots[i]));
  }
  arguments.emplace_back("--config");
  arguments.push_back(dir / (robots.front() + ".yaml"));
  std::filesystem::path log = dir / "view.log";
  return ChildProcess::start(tool, arguments, log).map([&](ChildProcess&& process) {
    return DemoPage(std::move(process), std::move(log));
  });
}

Result<void> DemoPage::check() {
  const auto& reason = process_.exit_reason();
  if (!reason) return {};
  // The program says its name before each of its messages, and ours comes before this one.
  constexpr std::string_view kName = "crepesctl: ";
  std::string text = read_text_file(log_).value_or("");
  if (text.starts_with(kName)) text.erase(0, kName.size());
  text.erase(text.find_last_not_of('\n') + 1);
  return fail(ErrorCode::kIo, fmt::format("the page ended, {}: {}", *reason, text));
}

std::string DemoPage::url() const {
  const std::string text = read_text_file(log_).value_or("");
  return text.substr(0, text.find('\n'));
}

}  // namespace crepes
