#include "cli/completion.h"

#include "backend/loader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

namespace crt {
namespace {

/// The backends of crt. Users type the names of others.
std::vector<std::string> backendNames() {
    std::vector<std::string> names = knownBackends();
    names.insert(names.begin(), "auto");
    return names;
}

std::vector<std::string> namesOf(const Option& option) {
    std::vector<std::string> names;
    for (std::size_t begin = 0; begin <= option.names.size();) {
        const std::size_t end = std::min(option.names.find(',', begin), option.names.size());
        names.push_back(option.names.substr(begin, end - begin));
        begin = end + 1;
    }
    return names;
}

/// All options of a command: those of the table, and --help, which every command has.
std::vector<Option> optionsOf(const Command& command) {
    std::vector<Option> options;
    for (const OptionGroup& group : command.groups)
        options.insert(options.end(), group.options.begin(), group.options.end());
    options.push_back({.names = "-h,--help", .placeholder = {}, .help = "print this help", .read = {}});
    return options;
}

bool takesValue(const Option& option) { return !option.placeholder.empty(); }
/// "[FILE]": the value may be left out.
bool valueIsOptional(const Option& option) { return option.placeholder.starts_with("["); }

std::vector<std::string> commandNames(const std::vector<Command>& commands) {
    std::vector<std::string> names;
    for (const Command& command : commands) names.push_back(command.name);
    return names;
}

/// Words to choose from, for the kinds that have any.
std::vector<std::string> wordsOf(const Completion& completion, const std::vector<Command>& commands) {
    switch (completion.kind) {
        case Completion::Kind::Word:
        case Completion::Kind::Setting: return completion.words;
        case Completion::Kind::Backend: return backendNames();
        case Completion::Kind::Command: return commandNames(commands);
        default: return {};
    }
}

/// Prints the names of `crt data`, one a line.
constexpr const char* kListData = "crt data 2>/dev/null | sed -n 's|^  \\([^ /]*/[^ ]*\\).*|\\1|p'";

// ---- bash

std::string bashValue(const Completion& completion, const std::vector<Command>& commands) {
    switch (completion.kind) {
        case Completion::Kind::None: return ":";
        case Completion::Kind::File: return fmt::format("_crt_files {}", fmt::join(completion.words, " "));
        case Completion::Kind::Folder: return "_crt_folders";
        case Completion::Kind::Data: return fmt::format("_crt_words $({})", kListData);
        case Completion::Kind::Setting:
            return fmt::format("compopt -o nospace 2>/dev/null; _crt_words {}",
                               fmt::join(completion.words, " "));
        default: return fmt::format("_crt_words {}", fmt::join(wordsOf(completion, commands), " "));
    }
}

std::string bashCommand(const Command& command, const std::vector<Command>& commands) {
    std::vector<std::string> names;
    std::string cases;
    for (const Option& option : optionsOf(command)) {
        const std::vector<std::string> own = namesOf(option);
        names.insert(names.end(), own.begin(), own.end());
        if (!takesValue(option)) continue;
        cases += fmt::format("                {}) {}{} ;;\n", fmt::join(own, "|"),
                             bashValue(option.completion, commands),
                             valueIsOptional(option) ? "" : "; return");
    }
    std::string text = fmt::format("        {})\n", command.name);
    if (!cases.empty()) text += fmt::format("            case $previous in\n{}            esac\n", cases);
    text += fmt::format("            if [[ $current == -* ]]; then _crt_words {}; return; fi\n",
                        fmt::join(names, " "));
    if (!command.arguments.empty())
        text += fmt::format("            {}\n", bashValue(command.arguments.front().completion, commands));
    return text + "            ;;\n";
}

constexpr std::string_view kBashHead = R"(# Completion of crt for bash, made by 'crt completion bash'.

_crt_words() {
    local word
    for word in "$@"; do
        [[ $word == "$current"* ]] && COMPREPLY+=("$word")
    done
}

_crt_folders() {
    local name
    compopt -o filenames 2>/dev/null
    while IFS= read -r name; do COMPREPLY+=("$name"); done < <(compgen -d -- "$current")
}

# Files with one of these extensions, and folders that may hold some.
_crt_files() {
    local name extension
    compopt -o filenames 2>/dev/null
    while IFS= read -r name; do
        if [[ -d $name || $# -eq 0 ]]; then COMPREPLY+=("$name"); continue; fi
        for extension in "$@"; do
            [[ $name == *."$extension" ]] && COMPREPLY+=("$name")
        done
    done < <(compgen -f -- "$current")
}

)";

// ---- zsh

/// Within the brackets of a specification of _arguments, which stands in single quotes.
std::string zshHelp(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
        out += c == '\n' ? std::string(" ") : c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    return out;
}

std::string zshAction(const Completion& completion, const std::vector<Command>& commands) {
    switch (completion.kind) {
        case Completion::Kind::None: return " ";
        case Completion::Kind::Folder: return "_files -/";
        case Completion::Kind::Data: return "_crt_data";
        case Completion::Kind::File:
            return completion.words.empty()
                       ? "_files"
                       : fmt::format("_files -g \"*.({})(-.)\"", fmt::join(completion.words, "|"));
        case Completion::Kind::Setting:
            return fmt::format("{{compadd -S \"\" - {}}}", fmt::join(completion.words, " "));
        default: return fmt::format("({})", fmt::join(wordsOf(completion, commands), " "));
    }
}

std::string zshOption(const Option& option, const std::vector<Command>& commands) {
    const std::vector<std::string> names = namesOf(option);
    std::string value;
    if (takesValue(option)) {
        std::string placeholder = option.placeholder;
        std::erase_if(placeholder, [](char c) { return c == '[' || c == ']'; });
        value = fmt::format("{}{}:{}", valueIsOptional(option) ? "::" : ":", zshHelp(placeholder),
                            zshAction(option.completion, commands));
    }
    const std::string rest = fmt::format("[{}]{}", zshHelp(option.help), value);
    const std::string others = option.repeatable ? "*" : fmt::format("({})", fmt::join(names, " "));
    if (names.size() == 1) return fmt::format("'{}{}{}'", others, names.front(), rest);
    return fmt::format("'{}'{{{}}}'{}'", others, fmt::join(names, ","), rest);
}

std::string zshCommand(const Command& command, const std::vector<Command>& commands) {
    std::string text = fmt::format("        {})\n            _arguments", command.name);
    for (const Option& option : optionsOf(command))
        text += fmt::format(" \\\n                {}", zshOption(option, commands));
    int position = 0;
    for (const Argument& argument : command.arguments) {
        const std::string place = argument.repeatable ? "*" : std::to_string(++position);
        text += fmt::format(" \\\n                '{}{}{}:{}'", place, argument.required ? ":" : "::",
                            argument.name, zshAction(argument.completion, commands));
    }
    return text + "\n            ;;\n";
}

// ---- fish

std::string fishQuoted(std::string_view text) {
    std::string out = "'";
    for (const char c : text) {
        if (c == '\'' || c == '\\') out += '\\';
        out += c == '\n' ? ' ' : c;
    }
    return out + "'";
}

/// The value of -a, and whether files that do not fit are offered too.
std::string fishValue(const Completion& completion, const std::vector<Command>& commands) {
    switch (completion.kind) {
        case Completion::Kind::None: return {};
        case Completion::Kind::Folder: return " -a '(__fish_complete_directories)'";
        case Completion::Kind::Data:
            return fmt::format(" -a {}", fishQuoted(fmt::format("({})", kListData)));
        case Completion::Kind::File: {
            std::string calls;
            for (const std::string& extension : completion.words)
                calls += fmt::format("{}__fish_complete_suffix .{}", calls.empty() ? "" : "; ", extension);
            return fmt::format(" -k -a '({})'", calls.empty() ? "__fish_complete_path" : calls);
        }
        default:
            return fmt::format(" -a {}",
                               fishQuoted(fmt::format("{}", fmt::join(wordsOf(completion, commands), " "))));
    }
}

std::string fishCommand(const Command& command, const std::vector<Command>& commands) {
    const std::string condition = fmt::format("complete -c crt -n '__crt_command_is {}'", command.name);
    std::string text;
    for (const Argument& argument : command.arguments)
        if (const std::string value = fishValue(argument.completion, commands); !value.empty())
            text += condition + value + "\n";
    for (const Option& option : optionsOf(command)) {
        std::string names;
        for (const std::string& name : namesOf(option))
            names += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
        const bool required = takesValue(option) && !valueIsOptional(option);
        text += fmt::format("{}{}{}{} -d {}\n", condition, names, required ? " -x" : "",
                            takesValue(option) ? fishValue(option.completion, commands) : "",
                            fishQuoted(option.help));
    }
    return text;
}

}  // namespace

std::string bashCompletion(const std::vector<Command>& commands) {
    const std::string names = fmt::format("{}", fmt::join(commandNames(commands), " "));
    std::string text(kBashHead);
    text +=
        "_crt() {\n"
        "    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} command=render\n"
        "    COMPREPLY=()\n"
        "    # bash takes --option=value apart.\n"
        "    if [[ $current == = ]]; then current=\n"
        "    elif [[ $previous == = ]]; then previous=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
        "    if ((COMP_CWORD > 1)); then\n"
        "        case ${COMP_WORDS[1]} in\n";
    text += fmt::format("            {}) command=${{COMP_WORDS[1]}} ;;\n",
                        fmt::join(commandNames(commands), "|"));
    text += "        esac\n"
            "    elif [[ $current == -* ]]; then\n"
            "        _crt_words --version\n"
            "    else\n";
    text += fmt::format("        _crt_words {}\n", names);
    text += "    fi\n"
            "    case $command in\n";
    for (const Command& command : commands) text += bashCommand(command, commands);
    text += "    esac\n}\n\ncomplete -F _crt crt\n";
    return text;
}

std::string zshCompletion(const std::vector<Command>& commands) {
    std::string text = "#compdef crt\n# Completion of crt for zsh, made by 'crt completion zsh'.\n\n";
    text += fmt::format("_crt_data() {{\n    local -a names\n    names=(${{(f)\"$({})\"}})\n"
                        "    compadd -a names\n}}\n\n",
                        kListData);
    text += "_crt() {\n    local command=render\n    local -a commands\n    commands=(\n";
    for (const Command& command : commands)
        text += fmt::format("        '{}:{}'\n", command.name, zshHelp(command.summary));
    text += "    )\n"
            "    if (( CURRENT == 2 )); then\n"
            "        _describe -t commands command commands\n"
            "    elif (( ${commands[(I)${words[2]}:*]} )); then\n"
            "        command=${words[2]}\n"
            "        shift words\n"
            "        (( CURRENT-- ))\n"
            "    fi\n"
            "    case $command in\n";
    for (const Command& command : commands) text += zshCommand(command, commands);
    text += "    esac\n}\n\n"
            "if [[ $funcstack[1] == _crt ]]; then _crt \"$@\"; else compdef _crt crt; fi\n";
    return text;
}

std::string fishCompletion(const std::vector<Command>& commands) {
    std::string text = "# Completion of crt for fish, made by 'crt completion fish'.\n\n";
    text += fmt::format("function __crt_command_is\n"
                        "    set -l words (commandline -opc)\n"
                        "    set -l command render\n"
                        "    if test (count $words) -gt 1; and contains -- $words[2] {}\n"
                        "        set command $words[2]\n"
                        "    end\n"
                        "    test $command = $argv[1]\n"
                        "end\n\n"
                        "function __crt_no_word_yet\n"
                        "    test (count (commandline -opc)) -eq 1\n"
                        "end\n\n"
                        "complete -c crt -f\n"
                        "complete -c crt -n __crt_no_word_yet -l version -d 'print the version'\n",
                        fmt::join(commandNames(commands), " "));
    for (const Command& command : commands)
        text += fmt::format("complete -c crt -n __crt_no_word_yet -a {} -d {}\n", command.name,
                            fishQuoted(command.summary));
    for (const Command& command : commands) text += fishCommand(command, commands);
    return text;
}

}  // namespace crt
