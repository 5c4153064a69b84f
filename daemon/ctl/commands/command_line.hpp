/// How a subcommand puts itself on crepesctl's command line.
#pragma once

#include <CLI/CLI.hpp>
#include <any>
#include <array>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "daemon/ctl/daemon_client.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// What was asked for; runs after all options have been read.
using Command = std::function<Result<void>()>;

class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) : app_(app) {}

  /// A subcommand, and options that live as long as this.
  CLI::App* add(const std::string& name, const std::string& help) {
    return app_.add_subcommand(name, help);
  }
  template <class Options>
  Options& keep() {
    return std::any_cast<Options&>(kept_.emplace_back(Options{}));
  }
  /// What `sub` does.
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

/// An option that takes one of the names of an enumeration.
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

/// --address and --port of the daemon that is asked.
void add_daemon_options(CLI::App* sub, DaemonAddress& daemon);

/// --json, which means the same everywhere: `daemon/ctl/json_line.hpp`. `which` says what objects.
void add_json_flag(CLI::App* sub, bool& json, const std::string& which = "one object");

/// Prints the text, or hands the error on; an error also when nobody takes the text.
[[nodiscard]] Result<void> print_result(const Result<std::string>& text);

/// To a file, or to standard output where none is named.
[[nodiscard]] Result<void> deliver(const std::string& text, const std::string& file);

/// Shows a share from 0 to 1 on standard error; empty if that is not a terminal.
[[nodiscard]] std::function<void(double)> progress_on_terminal();

}  // namespace crepes
