/// How a subcommand registers itself on the command line of crepesctl.
#pragma once

#include <CLI/CLI.hpp>
#include <any>
#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/live/progress_bar.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/dataset/dataset_faults.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The selected subcommand; it runs after all options have been read.
using Command = std::function<Result<void>()>;

class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) : app_(app) {}

  /// Adds a subcommand.
  CLI::App* add(const std::string& name, const std::string& help) {
    return app_.add_subcommand(name, help);
  }
  template <class Options>
  Options& make() {
    return std::any_cast<Options&>(kept_.emplace_back(Options{}));
  }
  /// Sets what `sub` does.
  void run(CLI::App* sub, const Command& command) {
    sub->callback([this, command] { command_ = command; });
  }

  [[nodiscard]] const CLI::App& app() const { return app_; }
  [[nodiscard]] Result<void> execute() const { return command_(); }

 private:
  CLI::App& app_;
  std::deque<std::any> kept_;
  Command command_;
};

/// An option whose value is one of the names of an enumeration.
template <class Enum, std::size_t N, class Set>
void add_choice(CLI::App* app, const std::string& flag, const std::array<Choice<Enum>, N>& choices,
                const Set& set, const std::string& help) {
  std::vector<std::string> names;
  names.reserve(N);
  for (const Choice<Enum>& choice : choices) names.emplace_back(choice.name);
  app->add_option_function<std::string>(
         flag,
         [choices, set](const std::string& name) {
           for (const Choice<Enum>& choice : choices)
             if (choice.name == name) set(choice.value);
         },
         help)
      ->check(CLI::IsMember(names));
}

/// Formats `--help` in lines of at most 100 columns. Subcommands that are added later inherit it.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> wrapped_help();

/// For all options of `app` and its subcommands, refuses NaN and infinity, which checks of a range
/// let pass, and whole numbers below zero or above 2^64 - 1, which would be taken for others. Where
/// a text is required, it refuses the empty one: a script's unset variable would name the working
/// directory.
void check_values(CLI::App& app);

/// Refuses numbers that are not above zero.
[[nodiscard]] CLI::Validator above_zero();

/// Refuses numbers that are no robot's id.
[[nodiscard]] CLI::Validator robot_name_or_id();

/// --address and --port of the daemon.
void add_daemon_options(CLI::App* sub, DaemonAddress& daemon);

/// --json, which means the same for all subcommands: see `daemon/ctl/json_line.hpp`. `which`
/// describes the objects.
void add_json_flag(CLI::App* sub, bool& json, const std::string& which = "one object");

/// Lists the first refused rows of a recording on standard error, and counts the others by reason.
void print_skipped(const DatasetFaults& faults);

/// Prints the text, or returns its error. A failure to write is an error, too.
[[nodiscard]] Result<void> print_result(const Result<std::string>& text);

/// --out and --force of a command that writes one file.
struct OutputFile {
  std::string name;  ///< empty: standard output
  bool force = false;
};
void add_output_options(CLI::App* sub, OutputFile& file);

/// Writes to the file; without --force it may only be replaced if `mark` is in its first line.
[[nodiscard]] Result<void> write_output(const std::string& text, const OutputFile& file,
                                        std::string_view mark);

/// A progress bar with the time left on standard error, if that is a terminal; its end removes it.
class TerminalProgress {
 public:
  TerminalProgress();
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;
  TerminalProgress(TerminalProgress&&) = delete;
  TerminalProgress& operator=(TerminalProgress&&) = delete;
  ~TerminalProgress();

  /// Shows the share that is done (0 to 1); empty if standard error is no terminal. Not to be
  /// called after the end of this object.
  [[nodiscard]] std::function<void(double)> sink() const;
  /// Removes the bar, so that a line can be printed in its place.
  void clear() const;

 private:
  bool is_terminal_;
  MonotonicClock clock_;
  ProgressBar bar_;
};

/// The subcommand that was misspelled on the command line, and the nearest one; empty if all are
/// known. `words` are the arguments.
[[nodiscard]] std::optional<std::string> unknown_subcommand(const CLI::App& app,
                                                            const std::vector<std::string>& words);

}  // namespace crepes
