#include <fmt/format.h>

#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

/// A command with the commands that lead to it, as in "led set"; empty for crepesctl itself.
struct Place {
  std::string path;
  const CLI::App* app;
};

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

void collect_places(const CLI::App& app, const std::string& path, std::vector<Place>& places) {
  places.push_back({path, &app});
  for (const CLI::App* sub : commands_of(app)) {
    collect_places(*sub, path.empty() ? sub->get_name() : path + " " + sub->get_name(), places);
  }
}

std::vector<Place> places_of(const CLI::App& app) {
  std::vector<Place> places;
  collect_places(app, "", places);
  return places;
}

/// The commands of all levels, each once.
std::vector<std::string> names_in(const std::vector<Place>& places) {
  std::set<std::string> names;
  for (const Place& place : places)
    for (const CLI::App* sub : commands_of(*place.app)) names.insert(sub->get_name());
  return {names.begin(), names.end()};
}

/// A word that may follow a command: an option with its dashes, or a command.
struct Word {
  std::string text;
  std::string about;
  bool takes_value;
};

std::vector<Word> words_of(const CLI::App& app) {
  std::vector<Word> words;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames())
      words.push_back(
          {"--" + name, option->get_description(), option->get_items_expected_max() > 0});
  for (const CLI::App* sub : commands_of(app))
    words.push_back({sub->get_name(), sub->get_description(), false});
  return words;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

/// Options and commands of every level; after an option that takes a value, and where nothing
/// else fits, file names.
std::string bash_completion(const std::vector<Place>& places) {
  std::ostringstream out;
  out << "# bash completion of crepesctl, made by `crepesctl completion bash`\n"
         "_crepesctl() {\n"
         "  local word=\"${COMP_WORDS[COMP_CWORD]}\" path=\"\" words=\"\" i\n"
         "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
         "    case \"${COMP_WORDS[i]}\" in\n"
         "    "
      << fmt::format("{}", fmt::join(names_in(places), "|"))
      << ") path=\"${path:+$path }${COMP_WORDS[i]}\" ;;\n"
         "    esac\n"
         "  done\n"
         "  case \"$path\" in\n";
  for (const Place& place : places) {
    std::vector<std::string> words;
    for (const Word& word : words_of(*place.app)) words.push_back(word.text);
    out << fmt::format("    \"{}\") words=\"{}\" ;;\n", place.path, fmt::join(words, " "));
  }
  out << "  esac\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
         "  [ \"${#COMPREPLY[@]}\" -gt 0 ] || COMPREPLY=($(compgen -f -- \"$word\"))\n"
         "}\n"
         "complete -o filenames -F _crepesctl crepesctl\n";
  return out.str();
}

/// The same for zsh, with what each word means.
std::string zsh_completion(const std::vector<Place>& places) {
  std::ostringstream out;
  out << "#compdef crepesctl\n"
         "# zsh completion of crepesctl, made by `crepesctl completion zsh`\n"
         "_crepesctl() {\n"
         "  local place=\"\" i\n"
         "  local -a found\n"
         "  for ((i = 2; i < CURRENT; i++)); do\n"
         "    case \"${words[i]}\" in\n"
         "    "
      << fmt::format("{}", fmt::join(names_in(places), "|"))
      << ") place=\"${place:+$place }${words[i]}\" ;;\n"
         "    esac\n"
         "  done\n"
         "  case \"$place\" in\n";
  for (const Place& place : places) {
    out << fmt::format("    \"{}\") found=(", place.path);
    for (const Word& word : words_of(*place.app))
      out << fmt::format("\n      '{}:{}'", word.text, replaced(word.about, "'", "'\\''"));
    out << ") ;;\n";
  }
  out << "  esac\n"
         "  _describe 'command or option' found || _files\n"
         "}\n"
         "compdef _crepesctl crepesctl\n"
         "[[ $funcstack[1] != _crepesctl ]] || _crepesctl\n";  // zsh loads it when first needed
  return out.str();
}

/// The same for fish.
std::string fish_completion(const std::vector<Place>& places) {
  std::ostringstream out;
  out << "# fish completion of crepesctl, made by `crepesctl completion fish`\n"
         "function __crepesctl_at\n"
         "    set -l place\n"
         "    for word in (commandline -opc)[2..]\n"
         "        if contains -- $word "
      << fmt::format("{}", fmt::join(names_in(places), " "))
      << "\n"
         "            set -a place $word\n"
         "        end\n"
         "    end\n"
         "    test \"$place\" = \"$argv\"\n"
         "end\n";
  for (const Place& place : places) {
    const std::string at = fmt::format("complete -c crepesctl -n '__crepesctl_at {}'", place.path);
    if (!commands_of(*place.app).empty()) out << at << " -f\n";
    for (const Word& word : words_of(*place.app)) {
      const std::string about = replaced(replaced(word.about, "\\", "\\\\"), "'", "\\'");
      const bool is_option = word.text.starts_with("--");
      out << fmt::format(
          "{} {} {} -d '{}'\n", at, is_option ? "-l" : "-a",
          is_option ? word.text.substr(2) + (word.takes_value ? " -r" : "") : word.text, about);
    }
  }
  return out.str();
}

std::string completion(const std::string& shell, const CLI::App& app) {
  const std::vector<Place> places = places_of(app);
  if (shell == "zsh") return zsh_completion(places);
  if (shell == "fish") return fish_completion(places);
  return bash_completion(places);
}

}  // namespace

void add_completion(CommandLine& line) {
  auto& shell = line.make<std::string>();
  CLI::App* sub = line.add("completion",
                           "Print a shell script that completes crepesctl's commands and options");
  sub->add_option("SHELL", shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  line.run(sub, [&line, &shell] { return print_result(completion(shell, line.app())); });
}

}  // namespace crepes
