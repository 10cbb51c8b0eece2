#include "base/error.h"
#include "base/standard_output.h"
#include "base/words.h"
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/completion.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace crt {
namespace {

constexpr const char* kCompletionNotes = R"x(
Packages of crt install these scripts where the shells look for them. Without a package:
  eval "$(crt completion bash)"                                      in ~/.bashrc
  eval "$(crt completion zsh)"                                       in ~/.zshrc, after compinit
  crt completion fish > ~/.config/fish/completions/crt.fish          once
)x";

std::string script(const std::string& shell, const std::vector<Command>& commands) {
    if (shell == "bash") return bashCompletion(commands);
    if (shell == "zsh") return zshCompletion(commands);
    if (shell == "fish") return fishCompletion(commands);
    const std::string hint = didYouMean(shell, {"bash", "zsh", "fish"});
    throw Error(ErrorKind::Usage, fmt::format("there is no completion for '{}'; {}", shell,
                                              hint.empty() ? "there is for bash, zsh and fish" : hint));
}

}  // namespace

Command completionCommand(const CommandLine& all) {
    const auto shell = std::make_shared<std::string>();
    return {.name = "completion",
            .summary = "print the script with which a shell completes crt's command line",
            .arguments = {{.name = "SHELL",
                           .help = "bash, zsh or fish",
                           .read = [shell](const std::string& text) { *shell = text; },
                           .completion = completeWord({"bash", "zsh", "fish"})}},
            .notes = kCompletionNotes,
            .run = [shell, &all](const std::string&) {
                printOut("{}", script(*shell, all.commands()));
                return 0;
            }};
}

}  // namespace crt
