#include <fmt/core.h>

#include <set>
#include <sstream>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

/// The words that may follow a command, as in "--address --port --json".
std::string words_of(const CLI::App& app) {
  std::string words;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) words += " --" + name;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    words += " " + sub->get_name();
  return words.empty() ? words : words.substr(1);
}

/// Writes one case for a command and for each command below it. `path` is the list of commands
/// above.
void write_cases(const CLI::App& app, const std::string& path, std::ostream& out) {
  out << "    \"" << path << "\") words=\"" << words_of(app) << "\" ;;\n";
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    write_cases(*sub, path.empty() ? sub->get_name() : fmt::format("{} {}", path, sub->get_name()),
                out);
  }
}

/// Collects the commands of all levels.
void collect_names(const CLI::App& app, std::set<std::string>& names) {
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.insert(sub->get_name());
    collect_names(*sub, names);
  }
}

/// Options and commands of every level; after an option that takes a value, and where nothing
/// else fits, file names.
std::string bash_completion(const CLI::App& app) {
  std::set<std::string> names;
  collect_names(app, names);
  std::string pattern;
  for (const std::string& name : names) pattern += (pattern.empty() ? "" : "|") + name;
  std::ostringstream out;
  out << "# bash completion of crepesctl, made by `crepesctl completion bash`\n"
         "_crepesctl() {\n"
         "  local word=\"${COMP_WORDS[COMP_CWORD]}\" path=\"\" words=\"\" i\n"
         "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
         "    case \"${COMP_WORDS[i]}\" in\n"
         "    "
      << pattern
      << ") path=\"${path:+$path }${COMP_WORDS[i]}\" ;;\n"
         "    esac\n"
         "  done\n"
         "  case \"$path\" in\n";
  write_cases(app, "", out);
  out << "  esac\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
         "  [ \"${#COMPREPLY[@]}\" -gt 0 ] || COMPREPLY=($(compgen -f -- \"$word\"))\n"
         "}\n"
         "complete -o filenames -F _crepesctl crepesctl\n";
  return out.str();
}

}  // namespace

void add_completion(CommandLine& line) {
  auto& shell = line.make<std::string>();
  CLI::App* sub = line.add("completion",
                           "Print a shell script that completes crepesctl's commands and options");
  sub->add_option("SHELL", shell, "bash")->required()->check(CLI::IsMember({"bash"}));
  line.run(sub, [&line] { return print_result(bash_completion(line.app())); });
}

}  // namespace crepes
