#include "daemon/ctl/commands/command_line.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <system_error>
#include <utility>

#include "config/reading/spelling.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/live/screen_text.hpp"
#include "daemon/ctl/replaceable.hpp"
#include "drivers/base/number_text.hpp"
#include "drivers/dataset/part_file.hpp"

namespace crepes {
namespace {

constexpr int kBarColumns = 79;

/// What CLI11 makes has a line for each meaning, however long. Meanings begin in column 30.
class WrappedHelp final : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    std::istringstream lines(CLI::Formatter::make_help(app, std::move(name), mode));
    std::string text;
    for (std::string line; std::getline(lines, line);) text += wrapped_line(line) + '\n';
    return text;
  }

 private:
  static std::string wrapped_line(const std::string& line) {
    constexpr std::size_t kColumns = 100;
    constexpr std::size_t kMeaning = 30;
    if (columns_of(line) <= kColumns) return line;
    const bool has_meaning = line.compare(kMeaning - 2, 2, "  ") == 0;
    const std::size_t begin = has_meaning ? kMeaning : line.find_first_not_of(' ');
    return line.substr(0, begin) + wrapped(line.substr(begin), kColumns, begin, begin);
  }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> wrapped_help() { return std::make_shared<WrappedHelp>(); }

void check_values(CLI::App& app) {
  const CLI::Validator finite(
      [](const std::string& text) {
        double number = 0.0;
        const bool is_wrong = CLI::detail::lexical_cast(text, number) && !std::isfinite(number);
        return is_wrong ? text + " is no number" : std::string();
      },
      "");
  const CLI::Validator natural(
      [](const std::string& text) {
        std::uint64_t number = 0;
        const std::string_view wrong = parse_number(text, number);
        return wrong.empty() ? std::string() : fmt::format("{}: {}", text, wrong);
      },
      "");
  const CLI::Validator not_empty(
      [](const std::string& text) { return text.empty() ? std::string("names nothing") : ""; }, "");
  for (CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (type.starts_with("FLOAT")) option->check(finite);
    if (type.starts_with("UINT")) option->check(natural);
    if (type.starts_with("TEXT") && (option->get_required() || option->get_positional()))
      option->check(not_empty);
  }
  for (CLI::App* sub : app.get_subcommands({})) check_values(*sub);
}

CLI::Validator above_zero() {
  const auto refuse = [](const std::string& text) -> std::string {
    double number = 0.0;
    const bool is_good = parse_number(text, number).empty() && number > 0.0;
    return is_good ? "" : text + " is no number above 0";
  };
  return {refuse, "POSITIVE"};
}

CLI::Validator robot_name_or_id() {
  const auto refuse = [](const std::string& text) -> std::string {
    constexpr double kLastId = 65534.0;
    double id = 0.0;
    const bool is_wrong = parse_number(text, id).empty() && !(id >= 1.0 && id <= kLastId);
    return is_wrong ? text + " is no id of a robot, 1 to 65534" : "";
  };
  return {refuse, ""};
}

void add_daemon_options(CLI::App* sub, DaemonAddress& daemon) {
  sub->add_option("--address", daemon.address, "where the daemon serves poses")
      ->capture_default_str();
  sub->add_option("--port", daemon.port, "its UDP port")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
}

void add_json_flag(CLI::App* sub, bool& json, const std::string& which) {
  sub->add_flag("--json", json, "JSON on standard output instead of text: " + which);
}

void print_skipped(const DatasetFaults& faults) {
  constexpr std::size_t kListed = 20;
  const std::size_t listed = std::min(faults.list().size(), kListed);
  for (std::size_t i = 0; i < listed; ++i)
    std::fprintf(stderr, "skipped: %s\n", faults.list()[i].c_str());
  if (faults.total() == listed) return;
  std::string reasons;
  for (const auto& [reason, count] : faults.counts())
    reasons += fmt::format("{}{}: {}", reasons.empty() ? "" : ", ", reason, count);
  fmt::print(stderr, "skipped: {} rows in all ({})\n", faults.total(), reasons);
}

Result<void> print_result(const Result<std::string>& text) {
  if (!text) return tl::unexpected(text.error());
  if (print(*text)) return {};
  return fail(ErrorCode::kIo, "standard output: " + std::generic_category().message(errno));
}

void add_output_options(CLI::App* sub, OutputFile& file) {
  CLI::Option* out = sub->add_option("--out", file.name, "output file; default: standard output");
  sub->add_flag("--force", file.force, "replace a file that is no earlier result of this command")
      ->needs(out);
}

Result<void> write_output(const std::string& text, const OutputFile& file, std::string_view mark) {
  if (file.name.empty()) return print_result(text);
  if (!file.force)
    if (auto free = check_replaceable(file.name, mark); !free) return free;
  return replace_text_file(file.name, text);
}

TerminalProgress::TerminalProgress()
    : is_terminal_(::isatty(STDERR_FILENO) == 1), bar_(clock_.now()) {}

TerminalProgress::~TerminalProgress() { clear(); }

std::function<void(double)> TerminalProgress::sink() const {
  if (!is_terminal_) return {};
  return [this](double share) {
    std::fprintf(stderr, "\r%-*s\r", kBarColumns, bar_.text(share, clock_.now()).c_str());
  };
}

void TerminalProgress::clear() const {
  if (is_terminal_) std::fprintf(stderr, "\r%*s\r", kBarColumns, "");
}

std::optional<std::string> unknown_subcommand(const CLI::App& app,
                                              const std::vector<std::string>& words) {
  const CLI::App* level = &app;
  for (const std::string& word : words) {
    const std::vector<const CLI::App*> known = level->get_subcommands({});
    std::vector<std::string> names(known.size());
    std::ranges::transform(known, names.begin(),
                           [](const CLI::App* sub) { return sub->get_name(); });
    if (names.empty() || word.starts_with('-')) return std::nullopt;
    if (std::ranges::find(names, word) != names.end()) {
      level = level->get_subcommand(word);
      continue;
    }
    const auto nearest = nearest_spelling(word, names);
    const std::string whole = level == &app ? "" : level->get_name() + " ";
    return fmt::format("there is no '{}{}'{}", whole, word,
                       nearest ? fmt::format("; did you mean '{}{}'?", whole, *nearest) : "");
  }
  return std::nullopt;
}

}  // namespace crepes
