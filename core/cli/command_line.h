/// The command line as a whole: words → a command of the table that has read its values, and --help.
#pragma once

#include "cli/command.h"

#include <string>
#include <vector>

namespace crt {

class CommandLine {
public:
    /// The first one is what a command line without a command's name means.
    void add(Command command) { commands_.push_back(std::move(command)); }

    const std::vector<Command>& commands() const { return commands_; }

    /// The text that `crt COMMAND --help` prints; without a command the text of `crt --help`. Throws
    /// crt::Error(Usage) for a command that there is not.
    std::string help(const std::string& command = {}) const;

    /// Runs what argv asks for and returns the exit code. Throws crt::Error.
    int run(const std::vector<std::string>& words) const;

private:
    std::vector<Command> commands_;
};

/// "crt 0.1.0".
std::string versionText();
/// The description of the program, the examples and the exit codes of `crt --help`.
std::string programSummary();
std::string programExamples();
std::string programExitCodes();

}  // namespace crt
