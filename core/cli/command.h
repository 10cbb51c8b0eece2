/// The commands of crt as a table. The parser, --help, the man page and the shells' completion are all made
/// from it, so none of them can know an option that the others do not.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Completions that a shell offers for a value.
struct Completion {
    enum class Kind {
        None,
        File,     ///< Files whose extension is one of `words`, without the dot; all files if it is empty.
        Folder,
        Word,     ///< One of `words`.
        Backend,  ///< The names that `crt plugins` lists.
        Data,     ///< The names that `crt data` lists.
        Command,
        Setting,  ///< One of `words`, which end with '=': the value follows without a space.
    };
    Kind kind = Kind::None;
    std::vector<std::string> words{};
};

inline Completion completeFile(std::vector<std::string> extensions = {}) {
    return {Completion::Kind::File, std::move(extensions)};
}
inline Completion completeWord(std::vector<std::string> words) {
    return {Completion::Kind::Word, std::move(words)};
}

struct Option {
    std::string names;        ///< "-o,--output".
    std::string placeholder;  ///< "FILE". Empty: a flag, which takes no value.
    std::string help;
    /// Takes each value given, once the whole command line is known to be well formed; a flag's is "".
    std::function<void(const std::string&)> read;
    Completion completion{};
    std::vector<std::string> choices{};  ///< Where there are any, other values are refused.
    std::string environment{};           ///< Variable that is read where the option is not given.
    bool repeatable = false;             ///< Else the last one counts.
    bool required = false;
    std::vector<std::string> excludes{}, needs{};  ///< Options, by their long names.
};

/// Options under one heading of --help.
struct OptionGroup {
    std::string title;
    std::vector<Option> options{};
};

/// A word without an option's name before it.
struct Argument {
    std::string name;  ///< "SCENE".
    std::string help;
    std::function<void(const std::string&)> read;
    Completion completion{};
    bool required = true;
    bool repeatable = false;  ///< One or more, or any number where it is not required.
};

struct Command {
    std::string name;
    std::string summary;  ///< One line.
    std::vector<Argument> arguments{};
    std::vector<OptionGroup> groups{};
    std::string notes{};  ///< Below the options in --help: explanations and examples.
    /// Takes the command line as typed and returns the exit code. Throws crt::Error.
    std::function<int(const std::string& typed)> run;
};

}  // namespace crt
