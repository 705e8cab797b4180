#include "app/base/terminal/bash_completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

namespace plumbline::terminal {
namespace {

/// Case branches of the script: subcommands, words of a command, values of an option.
struct Cases {
  std::string commands, words, values;
};

bool IsHidden(const CLI::App& command) {
  return command.get_group().empty();
}

/// The short names and the first long name; further long names are previous names, kept for
/// scripts.
std::vector<std::string> SpellingsOf(const CLI::Option& option) {
  std::vector<std::string> spellings;
  if (option.get_group().empty()) return spellings;
  for (const std::string& name : option.get_snames()) spellings.push_back("-" + name);
  if (!option.get_lnames().empty()) spellings.push_back("--" + option.get_lnames().front());
  return spellings;
}

/// "a b" for an option of type "TEXT:{a,b}"; empty if the values are not enumerated.
std::string ListedValues(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto from = type.find('{'), to = type.find('}');
  if (from == std::string::npos || to == std::string::npos) return "";
  std::string values = type.substr(from + 1, to - from - 1);
  std::replace(values.begin(), values.end(), ',', ' ');
  return values;
}

/// @param path  the command with its parents, "journal import"; empty for plumbline itself
void AddCases(const CLI::App& app, const std::string& path, Cases& cases) {
  std::vector<std::string> words;
  for (const CLI::Option* option : app.get_options()) {
    const std::vector<std::string> spellings = SpellingsOf(*option);
    words.insert(words.end(), spellings.begin(), spellings.end());
    const std::string values = ListedValues(*option);
    if (values.empty()) continue;
    for (const std::string& spelling : spellings) {
      cases.values += fmt::format("    '{} {}') words='{}' ;;\n", path, spelling, values);
    }
  }
  const auto commands = app.get_subcommands([](const CLI::App* one) { return !IsHidden(*one); });
  for (const CLI::App* command : commands) {
    const std::string whole = path + (path.empty() ? "" : " ") + command->get_name();
    cases.commands +=
        fmt::format("      '{} {}') path='{}' ;;\n", path, command->get_name(), whole);
    words.push_back(command->get_name());
    AddCases(*command, whole, cases);
  }
  cases.words += fmt::format("    '{}') words='{}' ;;\n", path, fmt::join(words, " "));
}

}  // namespace

std::string BashCompletion(const CLI::App& app, const std::string& program) {
  std::string name = program;
  std::replace(name.begin(), name.end(), '-', '_');
  Cases cases;
  AddCases(app, "", cases);
  return fmt::format(R"(_{}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} path= words= i
  if [[ $word == = ]]; then  # --option=
    word=
  elif [[ $previous == = ]]; then  # --option=val
    previous=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "$path ${{COMP_WORDS[i]}}" in
{}    esac
  done
  case "$path $previous" in
{}  esac
  if [[ -z $words ]]; then
    case $path in
{}    esac
    if [[ $word == -* ]]; then  # options only
      words=$(printf '%s\n' $words | grep -e ^-)
    else  # commands; if there are none, file names
      words=$(printf '%s\n' $words | grep -ve ^-)
    fi
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
)",
                     name, cases.commands, cases.values, cases.words);
}

}  // namespace plumbline::terminal
