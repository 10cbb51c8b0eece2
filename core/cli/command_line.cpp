#include "cli/command_line.h"

#include "base/error.h"
#include "base/standard_output.h"
#include "base/words.h"
#include "cli/arguments.h"
#include "cli/process/python.h"
#include "cli/process/shell_line.h"
#include "scene/import/import.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <memory>
#include <sstream>
#include <system_error>
#include <utility>

namespace crt {
namespace {

constexpr const char* kSummary =
    "crt, a spectral path tracer. The same scene and seed give the same bits on every backend.";

constexpr const char* kExamples = R"(
Examples:
  crt configs/cornell_box.yaml                        with the best backend available
  crt --backend cuda configs/cornell_box.yaml         with this backend; all give the same bits
  crt scene.yaml --spp 1024 -o a.exr -o a.png         more samples, into these files
  crt scene.yaml --time 30m                           as many samples as 30 minutes allow
  crt scene.yaml --target-error 1%                    as many as it takes for an error of 1 % of the mean
  crt scene.yaml --resume --spp 4096                  continue after Ctrl-C, or from the last checkpoint
  crt scene.yaml --set film.resolution=[256,256] --set integrator.max_depth=4
  crt info scene.yaml                                 what a scene needs, and what its kernel leaves out

Half of the samples here and half on another machine, then both together:
  crt scene.yaml --samples 0:512 -o a.crtfilm
  crt scene.yaml --samples 512:1024 -o b.crtfilm
  crt merge -o scene.exr a.crtfilm b.crtfilm

Another exposure without another render:
  crt develop a.crtfilm -o a.png --set film.exposure_ev=1

In a pipe, with the scene on standard input and the image on standard output ('-o -' is a PPM):
  generate_scene | crt - -o -.png | display
)";

constexpr const char* kExitCodes = R"(
Exit codes: 0 done, 1 internal error, 2 command line, 3 scene, 4 backend or device not available,
5 the device failed or is too small (samples read back before are saved), 6 output not written, 7 images or
backends differ or a case of verify fails, 128 + n stopped by signal n, such as 130 by Ctrl-C and 143 by kill
(image and checkpoint are saved; a second signal stops at once).
)";

constexpr std::size_t kHelpColumns = 108, kHelpTextColumn = 28;

/// Breaks words into lines of kHelpColumns. All lines but the first are indented to column `from`, where the
/// first one begins.
std::string wrapped(const std::string& words, std::size_t from) {
    std::string text;
    std::size_t column = from;
    std::istringstream stream(words);
    for (std::string word; stream >> word; column += word.size()) {
        if (column > from && column + 1 + word.size() > kHelpColumns) {
            text += "\n" + std::string(from, ' ');
            column = from;
        } else if (column > from) {
            text += " ";
            ++column;
        }
        text += word;
    }
    return text + "\n";
}

/// Breaks paragraphs and explanations of options that are too wide for a terminal. Indented lines are
/// options, whose explanation begins at kHelpTextColumn, or examples, which are narrow enough.
std::string foldedHelp(const std::string& text) {
    std::string folded, paragraph;
    bool too_wide = false;
    const auto endParagraph = [&] {
        folded += too_wide ? wrapped(paragraph, 0) : paragraph;
        paragraph.clear();
        too_wide = false;
    };
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const bool is_wide = line.size() > kHelpColumns;
        if (!line.empty() && line[0] != ' ') {
            paragraph += line + "\n";
            too_wide = too_wide || is_wide;
            continue;
        }
        endParagraph();
        folded += is_wide ? line.substr(0, kHelpTextColumn) +
                                wrapped(line.substr(kHelpTextColumn), kHelpTextColumn)
                          : line + "\n";
    }
    endParagraph();
    return folded;
}

/// Usage lines as people write them, and on the top page the options of the command that needs no name.
class HelpFormatter : public CLI::Formatter {
public:
    explicit HelpFormatter(const CLI::App* render) : render_(render) { column_width(kHelpTextColumn); }

    std::string make_usage(const CLI::App* app, std::string) const override {
        if (app->get_parent() == nullptr)
            return "Usage: crt [render] SCENE [options]\n       crt COMMAND --help\n";
        std::string words;
        for (const CLI::Option* option :
             app->get_options([](const CLI::Option* o) { return o->get_positional(); })) {
            const std::string name = option->get_name(true) + (option->get_expected_max() > 1 ? "..." : "");
            words += option->get_required() ? " " + name : fmt::format(" [{}]", name);
        }
        return fmt::format("Usage: crt {}{} [options]\n",
                           app->get_name() == "render" ? "[render]" : app->get_name(), words);
    }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        if (app->get_parent() != nullptr) {
            return foldedHelp(make_usage(app, name) + "\n" + make_description(app) + options(app, mode) +
                              app->get_footer());
        }
        return foldedHelp(make_description(app) + "\n" + make_usage(app, name) +
                          make_subcommands(app, mode) + options(render_, mode) +
                          fmt::format("\n  {:<26}print the version, as 'crt version' does\n", "--version") +
                          app->get_footer());
    }

private:
    /// CLI11 puts two empty lines between groups.
    std::string options(const CLI::App* app, CLI::AppFormatMode mode) const {
        return CLI::detail::find_and_replace(make_groups(app, mode), "\n\n\n", "\n\n");
    }

    const CLI::App* render_;
};

CLI::Validator oneOf(std::vector<std::string> choices) {
    return CLI::Validator(
        [words = std::move(choices)](std::string& text) {
            if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
            const std::string hint = didYouMean(text, words);
            return fmt::format("takes one of {}, not '{}'{}", fmt::join(words, ", "), text,
                               hint.empty() ? "" : "; " + hint);
        },
        "");
}

/// CLI11's parser of the table.
class Parser {
public:
    explicit Parser(const std::vector<Command>& commands) : app_(kSummary) {
        app_.set_version_flag("--version", versionText());
        app_.require_subcommand(1);
        for (const Command& command : commands) addCommand(command);
        app_.footer(std::string(kExamples) +
                    kExitCodes);  // Now: commands inherit what is there when they are added.
        const auto formatter = std::make_shared<HelpFormatter>(app_.get_subcommand(commands.front().name));
        app_.formatter(formatter);
        for (CLI::App* command : app_.get_subcommands({})) command->formatter(formatter);
    }

    std::string help(const std::string& command) {
        return (command.empty() ? &app_ : app_.get_subcommand(command))->help();
    }

    /// The command that is asked for, whose values have been read; nothing when --help or --version has been
    /// printed instead. Throws crt::Error(Usage).
    const Command* parse(const std::vector<std::string>& arguments) {
        try {
            app_.parse(std::vector<std::string>(arguments.rbegin(),
                                                arguments.rend()));  // CLI11 takes them from the back.
        } catch (const CLI::CallForHelp&) {
            printOut("{}", chosenApp()->help());
            return nullptr;
        } catch (const CLI::CallForVersion& version) {
            printOut("{}\n", version.what());
            return nullptr;
        } catch (const CLI::ParseError& error) {
            refuse(error);
        }
        for (const auto& [option, read] : pending_) {
            if (option->get_items_expected_max() == 0) {
                if (option->count() > 0) read("");
                continue;
            }
            for (const std::string& value : option->results()) read(value);
        }
        return chosen_;
    }

    /// The command's arguments that are neither options nor values of options.
    std::vector<std::string> words(const Command& command) const {
        std::vector<std::string> words;
        for (const CLI::Option* option : app_.get_subcommand(command.name)->get_options())
            if (option->get_positional())
                words.insert(words.end(), option->results().begin(), option->results().end());
        return words;
    }

private:
    void addCommand(const Command& command) {
        CLI::App* app = app_.add_subcommand(command.name, command.summary);
        app->set_help_flag();  // Taken away here and added below, so that it comes last.
        for (const Argument& argument : command.arguments) {
            CLI::Option* option;
            if (argument.repeatable) {
                option = app->add_option(argument.name, lists_.emplace_back(), argument.help);
            } else {
                option = app->add_option(argument.name, words_.emplace_back(), argument.help);
            }
            option->required(argument.required);
            pending_.emplace_back(option, argument.read);
        }
        for (const OptionGroup& group : command.groups)
            for (const Option& option : group.options) addOption(*app, group.title, option);
        for (const OptionGroup& group : command.groups)
            for (const Option& option : group.options) {
                CLI::Option* added = app->get_option(option.names.substr(0, option.names.find(',')));
                for (const std::string& other : option.excludes) added->excludes(app->get_option(other));
                for (const std::string& other : option.needs) added->needs(app->get_option(other));
            }
        CLI::Option* help = app->set_help_flag("-h,--help", "print this help");
        if (!command.groups.empty()) help->group(command.groups.back().title);
        app->footer(command.notes);
        app->callback([this, &command] { chosen_ = &command; });
    }

    void addOption(CLI::App& app, const std::string& group, const Option& option) {
        CLI::Option* added;
        if (option.placeholder.empty()) {
            added = app.add_flag(option.names, option.help);
        } else {
            added = app.add_option_function<std::vector<std::string>>(
                           option.names, [](const std::vector<std::string>&) {}, option.help)
                        ->option_text(option.placeholder)
                        ->expected(1)
                        ->allow_extra_args(false)
                        ->multi_option_policy(option.repeatable ? CLI::MultiOptionPolicy::TakeAll
                                                                : CLI::MultiOptionPolicy::TakeLast);
            added->required(option.required);
            if (!option.choices.empty()) added->check(oneOf(option.choices));
            if (!option.environment.empty()) added->envname(option.environment);
        }
        added->group(group);
        pending_.emplace_back(added, option.read);
    }

    const CLI::App* chosenApp() const {
        return app_.get_subcommands().empty() ? &app_ : app_.get_subcommands().front();
    }

    /// CLI11 knows what is wrong, but not what was meant. Options come first: with one misspelt, the words
    /// after it are misread too.
    [[noreturn]] void refuse(const CLI::ParseError& error) {
        const CLI::App* command = chosenApp();
        const std::string place = command == &app_ ? "crt" : "crt " + command->get_name();
        const std::vector<std::string> left = app_.remaining(true);
        for (const std::string& word : left) {
            if (word.size() < 2 || word[0] != '-') continue;
            const std::string flag = word.substr(0, word.find('='));
            std::vector<std::string> names;
            for (const CLI::Option* option : command->get_options()) {
                for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
                for (const std::string& name : option->get_snames()) names.push_back("-" + name);
            }
            const std::string hint = didYouMean(flag, names);
            throw Error(ErrorKind::Usage,
                        fmt::format("{} has no option '{}'{}", place, flag,
                                    hint.empty() ? "; see '" + place + " --help'" : "; " + hint));
        }
        if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !left.empty())
            throw Error(ErrorKind::Usage,
                        command->get_name() == "render"
                            ? fmt::format("crt renders one scene at a time: remove '{}'", left.front())
                            : fmt::format("{} does not know what to do with '{}'", place, left.front()));
        if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
            const std::string text = error.what();  // "--spp: 1 required TEXT missing"
            throw Error(ErrorKind::Usage, fmt::format("{} needs a value; see '{} --help'",
                                                      text.substr(0, text.find(':')), place));
        }
        throw Error(ErrorKind::Usage, fmt::format("{}; see '{} --help'", error.what(), place));
    }

    CLI::App app_;
    std::vector<std::pair<CLI::Option*, std::function<void(const std::string&)>>> pending_;
    std::deque<std::string> words_;  ///< Of arguments; CLI11 keeps references.
    std::deque<std::vector<std::string>> lists_;
    const Command* chosen_ = nullptr;
};

bool takesScenes(const Command& command) {
    return std::any_of(command.arguments.begin(), command.arguments.end(), [](const Argument& argument) {
        const std::vector<std::string>& ends = argument.completion.words;
        return std::find(ends.begin(), ends.end(), "yaml") != ends.end();
    });
}

/// A scene that the Python package imports.
bool isForeignScene(const std::string& word) {
    std::error_code unknown;
    return !otherRendererOf(word).empty() && std::filesystem::is_regular_file(word, unknown);
}

/// Where the Python package, which knows no options, looks for it: right behind the command.
std::vector<std::string> sceneFirst(std::vector<std::string> arguments, const std::string& scene) {
    const auto found = std::find(arguments.begin() + 1, arguments.end(), scene);
    if (found != arguments.end()) std::rotate(arguments.begin() + 1, found, found + 1);
    return arguments;
}

std::vector<std::string> namesOf(const std::vector<Command>& commands) {
    std::vector<std::string> names;
    for (const Command& command : commands) names.push_back(command.name);
    return names;
}

}  // namespace

std::string versionText() { return "crt " CRT_VERSION; }
std::string programSummary() { return kSummary; }
std::string programExamples() { return kExamples; }
std::string programExitCodes() { return kExitCodes; }

std::string CommandLine::help(const std::string& command) const {
    const std::vector<std::string> names = namesOf(commands_);
    if (!command.empty() && std::find(names.begin(), names.end(), command) == names.end()) {
        const std::string hint = didYouMean(command, names);
        throw Error(ErrorKind::Usage,
                    fmt::format("there is no command '{}'; {}", command,
                                hint.empty() ? fmt::format("there are {}", fmt::join(names, ", ")) : hint));
    }
    return Parser(commands_).help(command);
}

int CommandLine::run(const std::vector<std::string>& words) const {
    const std::vector<std::string> arguments =
        writtenOut({words.begin() + 1, words.end()}, namesOf(commands_));
    if (arguments.empty())
        throw Error(ErrorKind::Usage,
                    "there is no scene to render; try 'crt configs/cornell_box.yaml', or 'crt --help'");
    Parser parser(commands_);
    const Command* command = parser.parse(arguments);
    if (command == nullptr) return 0;
    if (const std::vector<std::string> named = parser.words(*command);
        (takesScenes(*command) || command->name == "import") && !named.empty() &&
        isForeignScene(named.front()))
        becomePythonPackage(sceneFirst(arguments, named.front()));  // Returns where there is none.
    return command->run(shellLine(words));
}

}  // namespace crt
