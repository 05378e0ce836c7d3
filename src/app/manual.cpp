#include "app/manual.h"

#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "core/text.h"

namespace catoptric::app {
namespace {

/// What the help of a command lists.
Rows optionsOf(const Command& command) {
  static bool ignored = false;
  return Rows{flag(kHelpNames, ignored, kHelpText)} + command.options;
}

/// Text for troff: its escape character, hyphens that are typed, and lines that begin like a
/// request.
std::string troff(const std::string& text) {
  std::string page;
  for (const char c : text) {
    if (page.empty() || page.back() == '\n') {
      if (c == '.' || c == '\'') page += "\\&";
    }
    if (c == '\\')
      page += "\\e";
    else if (c == '-')
      page += "\\-";
    else
      page += c;
  }
  return page;
}

/// Lines that stay as they are.
std::string verbatim(const std::string& text) {
  return ".nf\n" + troff(text) + (text.ends_with('\n') ? "" : "\n") + ".fi\n";
}

/// ".TP" and an option's names, value and help.
std::string optionEntry(const OptionRow& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names()) names.push_back("\\fB" + troff(name) + "\\fR");
  std::string entry = ".TP\n" + joined(names, ", ");
  if (!option.isFlag())
    entry += (names.empty() ? "\\fI" : " \\fI") + troff(option.valueName) + "\\fR";
  return entry + "\n" + troff(option.fullHelp()) + "\n";
}

/// "catoptric render [OPTIONS] CONFIG|SCENE".
std::string synopsis(const Command& command) {
  std::string line = "\\fBcatoptric " + command.name + "\\fR [\\fIOPTIONS\\fR]";
  for (const OptionRow& option : command.options)
    if (option.isArgument())
      line += (option.rules.required ? " \\fI" : " [\\fI") + troff(option.valueName) +
              (option.isList() ? "\\fR..." : "\\fR") + (option.rules.required ? "" : "]");
  return line + "\n";
}

std::string commandSection(const Command& command) {
  std::string page =
      ".SS " + command.name + "\n" + synopsis(command) + ".PP\n" + troff(command.summary) + "\n";
  for (const OptionRow& option : optionsOf(command)) page += optionEntry(option);
  std::istringstream footer(command.footer);
  std::string lines;
  for (std::string line; std::getline(footer, line);)
    if (!line.empty()) lines += line + "\n";
  return lines.empty() ? page : page + ".PP\n" + verbatim(lines);
}

/// Words that an option's value may be; the tests hold that its help text names them all.
std::map<std::string, std::vector<std::string>> valueWords() {
  // The shell asks for the methods, so that a new one needs no new completion
  return {{"--method", {"$(catoptric list methods 2>/dev/null | sed 's/ .*//')"}},
          {"--existing", {"error", "overwrite", "resume"}},
          {"--set", {"$(catoptric list options 2>/dev/null | sed 's/ .*/=/')"}},
          {"--to", {"slurm", "script"}},
          {"--vary", {"$(catoptric list options 2>/dev/null | sed 's/ .*/=/')"}},
          {"--progress", {"auto", "bar", "plain", "json", "none"}},
          {"--device", {"auto", "surfaceless", "osmesa"}},
          {"--schema", {"run", "scene", "path", "suite", "nightly"}},
          {"--completion", {"bash", "zsh"}}};
}

constexpr const char* kBashStart =
    R"(# Completes command lines of catoptric in bash. Made by `catoptric list --completion bash`; do not edit.
_catoptric() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "@COMMANDS@ --help --version" -- "$word"))
    return
  fi
  case $before in
)";

constexpr const char* kBashMiddle = R"(  esac
  local options=
  case $command in
)";

constexpr const char* kBashEnd = R"(  esac
  if [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  elif [ "$command" = list ]; then
    COMPREPLY=($(compgen -W "@WHAT@" -- "$word"))
  else
    compopt -o filenames 2>/dev/null
    COMPREPLY=($(compgen -f -- "$word"))
  fi
}
complete -F _catoptric catoptric
)";

std::string replaced(std::string text, const std::string& mark, const std::string& by) {
  const std::size_t at = text.find(mark);
  return text.replace(at, mark.size(), by);
}

/// The words that the help text of `list` names: "any of methods, options, ...;".
std::string listWords(const Program& program) {
  const std::string& help = program.command("list").options.front().help;
  const std::size_t begin = help.find("any of ") + 7;
  std::string words = help.substr(begin, help.find(';') - begin);
  std::erase(words, ',');
  return words;
}

std::string bashCompletion(const Program& program) {
  std::vector<std::string> names;
  std::string options;
  for (const Command& command : program.commands) {
    names.push_back(command.name);
    std::vector<std::string> all;
    for (const OptionRow& option : optionsOf(command))
      for (const std::string& name : option.names())
        if (name.starts_with("--")) all.push_back(name);
    options += "    " + command.name + ") options=\"" + joined(all, " ") + "\" ;;\n";
  }
  std::string values;
  for (const auto& [option, words] : valueWords())
    values += "    " + option + ") " +
              (words.front().find('=') != std::string::npos ? "compopt -o nospace; " : "") +
              "COMPREPLY=($(compgen -W \"" + joined(words, " ") + "\" -- \"$word\")); return ;;\n";
  return replaced(kBashStart, "@COMMANDS@", joined(names, " ")) + values + kBashMiddle + options +
         replaced(kBashEnd, "@WHAT@", listWords(program));
}

}  // namespace

std::string manPage(const Program& program) {
  std::string page =
      ".\\\" Made by `catoptric list --man`; do not edit.\n"
      ".TH CATOPTRIC 1\n.SH NAME\ncatoptric \\- renders reflections along camera paths\n"
      ".SH SYNOPSIS\n";
  for (const Command& command : program.commands) page += synopsis(command) + ".br\n";
  page += ".SH DESCRIPTION\n" + troff(program.summary) +
          "\n.SH COMMANDS\nBrackets after the text of an option give its default.\n";
  for (const Command& command : program.commands) page += commandSection(command);
  const std::string& footer = program.footer;
  const std::size_t codes = footer.find("Exit codes:\n");
  page += ".SH EXIT STATUS\n" + verbatim(footer.substr(footer.find('\n', codes) + 1));
  page += ".SH EXAMPLES\n" +
          verbatim(footer.substr(footer.find('\n') + 1, codes - footer.find('\n') - 2));
  return page +
         ".SH ENVIRONMENT\n.TP\n\\fBCATOPTRIC_CACHE\\fR\n"
         "Folder of baked light [$XDG_CACHE_HOME/catoptric or ~/.cache/catoptric]\n"
         ".TP\n\\fBCATOPTRIC_SCENE_MIB\\fR\nMemory that a scene may take, in MiB [4096]\n"
         ".TP\n\\fBNO_COLOR\\fR\nIf it is not empty, standard error has no colours\n"
         ".SH SEE ALSO\nThe documentation in share/doc/catoptric.\n";
}

std::string completion(const Program& program, const std::string& shell) {
  if (shell == "bash") return bashCompletion(program);
  if (shell == "zsh")
    return "#compdef catoptric\n# Made by `catoptric list --completion zsh`; do not edit.\n"
           "autoload -U +X bashcompinit && bashcompinit\n" +
           bashCompletion(program);
  const std::array<std::string, 2> known = {"bash", "zsh"};
  throw UsageError("--completion: \"" + shell + "\" is not known" + didYouMean(shell, known) +
                   "; allowed: bash, zsh");
}

}  // namespace catoptric::app
